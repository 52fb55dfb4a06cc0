// The loop around the core: serial ports, LCM, signals and the clock, one thread, one epoll.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "daemon/lcm_shim.h"
#include "daemon/move_log.h"
#include "daemon/table_library.h"
#include "daemon/worker.h"
#include "lcm/transport.h"
#include "serial/serial_port.h"

namespace bushd::daemon {

class EventLoop : private LcmOutputs {
 public:
  // Everything outlives the loop. `move_log` may be null.
  EventLoop(const config::Config& config, lcm::Transport& transport, MoveLog* move_log,
            TableLibrary library);
  ~EventLoop() override;

  // Runs until SIGTERM or SIGINT, then ramps all motors down and returns. Precondition: both
  // signals are blocked in every thread of the process (lcm::Transport starts some).
  Result<void> run();

 private:
  static constexpr std::int64_t kReopenUs = 500'000;
  // Beyond the time that the ramp-downs need: an MCU that does not answer must not keep the daemon
  // from ending.
  static constexpr std::int64_t kShutDownSlackUs = 3'000'000;

  struct Port {
    std::optional<serial::SerialPort> serial;
    std::int64_t open_due_us = 0;
    std::string last_error;  // so that a missing port is logged once, not twice a second
  };

  Result<void> set_up();
  Result<void> watch(int fd, std::uint32_t events, std::uint64_t tag);
  void open_due_ports(std::int64_t now_us);
  void open_port(std::int64_t now_us, std::size_t bus);
  void lose_port(std::int64_t now_us, std::size_t bus, const std::string& cause);
  void handle_port(std::int64_t now_us, std::size_t bus, std::uint32_t events);
  void handle_signal(std::int64_t now_us);
  Result<void> restore_tables();
  void on_table_request(const table_request_t& request);
  void update_write_interest(std::size_t bus);
  std::int64_t next_wake_us() const;
  void log_cpu_share() const;
  void check_published(const Result<void>& published);

  // Outputs
  void send(BusId id, std::span<const std::uint8_t> bytes) override;
  void reply(const reply_t& reply) override;
  void state(const state_t& state) override;
  void health(const health_t& health) override;
  void move_log(const std::string& json_line) override;
  void log(LogLevel level, const std::string& text) override;
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  std::int64_t wall_clock_us() override;

  const config::Config& config_;
  lcm::Transport& transport_;
  MoveLog* move_log_;
  TableLibrary library_;
  LcmShim shim_;
  Core& core_;
  std::vector<Port> ports_;
  std::vector<std::optional<std::string>>
      lost_;  // by bus: a write failed, to be handled outside the core
  std::string state_channel_;
  std::string health_channel_;
  std::string reply_channel_;
  std::string command_channel_;
  std::string table_reply_channel_;
  bool mute_ = false;  // LCM takes nothing
  int epoll_ = -1;
  int signals_ = -1;
  std::int64_t started_us_ = 0;
  std::optional<std::int64_t> shut_down_by_us_;
  Worker worker_;  // the last member: its thread uses others
};

}  // namespace bushd::daemon
