#include "daemon/services/line.h"

#include "base/overloaded.h"

namespace bushd::daemon {

motion::LineShare Straight::share(std::size_t motor, std::uint32_t from, std::uint32_t to) const {
  motion::LineShare share = way.share(motor, from, to);
  share.by = by;
  return share;
}

motion::LineShare AlongPath::share(std::size_t motor, std::uint32_t from, std::uint32_t to) {
  motion::LineShare share{.way = path->number(),
                          .track = {},
                          .motor = motor,
                          .longest = longest(),
                          .from = from,
                          .to = to};
  // One that makes no step of it only waits.
  const auto moves = [motor](const motion::Path& of) { return of.most_steps_per_s(motor) > 0; };
  if (rest->first_step() == from && to == rest->steps()) {
    share.increment = moves(*rest) ? 1 : 0;
    if (!track) track = std::make_shared<const motion::PathTrack>(rest, to);
    share.track = track;
    return share;
  }
  // One that has stopped earlier than others goes after them: some segments.
  std::shared_ptr<motion::Path> part = path->rest(from, path->segment_at(to - 1));
  part->plan(SIZE_MAX);
  share.increment = moves(*part) ? 1 : 0;
  share.track = std::make_shared<const motion::PathTrack>(part, to);
  return share;
}

bool Line::waits() const {
  const Straight* way = straight();
  return way != nullptr && way->trigger && way->trigger->waits;
}

bool Line::has_begun() const {
  const Straight* way = straight();
  return way == nullptr || !way->trigger || way->trigger->begun;
}

std::size_t Line::legs() const {
  return straight() != nullptr ? straight()->points.size() : 1;
}

std::int64_t Line::end_of(std::size_t motor) const {
  return std::visit(
      Overloaded{
          [&](const Straight& line) { return line.points.back().steps[motor]; },
          [&](const AlongPath& along) { return along.path->point(along.path->segments(), motor); }},
      course);
}

std::uint32_t Line::longest() const {
  return std::visit(Overloaded{[](const Straight& line) { return line.way.longest(); },
                               [](const AlongPath& along) { return along.longest(); }},
                    course);
}

std::int64_t Line::position_at(std::size_t motor, std::uint32_t step) const {
  return std::visit(
      Overloaded{[&](const Straight& line) { return line.way.position_at(motor, step); },
                 [&](const AlongPath& along) { return along.path->position_at(motor, step); }},
      course);
}

double Line::most_steps_per_s(std::size_t motor) const {
  return std::visit(
      Overloaded{[&](const Straight& line) { return line.way.most_steps_per_s(motor); },
                 [&](const AlongPath& along) { return along.path->most_steps_per_s(motor); }},
      course);
}

bool Line::is_of(const motion::LineShare& share) const {
  return std::visit(
      Overloaded{[&](const Straight& line) { return share.table == line.way.table(); },
                 [&](const AlongPath& along) {
                   return share.way == along.path->number() && share.track != nullptr;
                 }},
      course);
}

motion::LineShare Line::share(std::size_t motor, std::uint32_t from, std::uint32_t to) {
  return std::visit([&](auto& along) { return along.share(motor, from, to); }, course);
}

}  // namespace bushd::daemon
