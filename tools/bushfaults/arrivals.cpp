#include "arrivals.h"

#include <algorithm>

namespace bushfaults {
namespace {

bool ends_others(const Request& request) {
  return request.is_stop() || request.ask == Ask::kPause || request.ask == Ask::kHold;
}

bool begins_motion(const Request& request) {
  const bool jogs = request.ask == Ask::kJog && request.speed_micro != 0 && !request.renew;
  return request.is_move() || request.ask == Ask::kHome || jogs;
}

}  // namespace

void Arrivals::daemon_started() {
  arrived_.clear();
  carried_out_.clear();
  ends_.clear();
}

void Arrivals::arrives(const Request& request) {
  if (arrived_.size() > kMostArrivals) arrived_.clear();
  ++count_;
  arrived_.try_emplace(key_of(request.id()), count_);
}

void Arrivals::carried_out(const Request& request) {
  if (ends_others(request)) carried_out_[key_of(request.id())] = count_;
}

std::optional<std::string> Arrivals::accepted(const Request& request) {
  const Key key = key_of(request.id());
  if (ends_others(request)) {
    // An emergency stop names nobody, and a pause may name groups.
    ends_.push_back({.at = carried_out_[key],
                     .session = request.session,
                     .number = request.number,
                     .motors = request.motors});
    carried_out_.erase(key);
    if (ends_.size() > kMostEnds) ends_.erase(ends_.begin());
    return std::nullopt;
  }
  const auto arrived = arrived_.find(key);
  if (!begins_motion(request) || arrived == arrived_.end()) return std::nullopt;
  for (const End& end : ends_) {
    const bool concerns = std::ranges::any_of(request.motors, [&](const std::string& motor) {
      return end.motors.empty() || std::ranges::find(end.motors, motor) != end.motors.end();
    });
    const bool before = arrived->second < end.at;
    const bool asked_before =
        end.session != 0 && end.session == request.session && request.number < end.number;
    if (concerns && (before || asked_before)) {
      return "accepted, though it " + std::string(before ? "arrived" : "was asked for") +
             " before what ended it: " + text_of(request);
    }
  }
  return std::nullopt;
}

}  // namespace bushfaults
