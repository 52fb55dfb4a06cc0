#include "daemon/shell/event_loop.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <limits>

#include "base/printable.h"
#include "daemon/shell/process.h"
#include "daemon/shell/service_manager.h"
#include "daemon/shell/table_service.h"

namespace bushd::daemon {
namespace {

constexpr std::size_t kMaxTableJobs = 64;  // anybody may ask for tables
constexpr int kMaxTableJobsPerClient = 4;

// What is due within a step is done at its end, in one turn: the polls of many buses, as a rule.
// They may be late by as much, and the clock of an MCU is told to no less.
constexpr std::int64_t kStepUs = 500;

std::int64_t in_step(std::int64_t due_us) {
  if (due_us > std::numeric_limits<std::int64_t>::max() - kStepUs) return due_us;
  return (due_us + kStepUs - 1) / kStepUs * kStepUs;
}

}  // namespace

EventLoop::EventLoop(const config::Config& config, Fronts fronts, MoveLogWriter* move_log,
                     TableLibrary library, state::Store* store)
    : config_(config),
      fronts_(fronts),
      move_log_(move_log),
      library_(std::move(library)),
      store_(store),
      run_(new_run()),
      core_(config, *this, master_number(run_)),
      publishing_(run_, config.state_parts(), config.buses.size(),
                  {.now_us = now_us, .unix_us = unix_time_us}),
      reception_(
          core_.counted_stops(),
          [this](const api::Asker& asker, const api::Request& request) {
            core_.request(now_us(), with_log(asker, request), request);
          },
          Reception::Limits(), now_us),
      lcm_front_({.transport = fronts.lcm,
                  .stops = fronts.stops,
                  .prefix = config.lcm.prefix,
                  .commands = config.lcm.commands,
                  .run = run_,
                  .seed = static_cast<std::uint64_t>(run_)},
                 reception_, publishing_, unix_time_us),
      lcm_watch_(lcm_front_, publishing_, config.lcm.prefix,
                 [this](LogLevel level, const std::string& text) { log(level, {}, text); }),
      alive_us_(alive_period_us()) {
  for (std::size_t b = 0; b < config.buses.size(); ++b) {
    const auto mcus = std::ranges::count(config.mcus, BusId{b}, &config::Mcu::bus);
    ports_.add(PortSearch(config.buses[b].port, static_cast<std::size_t>(mcus)));
  }
  for ([[maybe_unused]] const config::Mcu& mcu : config.mcus) {
    mcu_states_.add(api::McuState::kOffline);
  }
  if (store != nullptr) core_.kept().use(store->kept(), *this, config.state.required);
  publishing_.set_refresh([this] { core_.publish_state(now_us()); });
  publishing_.set_log([this](const std::string& text) { log(LogLevel::kError, {}, text); });
  publishing_.add(lcm_front_);
  add_keypads();
  if (fronts.control == nullptr) return;
  socket_front_ = std::make_unique<SocketFront>(
      *fronts.control, run_, reception_, publishing_, unix_time_us,
      [this](const std::string& text) { log(LogLevel::kWarning, {}, text); });
  publishing_.add(*socket_front_);
  socket_front_->set_look([this](std::function<bool()> look, std::function<void(bool)> told) {
    worker_.post([look = std::move(look), told = std::move(told)]() -> Worker::Completion {
      return [told, seen = look()] { told(seen); };
    });
  });
}

EventLoop::~EventLoop() {
  watches_.clear();  // before the descriptors of the workers are closed
}

Result<void> EventLoop::keep_watching(int fd, PollSet::Handler handler) {
  auto watched = poll_set_.watch(fd, PollSet::Turn::kFirst, std::move(handler));
  if (!watched) return fail(watched.error());
  watches_.push_back(std::move(*watched));
  return {};
}

Result<void> EventLoop::set_up_signals() {
  if (const auto opened = signals_.open({SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2}); !opened) {
    return opened;
  }
  return keep_watching(signals_.fd(), [this](std::uint32_t) { handle_signals(now_us()); });
}

Result<void> EventLoop::set_up() {
  if (const auto opened = poll_set_.open(); !opened) return opened;
  if (const auto watched = set_up_signals(); !watched) return watched;
  const PollSet::Handler lcm = [this](std::uint32_t) { lcm_front_.handle(); };
  if (const auto watched = keep_watching(fronts_.lcm.fd(), lcm); !watched) return watched;
  if (fronts_.stops != nullptr) {
    if (const auto watched = keep_watching(fronts_.stops->fd(), lcm); !watched) return watched;
  }
  if (fronts_.control != nullptr) {
    const auto watched =
        keep_watching(fronts_.control->fd(), [this](std::uint32_t) { socket_front_->handle(); });
    if (!watched) return watched;
  }
  std::vector<Worker*> workers = {&worker_, &port_worker_};
  if (store_ != nullptr) workers.insert(workers.end(), {&state_worker_, &mark_worker_});
  for (Worker* worker : workers) {
    if (const auto started = worker->start(); !started) return started;
    const auto watched = keep_watching(worker->fd(), [worker](std::uint32_t) { worker->handle(); });
    if (!watched) return watched;
  }
  return lcm_front_.subscribe();
}

// What groups were given before this daemon started is as binding as the configuration.
Result<void> EventLoop::restore_tables() {
  const auto kept = library_.kept();
  if (!kept) return fail(kept.error());
  for (std::size_t group = 0; group < config_.groups.size(); ++group) {
    const auto wanted = kept->find(config_.groups[group].name);
    if (wanted == kept->end()) continue;
    const auto table = library_.open(wanted->second);
    auto restored = table ? core_.tables().restore({group}, wanted->second, *table)
                          : Result<void>(fail(table.error()));
    if (restored) continue;
    restored.error().message +=
        " (table " + wanted->second + " was given to group " + config_.groups[group].name + "; " +
        library_.in_service().string() +
        " says so: remove it, and all groups have those of the configuration)";
    return restored;
  }
  return {};
}

Result<void> EventLoop::run() {
  if (const auto restored = restore_tables(); !restored) return restored;
  if (const auto ready = set_up(); !ready) return ready;
  started_us_ = now_us();
  open_due_ports(started_us_);
  status_ = status_text(config_, mcu_states_);
  tell_ready();
  while (true) {
    const std::int64_t now = now_us();
    for (const BusId bus : ports_.ids()) {
      if (ports_[bus].lost) lose_port(now, bus, *std::exchange(ports_[bus].lost, std::nullopt));
    }
    open_due_ports(now);
    search_ports(now);
    step_keypads(now);
    publishing_.set_dropped_messages(lcm_front_.dropped() +
                                     (socket_front_ ? socket_front_->dropped() : 0));
    keep_up(now);
    lcm_watch_.step(now);
    publishing_.step();
    if (socket_front_) socket_front_->step(now);
    tell_left_out(now);
    tell_systemd(now);
    const bool done = core_.at_rest() && core_.settled();
    if (shut_down_by_us_ && (done || now >= *shut_down_by_us_)) break;
    if (const auto handled = handle_ready(); !handled) return handled;
    carry_out_some();
    core_.work();
  }
  tell_left_out(std::numeric_limits<std::int64_t>::max());
  close_store();
  log_cpu_share();
  if (core_.at_rest()) return {};
  return fail("not all motors are known to be at rest; their MCUs run them down by themselves");
}

void EventLoop::tell_systemd(std::int64_t now) {
  if (status_ && tell_status(*status_)) status_.reset();
  if (alive_due_us_ > now) return;
  alive_due_us_ = alive_us_ > 0 ? now + alive_us_ : std::numeric_limits<std::int64_t>::max();
  if (alive_us_ > 0) tell_alive();
}

void EventLoop::keep_up(std::int64_t now) {
  // Answers that were left unread come before the core looks whether they are late.
  for (const BusId bus : ports_.ids()) {
    const bool due = ports_[bus].listen_us > 0 && ports_[bus].listen_us <= now;
    if (due) handle_port(now, bus, EPOLLIN);
  }
  core_.keep_up(now);
  for (const BusId bus : ports_.ids()) {
    if (const auto status = std::exchange(ports_[bus].status, std::nullopt)) {
      core_.pulse_status(now_us(), bus, *status);
    }
    update_interest(now, bus);
  }
}

Result<void> EventLoop::handle_ready() {
  const std::int64_t now = now_us();
  const std::int64_t due_us = next_wake_us();
  std::int64_t wait_us = due_us <= now ? 0 : in_step(due_us) - now;
  // All that is ready comes before any work in slices, but not what comes meanwhile; where there is
  // no work, run() looks again.
  const std::size_t most = (watches_.size() + ports_.size() + keypads_.size()) / PollSet::kAtOnce;
  for (std::size_t i = 0; i <= most; ++i) {
    const auto handled = poll_set_.handle(wait_us);
    if (!handled) return fail(handled.error());
    if (!*handled || (reception_.idle() && !core_.has_work())) return {};
    keep_up(now_us());
    wait_us = 0;
  }
  return {};
}

std::int64_t EventLoop::next_wake_us() const {
  if (!reception_.idle()) return 0;
  std::int64_t wake = std::min(
      {core_.next_wake_us(), publishing_.next_wake_us(), next_keypad_wake_us(), alive_due_us_});
  for (const Port& port : ports_) {
    if (port.lost) return 0;
    if (port.serial && port.listen_us > 0) wake = std::min(wake, port.listen_us);
    if (port.opening) continue;
    wake = std::min(wake, port.serial ? port.search.due_us() : port.open_due_us);
  }
  if (socket_front_) wake = std::min(wake, socket_front_->next_wake_us());
  if (shut_down_by_us_) wake = std::min(wake, *shut_down_by_us_);
  return wake;
}

void EventLoop::handle_signals(std::int64_t now) {
  while (const auto signal = signals_.take()) handle_signal(now, *signal);
}

void EventLoop::handle_signal(std::int64_t now, int signal) {
  if (signal == SIGUSR1 || signal == SIGUSR2) {
    log(LogLevel::kInfo, {}, fmt::format("{}: ignored", signal == SIGUSR1 ? "SIGUSR1" : "SIGUSR2"));
    return;
  }
  if (shut_down_by_us_) return;
  if (signal == SIGHUP) {
    write_log(LogLevel::kInfo, "SIGHUP: all tables are read again");
    return core_.tables().request({}, api::ReloadTables{});
  }
  spdlog::info("{}: ramping all motors down", signal == SIGTERM ? "SIGTERM" : "SIGINT");
  tell_stopping();
  core_.shut_down(now);
  shut_down_by_us_ = core_.rest_by_us(now) + kShutDownSlackUs;
}

void EventLoop::read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) {
  worker_.post([this, ticket, wanted]() -> Worker::Completion {
    std::vector<Result<tables::TablePtr>> read;
    for (const std::string& table : wanted) read.push_back(library_.open(table));
    return [this, ticket, read] { core_.tables().read(now_us(), ticket, read); };
  });
}

