// What clients ask of several motors at a time: paths, and trajectories of positions in time.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "clients.h"
#include "request.h"

namespace bushfaults {
namespace {

constexpr std::int64_t kMsNs = 1'000'000;

}  // namespace

std::vector<Request> Clients::due(bushd::sim::TimeNs now_ns) {
  std::vector<Request> all = joggers_.due(now_ns);
  for (Later& later : later_) {
    if (later.due_ns == 0) later.due_ns = now_ns + later.after_ns;
    if (later.due_ns <= now_ns) all.push_back(later.request);
  }
  std::erase_if(later_, [now_ns](const Later& later) { return later.due_ns <= now_ns; });
  return all;
}

std::vector<Clients::Choice> Clients::some_at_rest(std::int64_t most) {
  std::vector<Choice> free = motors_that(false, false);
  std::erase_if(free, [this](const Choice& choice) {
    const std::size_t motor = index_of(choice.name);
    return config_.motors[motor].backlash != 0 ||
           !witness_.units().user_of(motor, choice.position_steps);
  });
  std::vector<Choice> some;
  for (std::int64_t n = random_.between(1, most); n > 0 && !free.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(free.size()));
    some.push_back(free[index]);
    free.erase(free.begin() + static_cast<std::ptrdiff_t>(index));
  }
  return some;
}

// From point to point some motors stand, some go on and some turn round. A single one may have a
// speed on the way to each point, and goes on then.
Request Clients::move_along_path() {
  std::vector<Choice> some = some_at_rest(4);
  if (some.empty()) return move(1);
  Request request = make(Ask::kMoveTo);
  request.line = request.user = true;
  request.exact = random_.one_in(3);
  std::vector<int> directions;
  for (const Choice& choice : some) {
    request.add(choice.name, 0);
    directions.push_back(random_.one_in(2) ? 1 : -1);
  }
  const bool zones = some.size() == 1 && random_.one_in(2);
  for (std::int64_t rows = random_.between(1, 8); rows > 0; --rows) {
    for (std::size_t i = 0; i < some.size(); ++i) {
      const std::size_t motor = index_of(some[i].name);
      std::int64_t& at = some[i].position_steps;
      const std::int64_t way = random_.one_in(4) ? 0 : random_.magnitude(1, 1000);
      if (!zones && random_.one_in(3)) directions[i] = -directions[i];
      at = std::clamp(at + way * directions[i], -kFarthestSteps, kFarthestSteps);
      request.steps[i] = witness_.units().user_of(motor, at).value_or(0);
      request.points.push_back(request.steps[i]);
      if (!zones) continue;
      const std::int64_t steps_per_s = random_.one_in(3) ? 0 : random_.magnitude(120, 3'000);
      const std::int64_t micro = std::abs(witness_.units().micro_of_distance(motor, steps_per_s));
      request.point_speeds.push_back(static_cast<double>(micro) / kMicro);
    }
  }
  if (random_.one_in(4)) {
    request.speed_micro = random_.magnitude(100, 3'000) * kMicro;
    request.speed_in_steps = true;
  }
  return zones || random_.one_in(2) ? request : first_of_parts(std::move(request));
}

// In two or three messages, each some time after the one before, perhaps too late or too early.
// What a part belongs to is told by motors and rows only, so that paths of one client in a row have
// other numbers of rows.
Request Clients::first_of_parts(Request path) {
  const std::size_t width = path.motors.size();
  const std::size_t wanted = 4 + static_cast<std::size_t>(parts_++ % 6);
  while (path.points.size() < wanted * width) {
    path.points.insert(path.points.end(), path.points.end() - static_cast<std::ptrdiff_t>(width),
                       path.points.end());
  }
  path.points.resize(wanted * width);
  path.steps.assign(path.points.end() - static_cast<std::ptrdiff_t>(width), path.points.end());
  const auto first = static_cast<std::size_t>(random_.between(1, 3));
  Request part = path;
  part.ask = Ask::kRows;
  part.line = false;
  part.end_row = first;
  path.first_row = first;
  std::int64_t after_ns = random_.between(5, 800) * kMsNs;
  if (random_.one_in(3) && first + 1 < wanted) {
    Request middle = part;
    middle.first_row = first;
    middle.end_row = path.first_row = wanted - 1;
    later_.push_back({.after_ns = after_ns, .due_ns = 0, .request = std::move(middle)});
    after_ns += random_.between(-50, 500) * kMsNs;
  }
  later_.push_back({.after_ns = after_ns, .due_ns = 0, .request = std::move(path)});
  return part;
}

// No motor turns round: how close steps may be there is no rule of its table. Of straight lines
// each is about as slow as a motor that starts; cubics are up to four times as fast.
Request Clients::tell_trajectory() {
  const std::vector<Choice> some = some_at_rest(4);
  if (some.empty()) return move(1);
  Request rows = make(Ask::kRows);
  rows.user = true;
  rows.trajectory = ++trajectories_;
  rows.cubic = random_.one_in(2);
  std::vector<std::int64_t> ways;
  for (const Choice& choice : some) {
    rows.add(choice.name, 0);
    const std::int64_t way = random_.magnitude(10, rows.cubic ? 200 : 60);
    ways.push_back(random_.one_in(2) ? way : -way);
  }
  const std::int64_t row_ms = random_.between(300, 1'000);
  const std::int64_t count = random_.between(2, 6);
  std::vector<std::int64_t> at;
  for (const Choice& choice : some) at.push_back(choice.position_steps);
  for (std::int64_t row = 0; row < count; ++row) {
    rows.times_ms.push_back(row * row_ms);
    for (std::size_t i = 0; i < some.size(); ++i) {
      const auto user = witness_.units().user_of(index_of(some[i].name), at[i]);
      rows.points.push_back(rows.steps[i] = user.value_or(0));
      at[i] += ways[i] * random_.between(2, 4) / 4;
    }
  }
  Request run = rows;
  run.ask = Ask::kMoveTo;
  run.line = true;
  run.points.clear();
  run.times_ms.clear();
  const std::int64_t run_after_ns = random_.between(100, 1'500) * kMsNs;
  rows.last_rows = count < 4 || random_.one_in(2);
  // Parts may come in another order, and begin another trajectory then.
  run.unknown_way = !rows.last_rows;
  later_.push_back({.after_ns = run_after_ns, .due_ns = 0, .request = std::move(run)});
  if (rows.last_rows) return rows;
  Request rest = rows;
  rest.last_rows = true;
  const std::size_t begun = 3;
  const auto values = static_cast<std::ptrdiff_t>(begun * some.size());
  rows.times_ms.resize(begun);
  rows.points.resize(static_cast<std::size_t>(values));
  rest.times_ms.erase(rest.times_ms.begin(), rest.times_ms.begin() + begun);
  rest.points.erase(rest.points.begin(), rest.points.begin() + values);
  later_.push_back({.after_ns = run_after_ns + random_.between(-50, 600) * kMsNs,
                    .due_ns = 0,
                    .request = std::move(rest)});
  return rows;
}

}  // namespace bushfaults
