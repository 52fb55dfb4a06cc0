#include "simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <iterator>
#include <set>
#include <utility>

#ifdef BUSHSIM_AVR
#include "sim/avr/avr_mcu.h"
#endif
#ifdef BUSHSIM_QEMU
#include "sim/qemu/qemu_mcu.h"
#endif

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;
using bushd::sim::EdgeSink;
using bushd::sim::Mcu;
using bushd::sim::TimeNs;

// Simulated before anybody is told that the bus is there: all MCUs have booted by then. A real one
// tests itself meanwhile.
constexpr TimeNs kHeadStartNs = 20'000'000;
constexpr TimeNs kRealHeadStartNs = 300'000'000;
// MCUs come out of reset one after the other, so that their ticks begin in different phases, as on
// a real bus.
constexpr TimeNs kBootSpacingNs = 617'000;
constexpr TimeNs kBootSpreadNs = 2'560'000;

// How long to sleep. Virtual time is exact whenever it is looked at; waking up serves only to hand
// out replies (a busy line: soon after they end) and edges (an idle line: now and then).
constexpr TimeNs kShortestSleepNs = 50'000;
constexpr TimeNs kBusySleepNs = 1'000'000;
constexpr TimeNs kMostBehindNs = 5'000'000;

// No more is read while this much still waits for the line: so whoever writes faster than the line
// meets a full buffer, as with a real adapter.
constexpr std::int64_t kBacklogBytes = 4096;

constexpr std::uint64_t kCollisionsReported = 10;

// Precondition: this bushsim can run the image (parse_images).
std::unique_ptr<Mcu> make_mcu([[maybe_unused]] const Image& image,
                              [[maybe_unused]] std::uint8_t address,
                              [[maybe_unused]] std::uint64_t unique_id,
                              [[maybe_unused]] std::uint16_t boots,
                              [[maybe_unused]] std::size_t index,
                              [[maybe_unused]] Mcu::Driver& driver,
                              [[maybe_unused]] EdgeSink* sink) {
#ifdef BUSHSIM_AVR
  if (image.chip == "atmega2560" || image.chip == "atmega1284p") {
    bushd::sim::AvrOptions options{image.path, address, unique_id, boots};
    options.chip = image.chip;
    // Its windings are there, whether its comparators are used or not.
    if (image.chip == "atmega1284p") options.power_stage = bushd::sim::PowerStageRules{};
    return std::make_unique<bushd::sim::AvrMcu>(options, index, driver, sink);
  }
#endif
#ifdef BUSHSIM_QEMU
  if (image.chip == "lm3s6965") {
    const bushd::sim::QemuOptions options{image.path, address, unique_id, boots};
    return std::make_unique<bushd::sim::QemuMcu>(options, index, driver, sink);
  }
#endif
  return nullptr;
}

}  // namespace

Simulator::Simulator(const Options& options, Waiter waiter, Pty pty,
                     std::unique_ptr<bushd::sim::VcdWriter> trace)
    : waiter_(std::move(waiter)),
      setup_(options.setup),
      links_(options.links),
      pty_(std::move(pty)),
      trace_(std::move(trace)),
      bus_(options.setup.baud, trace_.get()),
      has_images_(!options.images.empty()),
      adapter_(options.adapter),
      has_bit_errors_(options.adapter.bit_error_rate > 0) {
  add_mcus(options);
  bus_.on_master_byte = [this](std::uint8_t byte, TimeNs end_ns) {
    adapter_.take_from_line(byte, end_ns);
  };
  bus_.on_collision = [this](TimeNs time_ns, std::uint8_t first, std::uint8_t second) {
    report_collision(time_ns, first, second);
  };
}

void Simulator::add_mcus(const Options& options) {
  TimeNs boot_ns = 0;
  for (const std::uint8_t address : setup_.addresses) {
    const auto image = options.images.find(address);
    is_virtual_.push_back(image == options.images.end());
    if (is_virtual_.back()) {
      bushd::sim::McuOptions mcu{.address = address,
                                 .boot_number = options.boot_number,
                                 .keeps = options.keep,
                                 .boot_ns = boot_ns,
                                 .unique_id = setup_.first_unique_id + bus_.mcu_count()};
      if (setup_.measuring.contains(address)) mcu.supply = bushd::sim::SupplyRules{};
      bus_.add_mcu(mcu);
      for (const SwitchAt& one : options.switches) {
        if (one.address != address) continue;
        bus_.mcu(bus_.mcu_count() - 1).attach_switch(one.output, one.options);
      }
      boot_ns = (boot_ns + kBootSpacingNs) % kBootSpreadNs;
      continue;
    }
    bus_.add_mcu([&](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
      const auto boots = static_cast<std::uint16_t>(options.boot_number - 1);
      return make_mcu(image->second, address, setup_.first_unique_id + index, boots, index, driver,
                      sink);
    });
  }
}

