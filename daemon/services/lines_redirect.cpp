// A line for motors that move on one: another end of it, or another speed.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "daemon/services/lines.h"
#include "words/remedy.h"

namespace bushd::daemon {

Result<std::uint64_t> Lines::number_of(const std::vector<MotorId>& motors) const {
  const motion::OnLine* first = installation_[motors.front()].as<motion::OnLine>();
  const auto whole = first == nullptr ? lines_.end() : lines_.find(first->line);
  for (const MotorId motor : motors) {
    if (whole != lines_.end() && on_line(motor, whole->first) != nullptr) continue;
    return fail(fmt::format(
        "{} is not on one line with the others: motors of a line begin it at rest; stop "
        "those that move first",
        installation_[motor].name()));
  }
  if (motors.size() != whole->second.motors.size()) {
    return fail(
        fmt::format("{} motors move on this line and {} are named; name all of them, or "
                    "run {} first",
                    whole->second.motors.size(), motors.size(),
                    words::remedy("stop", installation_[motors.front()].name())));
  }
  return whole->first;
}

// The step of the line at which all motors are where they are asked to be.
Result<std::uint32_t> Lines::step_of(const Line& line, const std::vector<MotorId>& motors,
                                     const api::MoveLine& request,
                                     std::vector<units::Steps>& targets) const {
  const motion::Way& way = line.straight()->way;
  const std::vector<motion::Way::Motor>& ways = way.motors();
  targets.resize(motors.size());
  std::optional<std::int64_t> step;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const motion::Motor& motor = installation_[motors[i]];
    const bool absolute = request.kind == api::Move::Kind::kAbsolute;
    const api::Amount& amount = request.motors[i].amount;
    const auto steps =
        absolute ? motor.scale().position_of(amount) : motor.scale().distance_of(amount);
    if (!steps) return fail(motor.name() + ": " + steps.error().message);
    const auto at =
        static_cast<std::size_t>(std::ranges::find(line.motors, motors[i]) - line.motors.begin());
    // Compared before any arithmetic: the sum of two values from outside could overflow.
    if (std::abs(steps->whole / 2) > motion::Motor::kMaxPosition) {
      return fail(fmt::format("{}: {} steps is out of range; allowed: +-{}", motor.name(),
                              steps->whole, motion::Motor::kMaxPosition));
    }
    const auto from = absolute ? Result<units::Steps>() : motor.reach().distance_from();
    if (!from) return fail(motor.name() + ": " + from.error().message);
    targets[at] = *steps + *from;
    if (!way.is_elementary() && way.increment(at) != way.longest()) continue;
    const std::int64_t made =
        (targets[at].whole - ways[at].from) * (ways[at].to < ways[at].from ? -1 : 1);
    step = way.is_elementary() ? step.value_or(0) + made : made;
  }
  const std::uint32_t end = line.target;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    const motion::Motor& motor = installation_[line.motors[i]];
    if (*step < 0 || *step > end) {
      return fail(
          fmt::format("{}: {} is beyond the ends of the line that is under way; run {} first, "
                      "or wait for its result",
                      motor.name(), motor.scale().coordinates().text(targets[i].whole),
                      words::remedy("stop", motor.name())));
    }
    const auto s = static_cast<std::uint32_t>(*step);
    const std::int64_t on_way = way.position_at(i, s);
    if (targets[i].whole == on_way) continue;
    return fail(
        fmt::format("{}: {} is not on the line that is under way, which leads through {} "
                    "there; run {} first, or wait for its result",
                    motor.name(), motor.scale().coordinates().text(targets[i].whole),
                    motor.scale().coordinates().text(on_way), words::remedy("stop", motor.name())));
  }
  return static_cast<std::uint32_t>(*step);
}

void Lines::redirect(std::int64_t now_us, const api::Asker& asker,
                     const std::vector<MotorId>& motors, const api::MoveLine& request) {
  const auto refuse = [&asker](const std::string& why) { asker.answer(api::Refused{why}); };
  const std::string& name = installation_[motors.front()].name();
  if (request.dry_run) return refuse(name + " moves; a dry run is of lines from rest");
  if (request.duration_s) {
    return refuse("the line is under way: a duration is of a line from rest; give a speed");
  }
  const auto number = number_of(motors);
  if (!number) return refuse(number.error().text());
  Line& line = lines_.at(*number);
  const std::string stop = "run " + words::remedy("stop", name) + " first";
  Straight* straight = line.straight();
  if (straight == nullptr) {
    return refuse(name + " moves on a path; " + stop + ", or wait for its result");
  }
  if (straight->points.size() > 1) {
    return refuse("the line ends in a last approach for backlash; " + stop);
  }
  if (request.law == api::MoveLine::Law::kElementary && !straight->way.is_elementary()) {
    return refuse("the line under way is not by the elementary law, and a line keeps its law; " +
                  stop);
  }
  std::optional<Feed> feed;
  if (request.feed) {
    auto asked = Feed::make(installation_, line.motors, *request.feed, straight->law);
    if (!asked) return refuse(asked.error().text());
    if (auto may = asked->is_possible(asked->step_ns(straight->way)); !may)
      return refuse(may.error().text());
    feed = std::move(*asked);
  }
  std::vector<bushd_delay> shortest_delays;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    const motion::Motor& motor = installation_[line.motors[i]];
    if (motor.stops() || motor.is_paused() || motor.as<motion::OnLine>()->stands) {
      return refuse(motor.name() + " is being stopped or paused; wait for that, or resume it");
    }
    const auto shortest_delay = moves_.shortest_delay_of(line.motors[i], request.speed);
    if (!shortest_delay) return refuse(shortest_delay.error().text());
    shortest_delays.push_back(shortest_delay_by(straight->by, line.motors[i], *shortest_delay));
  }
  std::vector<units::Steps> targets;
  const auto step = step_of(line, motors, request, targets);
  if (!step) return refuse(step.error().text());
  motion::Way& way = straight->way;
  way.set_shortest_delays(shortest_delays);
  if (feed) way.slow_down_to(feed->step_ns(way), true);
  straight->feed = std::move(feed);
  asker.answer(api::Accepted{});
  moves_.take_over(line.motors, asker);
  line.target = *step;
  Straight::Point& to = straight->points.front();
  to.shortest_delays = shortest_delays;
  to.asked_for = std::move(targets);
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    to.steps[i] = way.position_at(i, *step);
    motion::OnLine now = *installation_[line.motors[i]].as<motion::OnLine>();
    now.target_steps = to.steps[i];
    now.last_run = true;
    installation_[line.motors[i]].line().aim(now, *step, way.shortest_delay());
  }
  open(asker, *number, line);
  moves_.redirect_on_line(now_us, line.motors);
}

}  // namespace bushd::daemon
