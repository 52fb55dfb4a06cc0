#include "starts.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

constexpr std::size_t kEdgesKept = 1024;  // more than there are while a move waits and moves
constexpr int kTriggerTicks = 3;          // docs/protocol.md, TRIGGER

// On a line all but the longest motor make their first steps when their shares of it are due.
bool begins_first(const Request& request, std::size_t motor) {
  const auto way = [&](std::size_t i) { return std::abs(request.steps[i]); };
  for (std::size_t i = 0; i < request.steps.size(); ++i) {
    if (request.line && way(i) > way(motor)) return false;
  }
  return true;
}

}  // namespace

void Starts::trigger(TimeNs now_ns, std::size_t mcu, bool rising) {
  if (edges_[mcu].size() == kEdgesKept) edges_[mcu].pop_front();
  edges_[mcu].push_back({now_ns, rising});
}

// All motors of a move start in the same tick, whichever MCUs they are on; and all tables have the
// same first delay, so their first steps come together.
std::optional<std::string> Starts::check(
    const Request& request, const std::vector<std::optional<TimeNs>>& first_step_ns) const {
  std::vector<TimeNs> first;
  for (std::size_t i = 0; i < first_step_ns.size(); ++i) {
    if (!first_step_ns[i]) continue;
    first.push_back(*first_step_ns[i]);
    if (request.ask != Ask::kArm || !begins_first(request, i)) continue;
    if (auto wrong = check_triggered(request, request.motors[i], first.back())) return wrong;
  }
  // On a line each motor makes its first step when its share of the line is due.
  if (first.empty() || request.ask == Ask::kArm || request.line) return std::nullopt;
  const auto [earliest, latest] = std::minmax_element(first.begin(), first.end());
  if (*latest - *earliest < config_.buses[0].tick_ns() / 2) return std::nullopt;
  return fmt::format("motors of one move started {} us apart: {}", (*latest - *earliest) / 1000,
                     text_of(request));
}

// Half a tick is more than a crystal can be off in the longest delay, and than a slot.
std::optional<std::string> Starts::check_triggered(const Request& request, const std::string& name,
                                                   TimeNs first_step_ns) const {
  const auto motor = std::ranges::find(config_.motors, name, &bushd::config::Motor::name);
  const bushd_table& table = config_.table_of(*motor).view();
  const TimeNs tick_ns = config_.buses[0].tick_ns();
  const TimeNs after_ns = kTriggerTicks * tick_ns + TimeNs{request.delay_us} * 1000 +
                          TimeNs{table.accel.code[0]} * table.time_unit_ns;
  const auto& edges = edges_[motor->mcu.value];
  const bool found = std::any_of(edges.begin(), edges.end(), [&](const Edge& edge) {
    return edge.rising == request.rising &&
           std::abs(first_step_ns - edge.time_ns - after_ns) < tick_ns / 2;
  });
  if (found) return std::nullopt;
  return fmt::format("{} began, and no edge had come {} us before its first step: {}", name,
                     after_ns / 1000, text_of(request));
}

}  // namespace bushfaults
