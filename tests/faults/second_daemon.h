// Now and then somebody starts another daemon for the same bus, on another PC with an adapter of
// its own on the same line. It is the same core with the same configuration, and sets the MCUs up
// for itself; neither of the two listens before it talks. After a while it is ended.
//
// Half of them share the network with the first one. Such a daemon looks for others on its channels
// before it does anything else (daemon/shell/channel_claim.h), and must find the first one there.
// The others cannot know: what comes of them on the line the invariants of bushfaults tell, and
// they hold without exception.
//
// Its clients try to move motors; nobody trusts its positions, so it is not asked to set any.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/core.h"
#include "recent.h"
#include "sim/bus.h"
#include "sim/random.h"

namespace bushfaults {

class SecondDaemon final : public bushd::daemon::Outputs {
 public:
  using TimeNs = bushd::sim::TimeNs;
  // What is known of the first daemon.
  struct First {
    std::optional<TimeNs> runs_since_ns;  // without a pause; nothing: it does not run
    TimeNs said_state_ns;                 // on its network, the last time
  };
  struct Counts {
    std::uint64_t found_other = 0;  // refused to run: another one is on its network
    std::uint64_t ran = 0;
    std::uint64_t moves_accepted = 0;
    std::uint64_t moves_refused = 0;
  };

  // All of them outlive it. The MCUs are on the bus by now.
  SecondDaemon(const bushd::config::Config& config, bushd::sim::Bus& bus, Recent& recent,
               std::uint64_t seed);
  ~SecondDaemon() override;

  // Starts one, if none runs: what it will do, for the story.
  std::string start(TimeNs now_ns, bushd::sim::Random& random);
  // Time has come to now_ns, and the bus with it. What is wrong, if something is.
  std::optional<std::string> run(TimeNs now_ns, const First& first);
  bool talks() const { return core_ != nullptr; }
  // When it is over; in the past if it is.
  TimeNs over_ns() const { return until_ns_; }
  const Counts& counts() const { return counts_; }

 private:
  struct Arrival {
    TimeNs due_ns;
    std::uint8_t byte;
  };
  class Client;

  void send(bushd::BusId, std::span<const std::uint8_t> bytes) override;
  void publish(bushd::McuId, const bushd::api::StateSnapshot&) override {}
  void publish(bushd::McuId, const bushd::api::Description&) override {}
  void publish(bushd::BusId, const bushd::api::HealthSnapshot&) override {}
  void move_log(const std::string&) override {}
  void log(bushd::daemon::LogLevel level, bushd::daemon::LogSubject,
           const std::string& text) override;
  void read_tables(std::uint64_t, const std::vector<std::string>&) override {}
  void keep_tables(std::uint64_t, const std::vector<std::string>&) override {}
  void serve_tables(const bushd::api::Asker& asker, const bushd::api::Request&) override;
  std::int64_t wall_clock_us() override { return now_us(); }

  std::int64_t now_us() const { return now_ns_ / 1000; }
  void begin_to_run();
  void take_in();
  void try_to_move();

  const bushd::config::Config& config_;
  bushd::sim::Bus& bus_;
  Recent& recent_;
  bushd::sim::Random random_;
  TimeNs now_ns_ = 0;
  TimeNs until_ns_ = 0;
  std::optional<TimeNs> looks_since_ns_;  // for another daemon on its network
  std::unique_ptr<bushd::daemon::Core> core_;
  std::shared_ptr<Client> client_;
  TimeNs next_move_ns_ = 0;
  TimeNs latency_ns_ = 0;
  TimeNs free_ns_ = 0;  // the last bytes sent reach the line not before
  std::deque<Arrival> inbox_;
  Counts counts_;
};

}  // namespace bushfaults
