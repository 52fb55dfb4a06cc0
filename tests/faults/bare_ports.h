// The ports of controllers without firmware, and what is behind them, with their faults.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "bus/rs485/pulse_port.h"
#include "config/config.h"
#include "sim/board_line.h"
#include "sim/pulse_drive.h"
#include "sim/random.h"

namespace bushfaults {

// A serial port whose bytes are pulses. What is written waits in the driver, which tells how much
// it has; from there it goes into the hardware, which does not tell, and onto the line. Which
// hardware it is, the seed decides:
//
//     kUart         sixteen bytes, without pauses; tells when it is empty
//     kAdapter      15 ms of bytes, or one that is just sent, and it pauses between packets; tells
//                   when it is empty
//     kMuteAdapter  the same, and does not tell. lib/heritage/serial_pulse takes such an adapter
//                   to be late by no more than 20 ms, and so it is here
//
// A stalled driver passes nothing on for a while; what the hardware has leaves.
class PulsePort {
 public:
  using TimeNs = bushd::sim::TimeNs;
  enum class Hardware { kUart, kAdapter, kMuteAdapter };

  PulsePort(std::uint64_t seed, std::uint32_t stream, bushd::sim::EdgeSink& edges,
            std::size_t index);

  bushd::sim::PulseDrive drive;

  bushd::link::PulseStatus carry_out(TimeNs now_ns, const bushd::link::PulseOrder& order);
  void advance_to(TimeNs now_ns);
  void stall(TimeNs until_ns) { stalled_until_ns_ = std::max(stalled_until_ns_, until_ns); }
  TimeNs stalled_until_ns() const { return stalled_until_ns_; }
  // What has not left is lost.
  void break_off(TimeNs now_ns);

  // Steps that may still come of bytes that the driver does not tell of.
  std::uint32_t steps_unseen() const {
    return 5 * static_cast<std::uint32_t>(unseen_.size() + drive.queued());
  }
  bool idle() const { return driver_.empty() && unseen_.empty() && drive.queued() == 0; }
  // Changes of the rate or the direction while bytes were under way, wherever they were.
  std::uint64_t changed_amid_bytes() const { return changed_amid_bytes_; }
  Hardware hardware() const { return hardware_; }

 private:
  std::size_t room() const;
  TimeNs passes_from_ns() const;
  std::uint32_t made_of(std::uint32_t ask) const;

  bushd::sim::Random random_;
  Hardware hardware_;
  bool any_rate_;
  std::uint32_t base_;
  TimeNs at_ns_ = 0;
  TimeNs stalled_until_ns_ = 0;
  TimeNs pause_until_ns_ = 0;
  TimeNs next_pause_ns_ = 0;
  std::uint64_t changed_amid_bytes_ = 0;
  std::deque<std::uint8_t> driver_;
  std::deque<std::uint8_t> unseen_;
};

// A commutator board at its line. Not injected, because the line has no checksum and nobody could
// notice it: bytes to the board that are changed or lost one by one, and an answer that is changed
// into another good one.
class BoardPort {
 public:
  using TimeNs = bushd::sim::TimeNs;

  BoardPort(const bushd::config::Bus& bus, std::uint64_t seed, std::uint32_t stream,
            bushd::sim::EdgeSink& edges, std::size_t index);

  bushd::sim::CommutatorBoard& board() { return line_.board; }
  void send(TimeNs now_ns, std::span<const std::uint8_t> bytes);
  void advance_to(TimeNs now_ns);
  // What has come to the computer since.
  std::vector<std::uint8_t> take_received(TimeNs now_ns);
  bool received(TimeNs now_ns) const { return !on_way_.empty() && on_way_.front().at_ns <= now_ns; }
  // Nobody is there to receive.
  void forget_received() { on_way_.clear(); }

  enum class AnswerFault { kLost, kLate, kGarbled, kRepeated };
  void spoil_next_answer(AnswerFault fault) { spoil_ = fault; }
  // As soon as nobody could take it for the answer to a code: while none is with the board, or it
  // has hardly begun.
  void add_noise() { noise_ = true; }
  // Until then nothing passes, in either direction.
  void cut(TimeNs until_ns) { cut_until_ns_ = std::max(cut_until_ns_, until_ns); }
  void lose_supply(TimeNs until_ns) {
    no_supply_until_ns_ = std::max(no_supply_until_ns_, until_ns);
  }
  TimeNs faults_over_ns() const { return std::max(cut_until_ns_, no_supply_until_ns_); }
  // Something may end a motion of the board now.
  bool disturbed(TimeNs now_ns) const { return spoil_ || noise_ || now_ns < faults_over_ns(); }
  // None of them any more.
  void end_faults() {
    spoil_.reset();
    noise_ = false;
  }

 private:
  struct OnWay {
    TimeNs at_ns;
    std::uint8_t byte;
  };
  void arrive(TimeNs at_ns, std::uint8_t byte);
  void make_noise(TimeNs now_ns);

  bushd::sim::BoardLine line_;
  bushd::sim::Random random_;
  std::deque<OnWay> on_way_;
  std::optional<AnswerFault> spoil_;
  bool noise_ = false;
  TimeNs sent_ns_ = 0;  // the last bytes to the board
  TimeNs cut_until_ns_ = 0;
  TimeNs no_supply_until_ns_ = 0;
};

// The box with keys.
class KeypadBox {
 public:
  using TimeNs = bushd::sim::TimeNs;
  explicit KeypadBox(bool latched) : latched_(latched) {}

  static constexpr std::uint8_t kForward = 0x00;
  static constexpr std::uint8_t kReverse = 0xFF;
  static constexpr std::uint8_t kSlower = 0xFE;
  static constexpr std::uint8_t kStop = 0xFD;

  void press(TimeNs now_ns, bool forward, TimeNs for_ns);
  void let_go(TimeNs now_ns);
  void type(std::uint8_t byte) { bytes_.push_back(byte); }
  // The cable is pulled until then; what is typed is lost.
  void pull(TimeNs until_ns) { pulled_until_ns_ = std::max(pulled_until_ns_, until_ns); }
  TimeNs pulled_until_ns() const { return pulled_until_ns_; }

  void advance_to(TimeNs now_ns);
  std::vector<std::uint8_t> take_bytes();
  bool has_bytes() const { return !bytes_.empty(); }

 private:
  const bool latched_;
  std::optional<std::uint8_t> key_;
  TimeNs until_ns_ = 0;
  TimeNs next_ns_ = 0;
  TimeNs pulled_until_ns_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace bushfaults
