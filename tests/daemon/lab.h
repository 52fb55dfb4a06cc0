// A whole lab in one process and in simulated time: the daemon's core, one or more virtual buses
// with MCUs that run the firmware core, and a client's ears. Time moves only in run_*(); everything
// is repeatable.
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "daemon/core/core.h"
#include "sim/board_line.h"
#include "sim/bus.h"
#include "sim/disk/sim_disk.h"
#include "sim/pulse_drive.h"
#include "state/store.h"

// Failures print words.
namespace bushd::api {
inline void PrintTo(Trust trust, std::ostream* out) {
  *out << word(trust);
}
inline void PrintTo(Activity activity, std::ostream* out) {
  *out << word(activity);
}
inline void PrintTo(McuState state, std::ostream* out) {
  *out << word(state);
}
inline void PrintTo(Directions directions, std::ostream* out) {
  *out << '"' << word(directions) << '"';
}
}  // namespace bushd::api

namespace bushd::test {

// Requests that motors, or motors and steps, are enough for.
enum class Ask {
  kMoveBy,
  kMoveTo,
  kStop,
  kEnable,
  kDisable,
  kSetPosition,
  kClearFaults,
  kEmergencyStop,
  kHome,
  kDisarm
};
api::Request request_of(Ask ask, const std::vector<std::string>& motors,
                        const std::vector<std::int64_t>& steps = {});
std::vector<api::MotorAmount> motor_steps(const std::vector<std::string>& motors,
                                          const std::vector<std::int64_t>& steps);

// An api::Reply, laid flat.
struct Answer {
  enum Phase { kAccepted, kRefused, kResult };
  Phase phase = kAccepted;
  std::string result{};  // the word of its outcome, "refused", or ""
  std::string reason{};
  // By motor, in the request's order.
  std::vector<std::string> motors{};
  std::vector<double> users{};
  std::vector<int> legs{};
  std::vector<double> most_steps_per_s{};
  std::vector<std::string> motor_results{};
  std::vector<std::int64_t> position_steps{};
  std::vector<api::TableRef> tables{};
  std::optional<api::MovePlan> plan{};
  std::optional<api::CamacResult> camac{};
  std::vector<api::ProgramEntry> programs{};
};
inline void PrintTo(const Answer& answer, std::ostream* out) {
  *out << answer.result << ": " << answer.reason;
}

// An answer with this result, whose reason says this.
inline testing::Matcher<const Answer&> Ends(const std::string& result,
                                            const std::string& reason = {}) {
  return testing::AllOf(testing::Field("result", &Answer::result, result),
                        testing::Field("reason", &Answer::reason, testing::HasSubstr(reason)));
}

class Lab : public daemon::Outputs, private state::Backend {
 public:
  // `toml` as in bushd.toml; its ports are only names here. Every MCU of it exists.
  // `glacier` is the text of a table file of that name beside it, if not empty.
  // `disabled_capabilities`: BUSHD_CAN_*, of all MCUs. `keeps`: what MCUs with flash keep outlives
  // their resets.
  explicit Lab(const std::string& toml, const std::string& glacier = {},
               sim::EdgeSink* sink = nullptr, std::uint32_t disabled_capabilities = 0,
               bool keeps = false);
  ~Lab() override;

  // Runs until `done` holds (checked after every event) or `limit_s` has passed; returns whether it
  // held.
  bool run_until(const std::function<bool()>& done, double limit_s = 30);
  void run_for(double seconds);

  // Sends a request as client "test" and returns its number.
  std::int64_t send(Ask ask, const std::vector<std::string>& motors,
                    const std::vector<std::int64_t>& steps = {}) {
    return send(request_of(ask, motors, steps));
  }
  std::int64_t send(const api::Request& request);
  // The same as another client, of the control socket, and that client's end.
  std::int64_t send_as(const std::string& client, const api::Request& request);
  void leave(const std::string& client);
  // The replies so far to a request.
  std::vector<Answer> replies(std::int64_t number) const;
  // The last reply, which must exist.
  Answer last_reply(std::int64_t number) const;
  bool has_result(std::int64_t number) const;
  // Runs until the request has its result or was refused, and returns that.
  Answer wait(std::int64_t number, double limit_s = 60);
  // Sends and waits.
  Answer ask(Ask ask, const std::vector<std::string>& motors,
             const std::vector<std::int64_t>& steps = {}) {
    return wait(send(ask, motors, steps));
  }
  Answer ask(const api::Request& request) { return wait(send(request)); }
  bool all_ready() const;
  // Asserts that all MCUs become READY. The first time somebody says then that all motors stand
  // where their MCUs count them.
  void connect();

