#include "board_simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <iterator>

#ifdef BUSHSIM_AVR
#include "sim/avr/avr_board.h"
#endif

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;
using bushd::sim::BoardMotors;
using bushd::sim::TimeNs;

}  // namespace

BoardSimulator::BoardSimulator(const Options& options, Waiter waiter, Pty pty,
                               std::unique_ptr<bushd::sim::VcdWriter> trace)
    : waiter_(std::move(waiter)),
      links_(options.links),
      pty_(std::move(pty)),
      trace_(std::move(trace)),
      board_(make_board(options, trace_.get())),
      start_ns_(monotonic_ns()) {
  BoardMotors& motors = board_->motors();
  motors.keeps_steps = false;
  for (const SwitchAt& one : options.switches) {
    BoardMotors::Motor& motor = motors.motor(one.output);
    (one.options.positive_end ? motor.right_limit_at : motor.left_limit_at) = one.options.at_steps;
  }
}

std::unique_ptr<bushd::sim::BoardEnd> BoardSimulator::make_board(const Options& options,
                                                                 bushd::sim::EdgeSink* trace) {
  const Setup& setup = options.setup;
  if (setup.converter) {
    const bushd::sim::FrequencyConverter converter(
        {.hz_per_code =
             options.converter.gain * setup.converter->max_hz / setup.converter->max_code,
         .offset_codes = options.converter.offset_codes,
         .drift_per_s = options.converter.drift_per_s});
#ifdef BUSHSIM_AVR
    if (!options.image.empty()) {
      return std::make_unique<bushd::sim::AvrBoard>(options.image, setup.baud, converter, trace);
    }
#endif
    return std::make_unique<bushd::sim::BoardLine>(setup.baud, converter, trace);
  }
#ifdef BUSHSIM_AVR
  if (!options.image.empty()) {
    return std::make_unique<bushd::sim::AvrBoard>(options.image, setup.baud, setup.board_start_hz,
                                                  trace);
  }
#endif
  return std::make_unique<bushd::sim::BoardLine>(setup.baud, setup.board_start_hz, trace);
}

Result<std::unique_ptr<BoardSimulator>> BoardSimulator::create(const Options& options) {
  for (const SwitchAt& one : options.switches) {
    if (one.output < BoardMotors::kMotors && one.options.input == one.output) continue;
    return fail(fmt::format("--switch: a board has motors 0..{}, each with switches of its own",
                            BoardMotors::kMotors - 1));
  }
  auto pty = Pty::open(options.links.front());
  if (!pty) return fail(pty.error());
  std::unique_ptr<bushd::sim::VcdWriter> trace;
  if (!options.trace.empty()) {
    auto created = bushd::sim::VcdWriter::create(options.trace, options.setup.addresses);
    if (!created) return fail(created.error());
    trace = std::move(*created);
  }
  auto waiter = Waiter::create();
  if (!waiter) return fail(waiter.error());
  return std::unique_ptr<BoardSimulator>(
      new BoardSimulator(options, std::move(*waiter), std::move(*pty), std::move(trace)));
}

TimeNs BoardSimulator::now_ns() const {
  return monotonic_ns() - start_ns_;
}

Result<void> BoardSimulator::run() {
  Result<void> done;
  while (done && !ended_) {
    done = wait();
    if (done) done = take_signals();
    if (done) done = take_bytes();
    if (done) done = hand_out_answers();
    if (!trace_) continue;
    // A pulse ends after its step has been told.
    trace_->settled(board_->advanced_to_ns());
    if (trace_->error()) done = fail(*trace_->error());
  }
  if (!trace_) return done;
  const auto closed = trace_->close(std::max(now_ns(), board_->motors().last_edge_ns()));
  return done ? closed : done;
}

Result<void> BoardSimulator::wait() const {
  const TimeNs sleep_ns = std::min(board_->next_event_ns() - now_ns(), kIdleSleepNs);
  const auto waited = waiter_.wait({pty_ ? pty_->fd() : -1}, sleep_ns);
  if (!waited) return fail(waited.error());
  return {};
}

Result<void> BoardSimulator::take_signals() {
  while (const auto signal = waiter_.signal()) {
    if (*signal == SIGUSR1) {
      pty_.reset();
    } else if (*signal == SIGUSR2 && !pty_) {
      auto opened = Pty::open(links_[links_used_++ % links_.size()]);
      if (!opened) return fail(opened.error());
      pty_.emplace(std::move(*opened));
    } else if (*signal != SIGUSR2 && *signal != SIGRTMIN) {  // no trigger input
      ended_ = true;
    }
  }
  return {};
}

Result<void> BoardSimulator::take_bytes() {
  if (!pty_) return {};
  std::array<std::uint8_t, kReadBytes> space;
  const auto size = pty_->read(space);
  if (!size) return fail(size.error());
  board_->send(now_ns(), {space.data(), *size});
  if (*size == 0) pty_->lift_exclusive_use();
  return {};
}

Result<void> BoardSimulator::hand_out_answers() {
  const auto answers = board_->advance(now_ns());
  if (!pty_ || answers.empty()) return {};
  const auto taken = pty_->write(answers);
  if (!taken) return fail(taken.error());
  return {};
}

std::string BoardSimulator::summary() const {
  std::string motors;
  const BoardMotors& board = board_->motors();
  for (unsigned i = 0; i < BoardMotors::kMotors; ++i) {
    const std::uint64_t made = board.travel(i);
    if (made == 0) continue;
    fmt::format_to(std::back_inserter(motors), "{}step{} {} (at {:+})",
                   motors.empty() ? ": " : ", ", i, made, board.position(i));
  }
  return fmt::format("bushsim: board: steps made{}\n", motors.empty() ? ": none" : motors);
}

}  // namespace bushsim
