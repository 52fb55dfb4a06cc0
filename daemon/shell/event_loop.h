// The loop around the core: serial ports, front ends, signals and the clock, in one thread. Run by
// systemd it tells when it is ready, and feeds the watchdog that the unit may ask for.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/by_id.h"
#include "bus/port/serial_port.h"
#include "config/config.h"
#include "control/server.h"
#include "daemon/core/core.h"
#include "daemon/fronts/keypad.h"
#include "daemon/fronts/lcm_front.h"
#include "daemon/fronts/lcm_watch.h"
#include "daemon/fronts/publishing.h"
#include "daemon/fronts/reception.h"
#include "daemon/fronts/socket_front.h"
#include "daemon/shell/bus_port.h"
#include "daemon/shell/log_limit.h"
#include "daemon/shell/move_log_writer.h"
#include "daemon/shell/poll_set.h"
#include "daemon/shell/port_search.h"
#include "daemon/shell/signals.h"
#include "daemon/shell/table_library.h"
#include "daemon/shell/worker.h"
#include "lcm/transport.h"
#include "state/keeper.h"
#include "state/store.h"

namespace bushd::daemon {

class EventLoop : private Outputs, private state::Backend {
 public:
  // What clients come by. Without `stops`, `lcm` takes those too; `control` may be null.
  struct Fronts {
    lcm::Transport& lcm;
    lcm::Transport* stops = nullptr;
    control::Server* control = nullptr;
  };
  // Everything outlives the loop. `move_log` may be null; so may `store`: nothing is kept of
  // positions then.
  EventLoop(const config::Config& config, Fronts fronts, MoveLogWriter* move_log,
            TableLibrary library, state::Store* store);
  ~EventLoop() override;

  // Runs until SIGTERM or SIGINT, then ramps all motors down and returns. Precondition: these,
  // SIGHUP, SIGUSR1 and SIGUSR2 are blocked in every thread of the process (lcm::Transport starts
  // some).
  Result<void> run();

 private:
  static constexpr std::int64_t kReopenUs = 500'000;
  // Beyond the time that the ramp-downs need: an MCU that does not answer must not keep the daemon
  // from ending.
  static constexpr std::int64_t kShutDownSlackUs = 3'000'000;

  struct Port {
    explicit Port(PortSearch its_search);
    Port(Port&&) noexcept;
    ~Port();
    PortSearch search;
    std::unique_ptr<BusPort> serial{};
    bool opening = false;                       // a worker opens it, or another match
    std::optional<link::PulseStatus> status{};  // to be told to the core
    std::unique_ptr<PollSet::Watch> watch{};    // of its descriptor
    std::int64_t listen_us = 0;                 // what comes before is left unread
    std::int64_t open_due_us = 0;
    std::string last_error{};  // so that a missing port is logged once, not twice a second
    // Why it is to be given up, as soon as neither the core nor its watch is at work.
    std::optional<std::string> lost{};
  };

  struct KeypadPort {
    KeypadPort(const config::Keypad& its_config, std::string motor, Keypad::Ask ask);
    ~KeypadPort();
    const config::Keypad& config;
    Keypad keypad;
    std::optional<serial::SerialPort> serial{};
    bool opening = false;
    std::unique_ptr<PollSet::Watch> watch{};
    std::int64_t open_due_us = 0;
    std::string last_error{};
    std::optional<std::string> lost{};  // as of Port
  };

