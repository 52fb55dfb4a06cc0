// The frames with motion among the bytes on their way to MCUs.
#pragma once

#include <cstdint>
#include <span>

#include "engine/frame.h"
#include "engine/message.h"

namespace bushd::test {

// `bytes` are those of the frames; `delimiters` stand before frames that take an idle line.
struct MotionFrames {
  std::int64_t frames = 0;
  std::int64_t bytes = 0;
  std::int64_t delimiters = 0;

  void add(std::span<const std::uint8_t> wire) {
    for (const std::uint8_t byte : wire) {
      const bool idle = byte == 0 && pending_ == 0;
      (idle ? idle_ : pending_) += 1;
      bushd_frame frame;
      const auto status = bushd_receive_byte(&receiver_, byte, &frame);
      if (status == BUSHD_RECEIVE_FRAME && carries_motion(frame)) {
        ++frames;
        bytes += pending_;
        delimiters += idle_;
      }
      if (byte == 0 && !idle) pending_ = idle_ = 0;
    }
  }

 private:
  static bool carries_motion(const bushd_frame& frame) {
    return frame.type == BUSHD_MSG_TICKS || frame.type == BUSHD_MSG_TABLE_TICKS ||
           frame.type == BUSHD_MSG_TABLE_RUN || frame.type == BUSHD_MSG_LINE_RUN;
  }

  bushd_receiver receiver_{};
  std::int64_t pending_ = 0;
  std::int64_t idle_ = 0;
};

}  // namespace bushd::test
