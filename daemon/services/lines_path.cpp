// Lines that are paths: what differs then.
#include <algorithm>

#include "daemon/services/lines.h"

namespace bushd::daemon {
namespace {

// A part of a path that is yet to be planned, after a stop on the way; null: none.
motion::Path* unplanned(const Line& line) {
  const AlongPath* along = line.path();
  return along == nullptr || along->rest->is_planned() ? nullptr : along->rest.get();
}

}  // namespace

bool Lines::plans() const {
  return !paths_.idle() || std::ranges::any_of(lines_, [](const auto& line) {
    return unplanned(line.second) != nullptr;
  });
}

// What is under way comes first.
void Lines::work() {
  for (const auto& [number, line] : lines_) {
    if (motion::Path* rest = unplanned(line)) {
      rest->plan(AlongPath::kSegmentsPerSlice);
      return;
    }
  }
  paths_.work();
}

void Lines::plan_only(std::int64_t now_us, const api::Asker& asker, Line& line, AlongPath& along) {
  const motion::Path& path = *along.path;
  std::vector<DryRun::Part> parts;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    const std::int64_t from = path.point(0, i);
    DryRun::Part part{line.motors[i], line.end_of(i) - from, 0, from};
    if (line.longest() != 0) part.line = along.share(i, 0, line.longest());
    parts.push_back(std::move(part));
  }
  dry_runs_.request(now_us, asker, parts);
}

}  // namespace bushd::daemon