void Simulator::report_collision(TimeNs time_ns, std::uint8_t first, std::uint8_t second) {
  if (bus_.collisions() > kCollisionsReported) return;
  const auto name = [](std::uint8_t address) {
    return address == BUSHD_ADDRESS_BROADCAST ? std::string("the master")
                                              : fmt::format("mcu{}", address);
  };
  fmt::print(stderr, "bushsim: collision at {:.6f} s: {} talks while {} does\n",
             static_cast<double>(time_ns) / 1e9, name(second), name(first));
  if (bus_.collisions() == kCollisionsReported) {
    fmt::print(stderr, "bushsim: further collisions are only counted\n");
  }
}

Result<std::unique_ptr<Simulator>> Simulator::create(const Options& options) {
  auto pty = Pty::open(options.links.front());
  if (!pty) return fail(pty.error());
  const TimeNs start_ns =
      monotonic_ns() - (options.images.empty() ? kHeadStartNs : kRealHeadStartNs);
  std::unique_ptr<bushd::sim::VcdWriter> trace;
  if (!options.trace.empty()) {
    std::set<std::uint8_t> measured;  // their windings
    for (const auto& [address, image] : options.images) {
      if (image.chip == "atmega1284p") measured.insert(address);
    }
    std::set<std::uint8_t> supplied = options.setup.measuring;
    if (options.console) supplied.insert(*options.console);
    // By it edges are compared with what other programs did. With images time may slip.
    const std::string comment =
        options.images.empty() ? fmt::format("time 0 is {} ns of CLOCK_MONOTONIC", start_ns) : "";
    auto created = bushd::sim::VcdWriter::create(options.trace, options.setup.addresses, measured,
                                                 comment, supplied);
    if (!created) return fail(created.error());
    trace = std::move(*created);
  }
  auto waiter = Waiter::create();
  if (!waiter) return fail(waiter.error());
  const auto at = std::ranges::find(options.setup.addresses, options.console.value_or(0));
  if (options.console && at == options.setup.addresses.end()) {
    return fail(fmt::format("--console {}: bus \"{}\" has no MCU with this address",
                            *options.console, options.setup.bus));
  }
  std::unique_ptr<Simulator> simulator(
      new Simulator(options, std::move(*waiter), std::move(*pty), std::move(trace)));
  simulator->start(start_ns);
  if (options.console) {
    simulator->console_ = static_cast<std::size_t>(at - options.setup.addresses.begin());
    simulator->typed_.emplace();
  }
  return simulator;
}

void Simulator::start(TimeNs start_ns) {
  closed_.resize(bus_.mcu_count());
  drive_inputs();
  start_ns_ = start_ns;
  bus_.advance_to(has_images_ ? kRealHeadStartNs : kHeadStartNs);
  if (has_images_) slip();
}

Result<void> Simulator::plug_in() {
  if (pty_) return {};
  auto opened = Pty::open(links_[links_used_ % links_.size()]);
  if (!opened) return fail(opened.error());
  ++links_used_;
  pty_.emplace(std::move(*opened));
  return {};
}

// The adapter loses its power: what it was sending breaks off, what it holds is lost.
void Simulator::unplug() {
  pty_.reset();
  adapter_.drop();
  bus_.break_off_master();
}

Result<void> Simulator::take_signals() {
  while (const auto signal = waiter_.signal()) {
    if (*signal == SIGRTMIN) {
      triggered_ = !triggered_;
      drive_inputs();
    } else if (*signal == SIGUSR1) {
      unplug();
    } else if (*signal == SIGUSR2) {
      if (const auto plugged = plug_in(); !plugged) return plugged;
    } else {
      ended_ = true;
    }
  }
  return {};
}

