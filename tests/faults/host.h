// The computer: the daemon's core, and the adapter between it and the bus. Here bytes are garbled,
// the adapter goes away and the daemon is paused or killed.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <variant>
#include <vector>

#include "daemon_run.h"
#include "kept.h"
#include "recent.h"
#include "request.h"
#include "sim/bus.h"
#include "sim/garbler.h"
#include "witness.h"

namespace bushfaults {

class BareWorld;

// What clients send.
using Message = std::variant<bushd::lcm::Hello, Request>;

class Host final : public bushd::daemon::Outputs {
 public:
  using TimeNs = bushd::sim::TimeNs;
  // No adapter answers sooner, so that time can be moved in strides of this length.
  static constexpr TimeNs kStrideNs = 400'000;

  // All of them outlive the host. The daemon starts at once. `keeps` positions on a disk.
  // `bare`: null, or the last buses of `config`.
  Host(const bushd::config::Config& config, bushd::sim::Bus& bus, Witness& witness, Recent& recent,
       BareWorld* bare, std::uint64_t seed, bool keeps);
  ~Host() override;

  // Null: they are not.
  Kept* kept() { return kept_.get(); }

  // Time has come to now_ns, and the bus with it.
  void run(TimeNs now_ns);
  // When something is to be done next, if nothing comes from outside.
  TimeNs next_ns() const;

  // Is lost if no daemon runs.
  void receive(const Message& message);
  // The number of the daemon that runs, or of the last one.
  std::int64_t run_number() const { return run_number_; }
  // Since when it has been running without a pause; nothing if it does not.
  std::optional<TimeNs> runs_since_ns() const;
  // When it has said a state on the network, the last time.
  TimeNs said_state_ns() const { return said_state_ns_; }
  // What it says to clients.
  std::function<void(const bushd::lcm::DaemonMessage&)> on_message;

  // Faults. They may overlap: what is over last counts.
  enum class Direction { kOut, kIn };
  void garble(Direction direction, bushd::sim::Garbling what);
  void silence(TimeNs until_ns);
  void unplug(TimeNs now_ns, TimeNs until_ns);
  void pause(TimeNs now_ns, TimeNs until_ns);
  void kill(TimeNs now_ns, TimeNs until_ns);
  // The daemon is asked to end, and is gone so long when it has.
  void end(TimeNs now_ns, TimeNs gone_ns);
  // The PC has no power until then.
  void cut_power(TimeNs now_ns, TimeNs until_ns);
  // When the faults above are over, garblings that wait for bytes excepted.
  TimeNs faults_over_ns() const;

 private:
  struct Arrival {
    TimeNs due_ns;
    std::vector<std::uint8_t> bytes;
  };

  void send(bushd::BusId bus, std::span<const std::uint8_t> bytes) override;
  void publish(bushd::McuId mcu, const bushd::api::StateSnapshot& state) override;
  void publish(bushd::McuId mcu, const bushd::api::Description& description) override;
  void publish(bushd::BusId bus, const bushd::api::HealthSnapshot& health) override;
  void publish_lam(const bushd::api::CamacLam& lam) override;
  void pulse(bushd::BusId bus, const bushd::link::PulseOrder& order) override;
  void move_log(const std::string& line) override;
  void log(bushd::daemon::LogLevel level, bushd::daemon::LogSubject,
           const std::string& text) override;
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>&) override;
  void serve_tables(const bushd::api::Asker& asker, const bushd::api::Request&) override;
  std::int64_t wall_clock_us() override { return now_us(); }

  bushd::daemon::Core& core() { return daemon_->core(); }
  std::int64_t now_us() const { return now_ns_ / 1000; }
  bool silent() const { return now_ns_ < silent_until_ns_; }
  void start();
  class Overhearing;
  bushd::api::Asker carry_out(const bushd::api::Asker& asker, const bushd::api::Request& request);
  void hear(const std::optional<bushd::lcm::DaemonMessage>& message);
  void check(const std::optional<std::string>& wrong);
  void give(const bushd::lcm::Hello& hello);
  void give(const Request& request);
  void plug_in();
  bool end_if_due();
  void take_in();
  // Something has arrived that the daemon listens for.
  bool may_read() const;
  void deliver();
  void step();
  bool anything_due() const;

  const bushd::config::Config& config_;
  bushd::sim::Bus& bus_;
  Witness& witness_;
  Recent& recent_;
  BareWorld* const bare_;
  bushd::sim::Random random_;
  std::array<bushd::sim::Garbler, 2> garbler_;  // by Direction
  TimeNs now_ns_ = 0;

  std::unique_ptr<Kept> kept_;
  std::unique_ptr<DaemonRun> daemon_;  // none: killed
  std::int64_t run_number_ = 0;
  TimeNs starts_ns_ = 0;                // when the next daemon starts, or this one has started
  std::optional<TimeNs> ends_at_ns_{};  // it has been asked to, and is watched until then
  TimeNs gone_ns_ = 0;                  // for so long, then
  TimeNs paused_until_ns_ = 0;
  TimeNs said_state_ns_ = 0;
  TimeNs wake_ns_ = 0;
  std::deque<Message> messages_;                      // not yet read by the daemon
  std::vector<bushd::api::StateSnapshot> published_;  // by MCU
  std::deque<std::function<void()>> disk_;            // what it is to tell the daemon

  bool plugged_ = false;
  TimeNs back_ns_ = 0;  // when the adapter is plugged in again
  TimeNs silent_until_ns_ = 0;
  TimeNs latency_ns_ = kStrideNs;
  TimeNs free_ns_ = 0;                  // the last bytes sent reach the line not before
  std::vector<std::uint8_t> arriving_;  // heard since the last run()
  std::deque<Arrival> inbox_;
};

}  // namespace bushfaults
