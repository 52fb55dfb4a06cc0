// Who has a place among the connections. So many are for all uses, bounded in all, of a user and of
// a process. Beyond these there are some that are kept for stops: whoever comes gets one of them,
// and when they are all taken, the one of who has most of them is given up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "api/session.h"

namespace bushd::control {

class Places {
 public:
  struct Limits {
    std::size_t in_all = 1100;
    std::size_t of_user = 768;
    std::size_t of_process = 256;
    std::size_t for_stops = 32;
  };
  using Connection = std::uint64_t;  // counted upwards

  explicit Places(Limits limits) : limits_(limits) {}

  // Why it is one of those that are kept for stops: who has the others; "": it is one of the
  // others. Precondition: has_room().
  std::string take(Connection connection, const api::Credentials& who);
  void give_back(Connection connection);

  bool has_room() const { return kept_ < limits_.for_stops; }
  // Whose place for stops is given up first; nobody is who waits to be heard.
  std::optional<Connection> who_goes(const std::function<bool(Connection)>& waits) const;
  bool any_for_stops() const { return kept_ > 0; }

 private:
  struct Process {
    std::uint32_t uid;
    std::int32_t pid;
    auto operator<=>(const Process&) const = default;
  };
  struct Place {
    Process process;
    bool for_stops;
  };
  std::size_t of_user(std::uint32_t uid, bool for_stops) const;
  std::size_t of_process(const Process& process, bool for_stops) const;
  std::string why_for_stops(const Process& process) const;

  Limits limits_;
  std::map<Connection, Place> places_;
  std::size_t kept_ = 0;  // of them, for stops
};

}  // namespace bushd::control