// Contacts, closed or open. Those of a chain are closed until somebody presses.
void Simulator::drive_inputs() {
  using bushd::sim::Signal;
  for (std::size_t i = 0; i < bus_.mcu_count(); ++i) {
    std::uint8_t closed = triggered_ ? BUSHD_INPUT_TRIGGER : 0;
    if (i == console_) closed |= buttons_;
    if (setup_.emergency_open.contains(setup_.addresses[i])) closed ^= BUSHD_INPUT_EMERGENCY;
    bus_.node(i).set_inputs({0, closed});
    const unsigned changed = closed ^ std::exchange(closed_[i], closed);
    for (const auto& [input, signal] : {std::pair{BUSHD_INPUT_TRIGGER, Signal::kTrigger},
                                        std::pair{BUSHD_INPUT_EMERGENCY, Signal::kEmergency}}) {
      if (!trace_ || (changed & input) == 0) continue;
      trace_->edge({bus_.now_ns(), i, signal, 0, (closed & input) != 0});
    }
  }
}

// The sensor of its supply shows as much as it can, as at a short.
void Simulator::overload(bool on) {
  overloaded_ = on;
  const std::uint16_t reading = on ? BUSHD_MAX_CURRENT : 0;
  bus_.node(*console_).set_current(reading);
  if (!trace_) return;
  trace_->sample({bus_.now_ns(), *console_, bushd::sim::Sample::kSupply, double{1} * reading});
}

// It boots again at once. An image boots as after a pulse at its RESET pin.
void Simulator::reset(bushd_reset_cause cause) {
  if (cause != BUSHD_RESET_EXTERNAL && !is_virtual_[*console_]) {
    fmt::print(stderr, "bushsim: D and W are for virtual MCUs; P resets this one\n");
    return;
  }
  if (is_virtual_[*console_]) bus_.mcu(*console_).set_reset_cause(cause);
  bus_.reboot(*console_);
}

void Simulator::press(char key) {
  constexpr unsigned kHeld = BUSHD_INPUT_FORWARD | BUSHD_INPUT_REVERSE;
  const auto hold = [this](unsigned buttons) {
    buttons_ = static_cast<std::uint8_t>((buttons_ & ~kHeld) | buttons);
    drive_inputs();
  };
  if (const auto byte = keypad_byte_of(key)) {
    bus_.node(*console_).keypad_byte(*byte, bus_.now_ns());
    return;
  }
  switch (key) {
    case 'F':
      return hold(BUSHD_INPUT_FORWARD);
    case 'R':
      return hold(BUSHD_INPUT_REVERSE);
    case 'X':
      return hold(0);
    case 'E':  // it locks
      buttons_ ^= BUSHD_INPUT_EMERGENCY;
      return drive_inputs();
    case 'O':
      return overload(!overloaded_);
    case 'P':
      return reset(BUSHD_RESET_EXTERNAL);
    case 'W':
      return reset(BUSHD_RESET_WATCHDOG);
    case 'D':
      return reset(BUSHD_RESET_POWER_ON);
    default:
      return;
  }
}

// Whoever types no more holds no button; what locks stays as it is.
Result<void> Simulator::take_keys() {
  const auto keys = typed_->read();
  if (!keys) return fail(keys.error());
  for (const char key : *keys) press(key);
  if (!keys->empty()) return {};
  press('X');
  typed_.reset();
  return {};
}

void Simulator::show() {
  const std::string text = bus_.node(*console_).take_keypad_display();
  if (text.empty()) return;
  fmt::print("{}", text);
  std::fflush(stdout);
}

// Simulated time as the clock on the wall has it.
TimeNs Simulator::wall_time_ns() const {
  return monotonic_ns() - start_ns_;
}

Result<void> Simulator::take_bytes(TimeNs now_ns) {
  std::array<std::uint8_t, kReadBytes> space;
  const auto size = pty_->read(space);
  if (!size) return fail(size.error());
  adapter_.pass_to_line({space.data(), *size});
  bus_.master_send({space.data(), *size}, now_ns);
  if (*size == 0) pty_->lift_exclusive_use();
  return {};
}

