#include "arrivals.h"

#include <algorithm>

namespace bushfaults {
namespace {

bool ends_others(const Request& request) {
  return request.is_stop() || request.ask == Ask::kPause || request.ask == Ask::kHold;
}

bool begins_motion(const Request& request) {
  const bool jogs = request.ask == Ask::kJog && request.speed_micro != 0 && !request.renew;
  return request.is_move() || request.ask == Ask::kHome || request.ask == Ask::kRunPrograms || jogs;
}

}  // namespace

void Arrivals::daemon_started() {
  arrived_.clear();
  first_parts_.clear();
  carried_out_.clear();
  ends_.clear();
}

void Arrivals::arrives(const Request& request) {
  if (arrived_.size() > kMostArrivals) arrived_.clear();
  if (first_parts_.size() > kMostArrivals) first_parts_.clear();
  ++count_;
  const bool first = arrived_.try_emplace(key_of(request.id()), count_).second;
  if (first && request.first_row == 0 && request.end_row != 0) {
    first_parts_[path_of(request)] = {.at = count_, .number = request.number};
  }
}

Arrivals::Path Arrivals::path_of(const Request& request) {
  return {request.client, request.motors, request.points.size()};
}

std::optional<Arrivals::Place> Arrivals::place_of(const Request& request) const {
  if (request.first_row != 0) {
    const auto first = first_parts_.find(path_of(request));
    if (first != first_parts_.end()) return first->second;
  }
  const auto arrived = arrived_.find(key_of(request.id()));
  if (arrived == arrived_.end()) return std::nullopt;
  return Place{.at = arrived->second, .number = request.number};
}

void Arrivals::carried_out(const Request& request) {
  if (ends_others(request)) carried_out_[key_of(request.id())] = count_;
}

std::optional<std::string> Arrivals::accepted(const Request& request) {
  const Key key = key_of(request.id());
  if (ends_others(request)) {
    // An emergency stop names nobody, and a pause may name groups.
    ends_.push_back({.at = carried_out_[key],
                     .session = request.unordered ? 0 : request.session,
                     .number = request.number,
                     .motors = request.motors});
    carried_out_.erase(key);
    if (ends_.size() > kMostEnds) ends_.erase(ends_.begin());
    return std::nullopt;
  }
  const auto place = place_of(request);
  if (!begins_motion(request) || !place) return std::nullopt;
  for (const End& end : ends_) {
    const bool concerns = std::ranges::any_of(request.motors, [&](const std::string& motor) {
      return end.motors.empty() || std::ranges::find(end.motors, motor) != end.motors.end();
    });
    const bool before = place->at < end.at;
    const bool asked_before =
        end.session != 0 && end.session == request.session && place->number < end.number;
    if (concerns && (before || asked_before)) {
      return "accepted, though it " + std::string(before ? "arrived" : "was asked for") +
             " before what ended it: " + text_of(request);
    }
  }
  return std::nullopt;
}

}  // namespace bushfaults
