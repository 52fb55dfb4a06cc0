#include "control/places.h"

#include <algorithm>
#include <tuple>

namespace bushd::control {

std::size_t Places::of_user(std::uint32_t uid, bool for_stops) const {
  return static_cast<std::size_t>(std::ranges::count_if(places_, [&](const auto& entry) {
    return entry.second.process.uid == uid && entry.second.for_stops == for_stops;
  }));
}

std::size_t Places::of_process(const Process& process, bool for_stops) const {
  return static_cast<std::size_t>(std::ranges::count_if(places_, [&](const auto& entry) {
    return entry.second.process == process && entry.second.for_stops == for_stops;
  }));
}

std::string Places::why_for_stops(const Process& process) const {
  const std::string user = "user " + std::to_string(process.uid);
  if (of_process(process, false) >= limits_.of_process) {
    return "process " + std::to_string(process.pid) + " of " + user + " has " +
           std::to_string(limits_.of_process) + " connections, as many as one process may have";
  }
  if (of_user(process.uid, false) >= limits_.of_user) {
    return user + " has " + std::to_string(limits_.of_user) +
           " connections, as many as one user may have";
  }
  if (places_.size() - kept_ < limits_.in_all) return "";
  return "there are " + std::to_string(limits_.in_all) + " connections, as many as there may be";
}

std::string Places::take(Connection connection, const api::Credentials& who) {
  const Process process{.uid = who.uid, .pid = who.pid};
  std::string why = why_for_stops(process);
  places_.emplace(connection, Place{.process = process, .for_stops = !why.empty()});
  if (!why.empty()) ++kept_;
  return why;
}

void Places::give_back(Connection connection) {
  const auto found = places_.find(connection);
  if (found == places_.end()) return;
  if (found->second.for_stops) --kept_;
  places_.erase(found);
}

std::optional<Places::Connection> Places::who_goes(
    const std::function<bool(Connection)>& waits) const {
  std::optional<Connection> goes;
  std::tuple<std::size_t, std::size_t> most;
  for (const auto& [connection, place] : places_) {
    if (!place.for_stops || waits(connection)) continue;
    const std::tuple has{of_user(place.process.uid, true), of_process(place.process, true)};
    if (goes && has <= most) continue;
    goes = connection;
    most = has;
  }
  return goes;
}

}  // namespace bushd::control