Result<void> Simulator::hand_out_replies(TimeNs now_ns) {
  const auto replies = adapter_.take_packets(now_ns);
  if (replies.empty()) return {};
  const auto taken = pty_ ? pty_->write(replies) : 0;
  if (!taken) return fail(taken.error());
  // Nobody reads, as with an adapter whose buffer is full: what does not fit is lost.
  dropped_bytes_ += replies.size() - *taken;
  return {};
}

bool Simulator::line_takes_more(TimeNs now_ns) const {
  const TimeNs backlog_ns =
      kBacklogBytes * bushd::sim::kBitsPerByte * bushd::sim::kNsPerSecond / setup_.baud;
  return bus_.wire_busy_until_ns() - now_ns < backlog_ns;
}

TimeNs Simulator::sleep_ns(TimeNs now_ns) const {
  const TimeNs busy_ns = bus_.wire_busy_until_ns() - now_ns;
  const TimeNs packet_ns = adapter_.next_packet_ns() - now_ns;
  if (busy_ns > 0) return std::min(packet_ns, std::clamp(busy_ns, kShortestSleepNs, kBusySleepNs));
  // When an image answers is not known before it does.
  return std::min(packet_ns, has_images_ ? kBusySleepNs : kIdleSleepNs);
}

// An image may take longer than the chip would: then simulated time falls behind, rather than that
// there is ever more to catch up with.
void Simulator::slip() {
  const TimeNs late_ns = wall_time_ns() - bus_.now_ns() - kMostBehindNs;
  if (late_ns > 0) start_ns_ += late_ns;
}

Result<void> Simulator::loop() {
  TimeNs now_ns = wall_time_ns();
  while (!ended_) {
    const bool listens = pty_ && line_takes_more(now_ns);
    const TimeNs until_ns = now_ns + sleep_ns(now_ns);
    const auto waited = waiter_.wait({listens ? pty_->fd() : -1, typed_ ? typed_->fd() : -1},
                                     until_ns - wall_time_ns());
    if (!waited) return fail(waited.error());
    if (has_images_) slip();
    now_ns = wall_time_ns();
    bus_.advance_to(now_ns);
    if (const auto taken = take_signals(); !taken) return taken;
    if ((*waited & 2u) != 0) {
      if (const auto taken = take_keys(); !taken) return taken;
    }
    if (typed_) show();
    if (pty_ && listens) {
      if (const auto taken = take_bytes(now_ns); !taken) return taken;
    }
    if (const auto handed = hand_out_replies(now_ns); !handed) return handed;
    if (trace_ && trace_->error()) return fail(*trace_->error());
  }
  return {};
}

Result<void> Simulator::run() {
  const auto ended = loop();
  if (!trace_) return ended;
  const auto closed = trace_->close(bus_.now_ns());
  return ended ? closed : ended;
}

std::string Simulator::summary() const {
  std::string text;
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < bus_.mcu_count(); ++i) {
    if (!is_virtual_[i]) {
      fmt::format_to(out, "bushsim: mcu{}: its image's steps are in the trace\n",
                     setup_.addresses[i]);
      continue;
    }
    const bushd::sim::VirtualMcu& mcu = bus_.mcu(i);
    std::uint64_t total = 0;
    std::vector<std::string> motors;
    for (std::size_t output = 0; output < bushd::sim::kOutputsPerMcu; ++output) {
      const bushd_virtual_shaft& shaft = mcu.shaft(output);
      total += shaft.travel_steps;
      if (shaft.travel_steps == 0) continue;
      motors.push_back(
          fmt::format("step{} {} (at {:+})", output, shaft.travel_steps, shaft.position_steps));
    }
    fmt::format_to(out, "bushsim: mcu{}: {} steps made{}{}; bad frames {}, rejected {}\n",
                   mcu.address(), total, motors.empty() ? "" : ": ", fmt::join(motors, ", "),
                   mcu.core().reception.bad_frames, mcu.core().reception.rejected_frames);
  }
  fmt::format_to(out, "bushsim: {:.3f} s; collisions {}, corrupted bytes {}, dropped bytes {}\n",
                 static_cast<double>(bus_.now_ns()) / 1e9, bus_.collisions(),
                 bus_.corrupted_bytes(), dropped_bytes_);
  if (has_bit_errors_) fmt::format_to(out, "bushsim: {} bits flipped\n", adapter_.flipped_bits());
  return text;
}

}  // namespace bushsim