  // Runs until the MCU is told to be in this state.
  bool mcu_comes_to(const std::string& mcu, api::McuState state, double limit_s = 30) {
    return run_until([&] { return has_state(mcu) && state_of(mcu).state == state; }, limit_s);
  }
  bool has_state(const std::string& mcu) const { return states_.contains(mcu); }
  const api::StateSnapshot& state_of(const std::string& mcu) const { return states_.at(mcu); }
  api::MotorState motor(const std::string& name) const;
  api::MotorDescription description(const std::string& motor) const;
  // As published next.
  api::HealthSnapshot health_of(const std::string& bus);
  api::McuHealth mcu_health(const std::string& mcu);
  // What the daemon has logged as errors, and as warnings.
  const std::vector<std::string>& errors() const { return errors_; }
  const std::vector<std::string>& warnings() const { return warnings_; }
  const std::vector<api::CamacLam>& lams() const { return lams_; }
  // Steps that the motor has really made, seen from the outside.
  std::int64_t shaft_steps(const std::string& motor) const;

  // The port of a bus goes away / comes back; the last, after so long.
  void unplug(std::size_t bus);
  void plug(std::size_t bus);
  void unplug(std::size_t bus, double seconds) {
    unplug(bus);
    run_for(seconds);
    plug(bus);
  }
  // The daemon does nothing for a while, as after SIGSTOP or on a very busy machine; what has
  // arrived meanwhile is the first that it reads.
  void pause_daemon(double seconds);
  // The daemon is gone, and a new one starts on the same buses. `meanwhile`: no daemon runs.
  void restart_daemon(const std::function<void()>& meanwhile = {});
  // In `meanwhile`: so much time passes.
  void pass_without_daemon(double seconds);
  // From now on positions are kept, on a disk of the simulation: the daemon is started again.
  void keep_positions();
  sim::SimDisk& disk() { return *state_disk_; }
  // The disk takes that long for each thing.
  std::int64_t disk_us = 500;
  // The daemon reads what has arrived once in that time, as from an adapter that collects bytes: of
  // a large lab far cheaper than byte by byte, which is 0.
  std::int64_t read_period_us = 0;
  // Another bushd.toml with the same MCUs: the daemon is started again.
  void use_configuration(const std::string& toml);
  std::vector<api::PastMotion> history(std::int64_t number) const;
  // "m01 offset = 12.5, in the file 0", each a line.
  std::vector<std::string> settings(std::int64_t number) const;
  // The PC loses power: the daemon, and what the disk had not synced. A new one starts.
  void cut_pc_power();
  // Bytes on the way to MCUs are handed to this before they are sent; returning false drops them.
  std::function<bool(std::size_t bus, std::vector<std::uint8_t>& bytes)> on_send;
  // Each byte on the way from MCUs, which this may change.
  std::function<void(std::size_t bus, std::uint8_t& byte)> on_receive;

  // A file beside bushd.toml, where tables are looked for first.
  void write_file(const std::string& name, const std::string& text);
  std::int64_t use(const std::string& group, const std::string& table) {
    return send(api::UseTable{.group = group, .table = table});
  }
  std::int64_t reload() { return send(api::ReloadTables{}); }

  daemon::Core& core() { return *core_; }
  sim::Bus& bus(std::size_t index) { return *buses_[index].bus; }
  // The drive of a bus of kind "serial-pulse".
  sim::PulseDrive& drive(std::size_t index) { return *buses_[index].drive; }
  // What the drivers of such ports can do, from the next time that one is opened.
  link::PulseStatus pulse_driver = {.any_rate = true, .empty = true};
  // Their drivers pass nothing on, and say so, until this ends; of all buses, or of this one.
  void stall_pulses(bool stalled, std::optional<std::size_t> bus = {});
  // The model of a board, of a bus that has one.
  sim::CommutatorBoard& board(std::size_t index) {
    return dynamic_cast<sim::BoardLine&>(*buses_[index].board).board;
  }
  // Another kind of board is in its place from now on. Its time goes on from the lab's.
  void replace_board(std::size_t index, std::unique_ptr<sim::BoardEnd> board) {
    buses_[index].board = std::move(board);
  }
  std::int64_t now_us() const { return now_ns_ / 1000; }
  const std::vector<std::string>& move_lines() const { return move_lines_; }
  // Which tables a restarted daemon is to have, as asked to keep last.
  const std::vector<std::string>& kept() const { return kept_; }

