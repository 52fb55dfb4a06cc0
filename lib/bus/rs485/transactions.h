// A request and its answers on a line where only one may talk at a time: while answers are awaited
// nothing else is sent.
//
// Only answers that are awaited count: an old one, or one to another master, would be taken for
// them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/rs485/frame_writer.h"
#include "bus/rs485/health.h"
#include "bus/rs485/mcu_index.h"
#include "engine/message.h"

namespace bushd::link {

class Transactions {
 public:
  struct Answer {
    McuIndex mcu;
    std::uint8_t type;  // of the request
    std::span<const std::uint8_t> payload;
    std::int64_t line_us;  // from the request's end to the answer's, if only the line takes time
    bool in_time;          // it did not lie unread while this program slept
  };

  // Who makes the requests. Called from within receive() and expire().
  class Listener {
   public:
    virtual ~Listener() = default;
    // Returns false if the payload makes no sense.
    virtual bool answered(std::int64_t now_us, const Answer& answer) = 0;
    // Returns false if an answer was not expected, as the MCU is only looked for.
    virtual bool unanswered(std::int64_t now_us, McuIndex mcu, std::uint8_t type) = 0;
    // Comes last; not for a transaction that was abandoned.
    virtual void ended(std::int64_t now_us, McuIndex mcu, std::uint8_t type) = 0;
    // A frame that is no answer: another master's, or the echo of an own one.
    virtual void overheard(std::int64_t now_us, const bushd_frame& frame) = 0;
  };

  // Both outlive it.
  Transactions(FrameWriter& writer, Listener& listener) : writer_(writer), listener_(listener) {}

  // The port has been opened: what was received before is no part of a frame.
  void reset();
  // The port is lost: no answer will come.
  void abandon() { open_.reset(); }

  struct Request {
    McuIndex mcu;
    McuAddress address;
    std::uint8_t type;
    std::span<const std::uint8_t> payload;
    std::size_t reply_payload;  // bytes
    // Answers come in one of so many windows, which together last so long. With more than one
    // several MCUs may answer.
    unsigned reply_windows = 1;
    std::int64_t reply_windows_us = 0;
  };
  // Precondition of both: !open().
  void ask(std::int64_t now_us, const Request& request);

  struct ReplyWindow {
    McuIndex mcu;
    McuAddress address;
    std::int64_t end_us;  // of its longest answer, from the request's end
    std::size_t payload;  // bytes of that
  };
  // A broadcast that each of these answers in a window of its own, in this order. An MCU may begin
  // later than its window by up to `late_us`.
  void ask_all(std::int64_t now_us, std::uint8_t type, std::span<const std::uint8_t> payload,
               std::span<const ReplyWindow> windows, std::int64_t late_us);

  void receive(std::int64_t now_us, std::span<const std::uint8_t> bytes);
  // Ends the transaction whose answers are overdue.
  void expire(std::int64_t now_us);
  // Ends it now, as if they were overdue. Precondition: open().
  void give_up(std::int64_t now_us);

  bool open() const { return open_.has_value(); }
  // When the last answer should have passed, and when it is not waited for any more. Precondition:
  // open().
  std::int64_t quiet_us() const { return open_->quiet_us; }
  std::int64_t timeout_us() const { return open_->timeout_us; }
  // When the shortest answer of the last who is asked will have passed: with the others nothing
  // ends. INT64_MIN: one is asked. Precondition: open().
  std::int64_t last_answer_us() const { return open_->last_answer_us; }
  // The bytes of the longest answers to it.
  std::size_t longest_answers() const;

  // How long beyond that an answer is waited for at present.
  std::int64_t patience_us() const { return patience_us_; }

  const BusHealth& health() const { return health_; }
  void count_bytes(std::size_t bytes) { health_.line_bytes += bytes; }

 private:
  struct Awaited {
    McuIndex mcu;
    McuAddress address;
    // When its longest answer ends if nothing but the line takes time, and the payload of that.
    std::int64_t longest_us;
    std::size_t longest;
    bool answered = false;
  };
  struct Open {
    std::uint8_t type;
    std::uint8_t sequence;
    std::vector<Awaited> awaited;
    std::int64_t sent_us;  // when the request has left
    std::int64_t quiet_us;
    std::int64_t timeout_us;
    bool several;  // MCUs may answer in the place of one
    std::int64_t last_answer_us = INT64_MIN;
  };

  struct Expired {
    std::uint8_t type;
    std::uint8_t sequence;
  };

  void handle_frame(std::int64_t now_us, const bushd_frame& frame);
  Awaited* awaited_from(const bushd_frame& frame);
  std::int64_t expected_of(const Awaited& from, std::size_t payload) const;
  void note_latency(std::int64_t now_us, const Awaited& from, std::int64_t expected_us);
  // An answer to what has expired is taken once.
  bool take_if_expired(const bushd_frame& frame);
  void be_more_patient();
  void finish(std::int64_t now_us);

  FrameWriter& writer_;
  Listener& listener_;
  bushd_receiver receiver_{};
  std::optional<Open> open_;
  // The last ones, oldest first: as many as expire within 40 ms if each is awaited for 10 ms.
  std::array<std::optional<Expired>, 4> expired_;
  // How long an answer may be late. All wait meanwhile, so it follows the latencies seen: from 40
  // ms, which any adapter keeps, down to 10 ms on a good one. An opened port begins with the
  // longest: it may belong to another adapter.
  static constexpr std::int64_t kMaxPatienceUs = 40'000;
  static constexpr std::int64_t kMinPatienceUs = 10'000;
  std::int64_t patience_us_ = kMaxPatienceUs;
  BusHealth health_;
};

}  // namespace bushd::link