  Result<void> set_up();
  Result<void> set_up_signals();
  Result<void> keep_watching(int fd, PollSet::Handler handler);
  void open_due_ports(std::int64_t now_us);
  void port_opened(std::int64_t now_us, BusId bus, Result<std::unique_ptr<BusPort>> opened);
  void search_ports(std::int64_t now_us);
  void next_port_opened(std::int64_t now_us, BusId bus, Result<std::unique_ptr<BusPort>> opened);
  std::vector<PortInUse> ports_in_use(BusId asking) const;
  void lose_port(std::int64_t now_us, BusId bus, const std::string& cause);
  // Without a word to the core.
  void release_port(BusId bus);
  void handle_port(std::int64_t now_us, BusId bus, std::uint32_t events);
  void close_in_worker(std::shared_ptr<void> port);
  void add_keypads();
  void open_keypad(KeypadPort& port);
  void keypad_opened(std::int64_t now_us, KeypadPort& port, Result<serial::SerialPort> opened);
  void lose_keypad(std::int64_t now_us, KeypadPort& port);
  void handle_keypad(std::int64_t now_us, KeypadPort& port);
  void step_keypads(std::int64_t now_us);
  std::int64_t next_keypad_wake_us() const;
  void handle_signals(std::int64_t now_us);
  void handle_signal(std::int64_t now_us, int signal);
  Result<void> restore_tables();
  // The core has what is due done, and hears at once what became of it.
  void keep_up(std::int64_t now_us);
  // Waits until something comes, and handles what has come: a stop among it comes before any more
  // of the requests that wait.
  Result<void> handle_ready();
  // Some of the requests that wait, for as long as nothing else has to wait for that.
  void carry_out_some();
  void post_table_job(const api::Asker& asker, const api::Request& request);
  void answer_table_job(const api::Asker& asker, const api::Reply& reply);
  void update_interest(std::int64_t now_us, BusId bus);
  std::int64_t next_wake_us() const;
  void log_cpu_share() const;
  api::Asker with_log(const api::Asker& asker, const api::Request& request);
  void tell_left_out(std::int64_t now_us);
  void tell_systemd(std::int64_t now_us);
  // Positions are on the disk, and it is told that the daemon has ended well.
  void close_store();

  // Outputs
  void send(BusId bus, std::span<const std::uint8_t> bytes) override;
  void pulse(BusId bus, const link::PulseOrder& order) override;
  void publish(McuId mcu, const api::StateSnapshot& state) override;
  void publish(McuId mcu, const api::Description& description) override;
  void publish(BusId bus, const api::HealthSnapshot& health) override;
  void publish_lam(const api::CamacLam& lam) override { publishing_.publish_lam(lam); }
  void move_log(const std::string& json_line) override;
  void log(LogLevel level, LogSubject subject, const std::string& text) override;
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override;
  void serve_tables(const api::Asker& asker, const api::Request& request) override;
  std::int64_t wall_clock_us() override;

  // state::Backend
  void mark(std::vector<state::Mark> marks) override;
  void write(state::Batch batch) override;
  void history(std::string motor, int most, Told told) override;

  const config::Config& config_;
  Fronts fronts_;
  MoveLogWriter* move_log_;
  TableLibrary library_;
  state::Store* store_;
  std::int64_t run_;  // tells this run of the daemon from others
  Core core_;
  Publishing publishing_;
  Reception reception_;
  LcmFront lcm_front_;
  std::unique_ptr<SocketFront> socket_front_;  // null: no control socket
  PollSet poll_set_;
  Signals signals_;
  ById<BusId, Port> ports_;
  std::vector<std::unique_ptr<KeypadPort>> keypads_;
  std::vector<std::uint8_t> received_;               // by one read
  ById<McuId, api::McuState> mcu_states_;            // as published last
  std::unordered_map<std::string, int> table_jobs_;  // waiting, by client
  LogLimit log_limit_;
  LogLimit stop_limit_;  // of stops in the log of moves
  LcmWatch lcm_watch_;
  std::vector<std::unique_ptr<PollSet::Watch>> watches_;  // those of ports aside
  std::int64_t started_us_ = 0;
  std::optional<std::string> status_;  // to be told to systemd
  const std::int64_t alive_us_;        // of alive_period_us()
  std::int64_t alive_due_us_ = 0;
  std::optional<std::int64_t> shut_down_by_us_;
  // The last members: their threads use others.
  Worker worker_;
  Worker port_worker_;   // opens and closes ports
  Worker state_worker_;  // the database of positions
  Worker mark_worker_;   // moving marks, which motions wait for
};

}  // namespace bushd::daemon