 private:
  struct SimulatedBus {
    std::unique_ptr<sim::Bus> bus;  // without MCUs where one of these is in their place
    std::unique_ptr<sim::PulseDrive> drive = {};
    bool ordered = false;                 // the drive's status is to be told
    std::vector<std::uint8_t> held = {};  // by its driver
    bool stalled = false;
    std::vector<std::uint8_t> received;
    bool plugged = true;
    std::unique_ptr<sim::BoardEnd> board = {};
  };
  class Client;
  void send(BusId bus, std::span<const std::uint8_t> bytes) override;
  void publish(McuId, const api::StateSnapshot& state) override { states_[state.mcu] = state; }
  void publish(McuId, const api::Description& description) override {
    descriptions_[description.mcu] = description;
  }
  void publish(BusId, const api::HealthSnapshot& health) override { health_[health.bus] = health; }
  void publish_lam(const api::CamacLam& lam) override { lams_.push_back(lam); }
  void move_log(const std::string& line) override { move_lines_.push_back(line); }
  void log(daemon::LogLevel level, daemon::LogSubject, const std::string& text) override;
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void serve_tables(const api::Asker& asker, const api::Request& request) override;
  std::int64_t wall_clock_us() override { return now_us(); }
  void mark(std::vector<state::Mark> marks) override;
  void write(state::Batch batch) override;
  void history(std::string motor, int most, Told told) override {
    post([this, motor, most, told] { told(store_->history(motor, most)); });
  }
  void post(std::function<void()> answer) {
    state_jobs_.emplace_back(now_us() + disk_us, std::move(answer));
  }
  void start_daemon();
  void advance();
  void pulse(BusId bus, const link::PulseOrder& order) override;
  void tell_pulse_status();
  void run_buses();  // until now; the daemon reads what has arrived

  std::filesystem::path directory_;
  config::Config config_;
  std::unique_ptr<daemon::Core> core_;
  std::shared_ptr<Client> client_;
  std::map<std::string, std::shared_ptr<Client>> others_;
  std::map<std::int64_t, std::shared_ptr<Client>> asked_by_;  // those of `others_`, by number
  std::vector<SimulatedBus> buses_;
  std::int64_t now_ns_ = 0;
  std::int64_t number_ = 0;
  std::map<std::string, api::StateSnapshot> states_;
  std::map<std::string, api::Description> descriptions_;
  std::map<std::string, api::HealthSnapshot> health_;
  std::vector<std::string> errors_;
  std::vector<std::string> warnings_;
  std::vector<api::CamacLam> lams_;
  std::uint16_t master_ = 0;
  bool positions_confirmed_ = false;
  std::vector<std::string> move_lines_;
  std::vector<std::string> kept_;
  std::vector<std::function<void()>> disk_;  // what it is to tell the core
  std::unique_ptr<sim::SimDisk> state_disk_;
  std::optional<state::Store> store_;
  std::vector<std::pair<std::int64_t, std::function<void()>>> state_jobs_;  // when they are done
};

// All of its MCUs are READY.
struct ReadyLab : Lab {
  explicit ReadyLab(const std::string& toml, const std::string& glacier = {},
                    sim::EdgeSink* sink = nullptr, std::uint32_t disabled_capabilities = 0)
      : Lab(toml, glacier, sink, disabled_capabilities) {
    connect();
  }
};

// One bus "hall" with `mcus` MCUs of `motors` motors each, named m01.., all in group "axes" of
// `table`. `manner` is the format, "fine" or "coarse", and with "_table" behind it moves are given
// to the MCUs as a whole, with "_ticks" every tick is sent.
std::string hall(int mcus, int motors, const std::string& manner = "fine",
                 const std::string& table = "bushd2-constant");

// With these keys of its motor of this name; of its MCU of this address.
std::string with_keys(std::string toml, const std::string& motor, const std::string& keys);
std::string with_mcu_keys(std::string toml, const std::string& keys, int address = 1);

}  // namespace bushd::test
