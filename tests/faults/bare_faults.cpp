// What comes over controllers without firmware.
#include <fmt/core.h>

#include <algorithm>

#include "bare_world.h"
#include "times.h"

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

// From the end of a fault to what follows from it.
constexpr TimeNs kAfterFaultNs = 50 * kMs;

}  // namespace

TimeNs BareWorld::faults_over_ns() const {
  TimeNs over_ns = now_ns_;
  for (const Port& port : ports_) {
    over_ns = std::max(over_ns, port.lines_until_ns);
    if (!port.plugged) over_ns = std::max(over_ns, port.back_ns);
    if (port.pulses) over_ns = std::max(over_ns, port.pulses->stalled_until_ns());
    if (port.board) over_ns = std::max(over_ns, port.board->faults_over_ns());
  }
  for (const Pad& pad : pads_) {
    if (!pad.plugged) over_ns = std::max(over_ns, pad.back_ns);
    over_ns = std::max(over_ns, pad.box.pulled_until_ns());
  }
  return over_ns;
}

void BareWorld::fault(TimeNs now_ns, const std::string& what, const std::string& of) {
  ++faults_[what];
  recent_.note(now_ns, fmt::format("fault: {} {}", of, what));
}

void BareWorld::disturb(TimeNs now_ns) {
  const auto which = chance_.below(ports_.size() + pads_.size());
  if (which >= ports_.size()) return disturb_keypad(now_ns, pads_[which - ports_.size()]);
  Port& port = ports_[which];
  if (!port.plugged) return;
  if (chance_.one_in(6)) return unplug(now_ns, port, chance_.magnitude(10 * kMs, 3 * kSecond));
  port.pulses ? disturb_pulses(now_ns, port) : disturb_board(now_ns, port);
}

void BareWorld::unplug(TimeNs now_ns, Port& port, TimeNs for_ns) {
  port.plugged = port.told = false;
  port.back_ns = now_ns + for_ns;
  port.status.reset();
  if (port.pulses) port.pulses->break_off(now_ns);
  for (const std::size_t motor : port.motors) judge_.port_lost(motor);
  fault(now_ns, "port lost", config_.buses[port.bus].name);
}

void BareWorld::disturb_pulses(TimeNs now_ns, Port& port) {
  const std::string& of = config_.buses[port.bus].name;
  const std::size_t motor = port.motors.front();
  if (chance_.one_in(3)) {
    const auto line = chance_.between(1, 2);  // DSR or CTS
    port.pulses->drive.set_lines(static_cast<std::uint8_t>(1 << line));
    port.lines_until_ns = now_ns + chance_.magnitude(5 * kMs, kSecond);
    return fault(now_ns, "limit switch", of);
  }
  const TimeNs until_ns = now_ns + chance_.magnitude(kMs, 1500 * kMs);
  port.pulses->stall(until_ns);
  judge_.excused_until(motor, until_ns + kAfterFaultNs);
  fault(now_ns, "stalled driver", of);
}

void BareWorld::disturb_board(TimeNs now_ns, Port& port) {
  using Fault = BoardPort::AnswerFault;
  const std::string& of = config_.buses[port.bus].name;
  for (const std::size_t motor : port.motors) judge_.cut_off(motor);
  switch (chance_.below(9)) {
    case 0:
      port.board->spoil_next_answer(Fault::kLost);
      return fault(now_ns, "lost answer", of);
    case 1:
      port.board->spoil_next_answer(Fault::kLate);
      return fault(now_ns, "late answer", of);
    case 2:
      port.board->spoil_next_answer(Fault::kGarbled);
      return fault(now_ns, "garbled answer", of);
    case 3:
      port.board->spoil_next_answer(Fault::kRepeated);
      return fault(now_ns, "repeated answer", of);
    case 4:
      port.board->add_noise();
      return fault(now_ns, "noise", of);
    case 5:
      port.board->cut(now_ns + chance_.magnitude(kMs, 2 * kSecond));
      return fault(now_ns, "cable pulled", of);
    case 6:
      port.board->lose_supply(now_ns + chance_.magnitude(10 * kMs, kSecond));
      return fault(now_ns, "supply missing", of);
    case 7: {
      const auto& motor = config_.motors[chance_.pick(port.motors)];
      const bool connected = chance_.one_in(2);
      port.board->board().motor(motor.output.value).connected = connected;
      return fault(now_ns, connected ? "motor connected" : "motor not connected", of);
    }
    default:
      port.board->board().reset();
      return fault(now_ns, "board reset", of);
  }
}

void BareWorld::disturb_keypad(TimeNs now_ns, Pad& pad) {
  const std::string of = "keypad of " + name(pad.motor);
  switch (chance_.below(3)) {
    case 0:
      pad.box.pull(now_ns + chance_.magnitude(10 * kMs, 3 * kSecond));
      return fault(now_ns, "cable of keypad pulled", of);
    case 1:
      for (auto left = chance_.below(20) + 1; left > 0; --left) {
        pad.box.type(static_cast<std::uint8_t>(chance_.below(256)));
      }
      return fault(now_ns, "noise of keypad", of);
    default:
      if (!pad.plugged) return;
      pad.plugged = false;
      pad.back_ns = now_ns + chance_.magnitude(10 * kMs, 3 * kSecond);
      if (pad.keypad) pad.keypad->port_lost();
      judge_.keys_until(pad.motor, now_ns + pad.config->keepalive_ms * kMs + kAfterFaultNs);
      return fault(now_ns, "port of keypad lost", of);
  }
}

}  // namespace bushfaults
