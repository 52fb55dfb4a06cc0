// The serial exchange with a commutator board of BUSHD-2 (JINR P10-85-635), without I/O and without
// a clock.
//
//     to the board    0          the motion before is over: a header follows; what is being
//                                counted is dropped
//                     1000 dnnn  header: bits 1..3 number of the motor 0..7, bit 4 direction
//                                (1: left, reverse), bit 8 set, the rest 0
//                     1..255     delay code: the board waits code / (250 F_start), then it steps
//     from the board  status     after each delay code, and the request for the next one:
//                                1 right limit, 2 left limit, 3 supply missing, 4 not connected,
//                                5 step done; 6..8 are 0
//
// The source has the header, a code per step, and the message after each step. Codes have no mark
// that tells them from headers: their order does. The 0 that comes first is ours: a board that
// waits for a code it was never sent (a program was ended, a cable pulled) would take the header
// for one, and 0 is no delay.
//
// A byte that comes before half the time of a code has passed is no answer to it, however it looks:
// an echo of the last one, or noise.
//
// A delay longer than 255 codes is waited here for as long as it is longer; delays that are no
// whole number of codes are rounded up. So no step comes earlier after the one before than it is
// asked for; the line and the program's own pauses come on top.
//
// A board with a converter (firmware/commutator/converter.h) takes K of its DAC in place of delay
// codes (base/converter.h), and makes the step at the next pulse. A delay longer than that of K = 1
// is waited here but for that one. The board says with bit 6, without a step, that no pulse came
// within a second.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/converter.h"

namespace bushd::commutator {

inline constexpr unsigned kMotors = 8;
inline constexpr std::uint32_t kCodesPerStartPeriod = 250;  // so many codes last 1 / F_start
inline constexpr std::uint32_t kMaxCode = 255;
inline constexpr std::int64_t kAnswerUs = 100'000;  // for an answer, beyond twice its delay

struct Status {
  bool right_limit = false;
  bool left_limit = false;
  bool supply_missing = false;
  bool not_connected = false;
  bool step_done = false;
  bool no_pulse = false;  // of a converter
  friend bool operator==(const Status&, const Status&) = default;
};
// None: a bit is set that has no meaning, so the byte is not what a board has sent.
std::optional<Status> status_of(std::uint8_t byte, bool has_converter = false);
std::uint8_t header_of(unsigned motor, bool left);  // motor < kMotors

class Exchange {
 public:
  struct Setup {
    std::uint32_t start_hz = 40;  // F_start of the board, 1..100
    std::uint32_t baud = 9600;    // > 0
    std::int64_t answer_us = kAnswerUs;
    std::optional<Converter> converter{};  // then start_hz means nothing
  };
  explicit Exchange(Setup setup) : setup_(setup) {}

  // The motor named makes a step that many ns from now, or later. Its header goes before it if
  // another motor or direction was selected. Preconditions: free(), motor < kMotors.
  void step(std::int64_t now_us, unsigned motor, bool left, std::uint64_t delay_ns);
  // The next step is the first of a motion: it begins with 0 and its header. A board that was reset
  // since the last one waits for a header, and some codes look like one. Precondition: free().
  void begin_motion() { selected_.reset(); }
  // The board has none of our codes.
  bool free() const { return !asked_; }
  // The step asked for is not made, if its code has not been sent. Else false: it is with the
  // board.
  bool cancel();

  struct Answer {
    Status status;
  };
  // The step asked for may have been made, or not: no answer, or none that can be read.
  struct Lost {
    std::string cause;
  };
  struct Event {
    std::optional<Answer> answer;  // of the step asked for; then free()
    std::optional<Lost> lost;      // of the step asked for; then free()
    bool stray = false;            // a byte that answers nothing
  };
  Event receive(std::int64_t now_us, std::uint8_t byte);
  // Sends what has been held back until now, and notices that an answer is overdue.
  Event advance(std::int64_t now_us);
  std::int64_t next_wake_us() const;  // INT64_MAX: none

  // What is to be sent since the last call.
  std::vector<std::uint8_t> take_bytes();

  // Nothing is known of the board any more: the next step begins with 0 and its header.
  void forget();

  // From the last byte of the answer before to the next one at the least, beyond the delay.
  static std::int64_t line_ns(std::uint32_t baud) {
    return 2 * std::int64_t{kBitsPerByte} * 1'000'000'000 / baud;
  }
  std::uint64_t unit_ns() const {  // of a delay code, rounded up: none is shorter than this
    const std::uint64_t codes = std::uint64_t{kCodesPerStartPeriod} * setup_.start_hz;
    return (1'000'000'000 + codes - 1) / codes;
  }
  // What a board can do, whatever its codes are. Nothing of a code is left after the longest time.
  std::uint64_t most_steps_per_s() const {
    return setup_.converter ? setup_.converter->max_hz
                            : std::uint64_t{kCodesPerStartPeriod} * setup_.start_hz;
  }
  std::int64_t longest_us() const;

 private:
  static constexpr int kBitsPerByte = 10;  // 8N1

  struct Code {
    std::uint8_t code;
    std::int64_t held_us;  // before it is sent
  };
  Code code_of(std::uint64_t delay_ns) const;
  // From when on an answer to this code can be one, and when there must be one; after it was sent,
  // without the line.
  std::int64_t earliest_us(std::uint8_t code) const;
  std::int64_t latest_us(std::uint8_t code) const;
  std::int64_t delay_us(std::uint8_t code) const;

  struct Asked {
    std::uint8_t header;
    std::uint8_t code;
    std::int64_t send_us;
    std::int64_t not_before_us = 0;             // the answer
    std::optional<std::int64_t> deadline_us{};  // sent
  };
  void send(std::int64_t now_us);

  const Setup setup_;
  std::optional<std::uint8_t> selected_;  // header
  std::optional<Asked> asked_;
  std::vector<std::uint8_t> out_;
};

}  // namespace bushd::commutator
