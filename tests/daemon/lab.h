// A whole lab in one process and in simulated time: the daemon's core, one or more virtual buses
// with MCUs that run the firmware core, and a client's ears. Time moves only in run_*(); everything
// is repeatable.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/lcm_shim.h"
#include "sim/bus.h"

namespace bushd::test {

class Lab : public daemon::LcmOutputs {
 public:
  // `toml` as in bushd.toml; its ports are only names here. Every MCU of it exists.
  // `glacier` is the text of a table file of that name beside it, if not empty.
  explicit Lab(const std::string& toml, const std::string& glacier = {},
               sim::EdgeSink* sink = nullptr);
  ~Lab() override;

  // Runs until `done` holds (checked after every event) or `limit_s` has passed; returns whether it
  // held.
  bool run_until(const std::function<bool()>& done, double limit_s = 30);
  void run_for(double seconds);

  // Sends a command as client "test" and returns its number.
  std::int64_t send(std::int8_t kind, const std::vector<std::string>& motors,
                    const std::vector<std::int64_t>& steps = {});
  std::int64_t send(command_t command);
  // The replies so far to a command of client "test".
  std::vector<reply_t> replies(std::int64_t number) const;
  // The last reply, which must exist.
  reply_t last_reply(std::int64_t number) const;
  bool has_result(std::int64_t number) const;
  // Runs until the command has its result or was refused, and returns that.
  reply_t wait(std::int64_t number, double limit_s = 60);
  bool all_ready() const;
  // Asserts that all MCUs become READY. The first time somebody says then that all motors stand
  // where their MCUs count them.
  void connect();

  bool has_state(const std::string& mcu) const { return states_.contains(mcu); }
  const state_t& state_of(const std::string& mcu) const { return states_.at(mcu); }
  motor_state_t motor(const std::string& name) const;
  // As published next.
  health_t health_of(const std::string& bus);
  mcu_health_t mcu_health(const std::string& mcu);
  // What the daemon has logged as errors.
  const std::vector<std::string>& errors() const { return errors_; }
  // Steps that the motor has really made, seen from the outside.
  std::int64_t shaft_steps(const std::string& motor) const;

  // The port of a bus goes away / comes back.
  void unplug(std::size_t bus);
  void plug(std::size_t bus);
  // The daemon does nothing for a while, as after SIGSTOP or on a very busy machine; what has
  // arrived meanwhile is the first that it reads.
  void pause_daemon(double seconds);
  // The daemon is gone, and a new one starts on the same buses.
  void restart_daemon();
  // Bytes on the way to MCUs are handed to this before they are sent; returning false drops them.
  std::function<bool(std::size_t bus, std::vector<std::uint8_t>& bytes)> on_send;

  // A file beside bushd.toml, where tables are looked for first.
  void write_file(const std::string& name, const std::string& text);
  // Sends USE_TABLE, RELOAD_TABLES.
  std::int64_t use(const std::string& group, const std::string& table);
  std::int64_t reload() { return send(command_t::RELOAD_TABLES, {}); }

  daemon::Core& core() { return shim_->core(); }
  void command(const command_t& command) { shim_->command(now_us(), command); }
  sim::Bus& bus(std::size_t index) { return *buses_[index].bus; }
  std::int64_t now_us() const { return now_ns_ / 1000; }
  const std::vector<std::string>& move_lines() const { return move_lines_; }
  // Which tables a restarted daemon is to have, as asked to keep last.
  const std::vector<std::string>& kept() const { return kept_; }

 private:
  struct SimulatedBus {
    std::unique_ptr<sim::Bus> bus;
    std::vector<std::uint8_t> received;
    bool plugged = true;
  };
  void send(BusId bus, std::span<const std::uint8_t> bytes) override;
  void reply(const reply_t& reply) override { replies_.push_back(reply); }
  void state(const state_t& state) override { states_[state.mcu] = state; }
  void health(const health_t& health) override { health_[health.bus] = health; }
  void move_log(const std::string& line) override { move_lines_.push_back(line); }
  void log(daemon::LogLevel level, const std::string& text) override;
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  std::int64_t wall_clock_us() override { return now_us(); }
  void start_daemon();
  void advance();
  void run_buses();  // until now; the daemon reads what has arrived

  std::filesystem::path directory_;
  config::Config config_;
  std::unique_ptr<daemon::LcmShim> shim_;
  std::vector<SimulatedBus> buses_;
  std::int64_t now_ns_ = 0;
  std::int64_t number_ = 0;
  std::vector<reply_t> replies_;
  std::map<std::string, state_t> states_;
  std::map<std::string, health_t> health_;
  std::vector<std::string> errors_;
  std::uint16_t master_ = 0;
  bool positions_confirmed_ = false;
  std::vector<std::string> move_lines_;
  std::vector<std::string> kept_;
  std::vector<std::function<void()>> disk_;  // what it is to tell the core
};

// One bus "hall" with `mcus` MCUs of `motors` motors each, named m01.., all in group "axes" of
// `table`. `manner` is the format, "fine" or "coarse", and with "_table" behind it moves are given
// to the MCUs as a whole, with "_ticks" every tick is sent.
std::string hall(int mcus, int motors, const std::string& manner = "fine",
                 const std::string& table = "bushd2-constant");

}  // namespace bushd::test
