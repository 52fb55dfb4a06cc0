// What one daemon has told of itself, for pages that see all of it: everything at once, and then
// what is new. No I/O and no clock.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/status.h"
#include "lcm/codec.h"
#include "messages.h"

namespace bushweb {

class Mirror {
 public:
  // `daemon`: what it is called on the page.
  explicit Mirror(std::string daemon) : daemon_(std::move(daemon)) {}

  const std::string& daemon() const { return daemon_; }
  bool connected() const { return why_.empty(); }

  void connect();
  // `why` with the remedy, never empty.
  void lose(std::string why);
  void hear(const bushd::lcm::DaemonMessage& message);

  // A state has come since the last call.
  bool take_heard() { return std::exchange(heard_, false); }
  // What has come since the last call, for those who have been told all that was before.
  std::vector<Text> news();
  // All that there is, for who has been told nothing; to be followed by news() made later.
  // Precondition: news() has been taken.
  std::vector<Text> everything() const;

  // As far as it is complete.
  bushd::client::Status status() const { return collector_.status(); }

 private:
  struct Motor {
    api::MotorState state{};
    std::string json{};
    bool fresh = true;
  };
  struct Mcu {
    std::string json{};  // without its motors, and without the brace at its end
    std::vector<Motor> motors{};
    bool heard = true;
  };
  struct Told {
    std::string json{};
    bool fresh = true;
  };
  struct Parts {
    std::map<std::int32_t, Told> told{};
    std::int32_t count = 0;  // that there are
  };

  void hear_state(const bushd::lcm::StateMessage& message);
  template <class Message>
  void hear_part(Parts& parts, const Message& message);
  void hear_from(const bushd::lcm::Part& part);
  Text connection() const;
  Text states(bool full) const;
  Text parts(const char* kind, const char* list, const Parts& parts, bool full) const;

  std::string daemon_;
  std::string why_ = "bushd-web has just started";
  bool connection_fresh_ = true;
  bool heard_ = false;
  bool full_ = true;  // what comes next replaces all that was told
  std::int64_t run_ = 0;
  std::int32_t part_count_ = 0;
  std::int64_t utime_us_ = 0;  // of the newest state
  std::map<std::int32_t, Mcu> mcus_{};
  Parts descriptions_{};
  Parts healths_{};
  bushd::client::StatusCollector collector_{};
};

}  // namespace bushweb
