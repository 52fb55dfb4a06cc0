#include "words/words.h"

#include <array>
#include <utility>

namespace bushd::words {
namespace {

template <class Value, std::size_t N>
using Words = std::array<std::pair<Value, std::string_view>, N>;

constexpr Words<Outcome, 6> kOutcomes = {{
    {Outcome::kDone, "done"},
    {Outcome::kReached, "reached"},
    {Outcome::kStopped, "stopped"},
    {Outcome::kLimit, "limit"},
    {Outcome::kLink, "link"},
    {Outcome::kFault, "fault"},
}};
constexpr Words<Activity, 6> kActivities = {{
    {Activity::kResting, "rest"},
    {Activity::kMoving, "move"},
    {Activity::kArming, "arming"},
    {Activity::kArmed, "armed"},
    {Activity::kHoming, "home"},
    {Activity::kLocal, "local"},
}};
constexpr Words<Trust, 5> kTrusts = {{
    {Trust::kUnknown, "unknown"},
    {Trust::kKnown, "known"},
    {Trust::kRestored, "restored"},
    {Trust::kStale, "stale"},
    {Trust::kUncertain, "uncertain"},
}};
constexpr Words<McuState, 5> kMcuStates = {{
    {McuState::kOffline, "OFFLINE"},
    {McuState::kBusy, "BUSY"},
    {McuState::kReady, "READY"},
    {McuState::kRunning, "RUN"},
    {McuState::kFault, "FAULT"},
}};
constexpr Words<StopMode, 3> kStopModes = {{
    {StopMode::kRamp, "ramp"},
    {StopMode::kImmediate, "immediate"},
    {StopMode::kDisable, "disable"},
}};
constexpr Words<Edge, 2> kEdges = {{
    {Edge::kRising, "rising"},
    {Edge::kFalling, "falling"},
}};
constexpr Words<Directions, 4> kDirections = {{
    {Directions{}, ""},
    {Directions{.positive = true}, "positive"},
    {Directions{.negative = true}, "negative"},
    {Directions{.positive = true, .negative = true}, "both"},
}};

std::string_view find_word(const auto& words, auto value) {
  for (const auto& [candidate, word] : words) {
    if (candidate == value) return word;
  }
  return "unknown";
}

template <class Value, std::size_t N>
std::optional<Value> find_value(const Words<Value, N>& words, std::string_view word) {
  for (const auto& [value, candidate] : words) {
    if (candidate == word) return value;
  }
  return std::nullopt;
}

}  // namespace

std::string_view word(Outcome outcome) {
  return find_word(kOutcomes, outcome);
}
std::string_view word(Activity activity) {
  return find_word(kActivities, activity);
}
std::string_view word(Trust trust) {
  return find_word(kTrusts, trust);
}
std::string_view word(McuState state) {
  return find_word(kMcuStates, state);
}
std::string_view word(StopMode mode) {
  return find_word(kStopModes, mode);
}
std::string_view word(Edge edge) {
  return find_word(kEdges, edge);
}
std::string_view word(Directions directions) {
  return find_word(kDirections, directions);
}

std::optional<Outcome> outcome_of(std::string_view word) {
  return find_value(kOutcomes, word);
}
std::optional<Activity> activity_of(std::string_view word) {
  return find_value(kActivities, word);
}
std::optional<Trust> trust_of(std::string_view word) {
  return find_value(kTrusts, word);
}
std::optional<McuState> mcu_state_of(std::string_view word) {
  return find_value(kMcuStates, word);
}
std::optional<StopMode> stop_mode_of(std::string_view word) {
  return find_value(kStopModes, word);
}
std::optional<Directions> directions_of(std::string_view word) {
  return find_value(kDirections, word);
}

}  // namespace bushd::words