void EventLoop::keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) {
  worker_.post([this, ticket, wanted]() -> Worker::Completion {
    const auto kept = library_.keep(wanted);
    return [this, ticket, kept] { core_.tables().kept(ticket, kept); };
  });
}

void EventLoop::carry_out_some() {
  const std::int64_t until = now_us() + Reception::kSliceUs;
  while (!reception_.idle() && !core_.begins_moves()) {
    reception_.carry_out_next();
    if (now_us() >= until) return;
  }
}

void EventLoop::serve_tables(const api::Asker& asker, const api::Request& request) {
  const std::string client = asker.session->text();
  const auto jobs = table_jobs_.find(client);
  if (worker_.waiting() >= kMaxTableJobs ||
      (jobs != table_jobs_.end() && jobs->second >= kMaxTableJobsPerClient)) {
    return asker.answer(api::Refused{"too many requests about tables wait; try again in a moment"});
  }
  ++table_jobs_[client];
  const auto* set = std::get_if<api::SetTable>(&request);
  if (set == nullptr) return post_table_job(asker, request);
  // A table's sums are made there too, and its codes are looked at; the core knows whose it is.
  worker_.post([this, asker, request, set = *set]() -> Worker::Completion {
    const auto review =
        tables::make(set.content.content).map([this](const tables::TablePtr& table) {
          return TableReview(config_, table);
        });
    return [this, asker, request, name = set.table, review] {
      const auto good = review ? core_.tables().check_content(name, *review) : fail(review.error());
      if (good) return post_table_job(asker, request);
      answer_table_job(asker, api::Refused{good.error().text()});
    };
  });
}

