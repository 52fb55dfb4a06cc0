// The computer: the daemon's core, and the adapter between it and the bus. Here bytes are garbled,
// the adapter goes away and the daemon is paused or killed.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "clients.h"
#include "daemon/lcm_shim.h"
#include "recent.h"
#include "sim/bus.h"
#include "sim/garbler.h"
#include "witness.h"

namespace bushfaults {

class Host final : public bushd::daemon::LcmOutputs {
 public:
  using TimeNs = bushd::sim::TimeNs;
  // No adapter answers sooner, so that time can be moved in strides of this length.
  static constexpr TimeNs kStrideNs = 400'000;

  // All of them outlive the host. The daemon starts at once.
  Host(const bushd::config::Config& config, bushd::sim::Bus& bus, Witness& witness,
       Clients& clients, Recent& recent, std::uint64_t seed);
  ~Host() override;

  // Time has come to now_ns, and the bus with it.
  void run(TimeNs now_ns);
  // When something is to be done next, if nothing comes from outside.
  TimeNs next_ns() const;

  void request(TimeNs now_ns, const Request& request);

  // Faults. They may overlap: what is over last counts.
  enum class Direction { kOut, kIn };
  void garble(Direction direction, bushd::sim::Garbling what);
  void silence(TimeNs until_ns);
  void unplug(TimeNs now_ns, TimeNs until_ns);
  void pause(TimeNs now_ns, TimeNs until_ns);
  void kill(TimeNs now_ns, TimeNs until_ns);
  // When the faults above are over, garblings that wait for bytes excepted.
  TimeNs faults_over_ns() const;

 private:
  struct Arrival {
    TimeNs due_ns;
    std::vector<std::uint8_t> bytes;
  };

  void send(bushd::BusId bus, std::span<const std::uint8_t> bytes) override;
  void reply(const bushd::reply_t& reply) override { witness_.reply(now_ns_, reply); }
  void state(const bushd::state_t& state) override { witness_.state(now_ns_, state); }
  void health(const bushd::health_t&) override {}
  void move_log(const std::string& line) override { witness_.move_log(now_ns_, line); }
  void log(bushd::daemon::LogLevel level, const std::string& text) override;
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>&) override;
  std::int64_t wall_clock_us() override { return now_us(); }

  bushd::daemon::Core& core() { return daemon_->core(); }
  std::int64_t now_us() const { return now_ns_ / 1000; }
  bool silent() const { return now_ns_ < silent_until_ns_; }
  void start();
  void plug_in();
  void take_in();
  void deliver();
  void step();

  const bushd::config::Config& config_;
  bushd::sim::Bus& bus_;
  Witness& witness_;
  Clients& clients_;
  Recent& recent_;
  bushd::sim::Random random_;
  std::array<bushd::sim::Garbler, 2> garbler_;  // by Direction
  TimeNs now_ns_ = 0;

  std::unique_ptr<bushd::daemon::LcmShim> daemon_;  // none: killed
  TimeNs starts_ns_ = 0;                            // when the next daemon starts
  TimeNs paused_until_ns_ = 0;
  TimeNs wake_ns_ = 0;
  std::deque<Request> requests_;            // not yet read by the daemon
  std::deque<std::function<void()>> disk_;  // what it is to tell the daemon

  bool plugged_ = false;
  TimeNs back_ns_ = 0;  // when the adapter is plugged in again
  TimeNs silent_until_ns_ = 0;
  TimeNs latency_ns_ = kStrideNs;
  TimeNs free_ns_ = 0;                  // the last bytes sent reach the line not before
  std::vector<std::uint8_t> arriving_;  // heard since the last run()
  std::deque<Arrival> inbox_;
};

}  // namespace bushfaults