void EventLoop::post_table_job(const api::Asker& asker, const api::Request& request) {
  worker_.post([this, asker, request]() -> Worker::Completion {
    const api::Reply reply = daemon::answer(library_, request, asker.session->client_id());
    return [this, asker, reply] { answer_table_job(asker, reply); };
  });
}

void EventLoop::answer_table_job(const api::Asker& asker, const api::Reply& reply) {
  const auto jobs = table_jobs_.find(asker.session->text());
  if (--jobs->second == 0) table_jobs_.erase(jobs);
  asker.answer(reply);
}

void EventLoop::log_cpu_share() const {
  const double elapsed_s = static_cast<double>(now_us() - started_us_) * 1e-6;
  const double cpu_s = static_cast<double>(cpu_us()) * 1e-6;
  spdlog::info("ended; used {:.2f} s of CPU in {:.1f} s, {:.1f} % of a core", cpu_s, elapsed_s,
               100.0 * cpu_s / elapsed_s);
}

void EventLoop::publish(McuId mcu, const api::StateSnapshot& state) {
  const bool computed = mcu.value >= config_.mcus.size();
  if (!computed && std::exchange(mcu_states_[mcu], state.state) != state.state) {
    status_ = status_text(config_, mcu_states_);
  }
  publishing_.publish(mcu, state);
}

void EventLoop::publish(McuId mcu, const api::Description& description) {
  publishing_.publish(mcu, description);
}

void EventLoop::publish(BusId bus, const api::HealthSnapshot& health) {
  publishing_.publish(bus, health);
}

void EventLoop::mark(std::vector<state::Mark> marks) {
  mark_worker_.post([this, marks = std::move(marks)]() -> Worker::Completion {
    return [this, done = store_->mark(marks)] { core_.kept().marked(now_us(), done); };
  });
}

void EventLoop::write(state::Batch batch) {
  state_worker_.post([this, batch = std::move(batch)]() -> Worker::Completion {
    return [this, done = store_->write(batch)] { core_.kept().written(now_us(), done); };
  });
}

void EventLoop::history(std::string motor, int most, Told told) {
  state_worker_.post(
      [this, motor = std::move(motor), most, told = std::move(told)]() -> Worker::Completion {
        return [told, found = store_->history(motor, most)] { told(found); };
      });
}

void EventLoop::close_store() {
  if (store_ == nullptr || state_worker_.waiting() > 0) return;
  if (!core_.settled() || !core_.kept().guarded()) return;
  if (const auto ended = store_->end(); !ended) {
    spdlog::warn("state store: {}", ended.error().text());
  }
}

std::int64_t EventLoop::wall_clock_us() {
  return unix_time_us();
}

}  // namespace bushd::daemon
