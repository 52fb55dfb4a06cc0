// An emergency stop, said until every MCU has obeyed it.
#pragma once

#include <cstdint>
#include <optional>

#include "bus/rs485/frame_writer.h"
#include "bus/rs485/mcu_record.h"
#include "engine/message.h"

namespace bushd::link {

class EmergencyStop {
 public:
  // Both outlive it.
  EmergencyStop(PerMcu<McuRecord>& mcus, FrameWriter& writer) : mcus_(mcus), writer_(writer) {}

  void begin(bushd_stop_mode mode);
  bool active() const { return stop_.has_value(); }

  // Precondition: active().
  std::int64_t due_us() const { return stop_->due_us; }
  // Three frames in a row, as nobody answers; then polls are wanted.
  bool send_due(std::int64_t now_us);

 private:
  struct Stop {
    bushd_stop_mode mode;
    std::int64_t due_us = 0;
    std::optional<std::int64_t> until_us;  // once it has been said
  };

  PerMcu<McuRecord>& mcus_;
  FrameWriter& writer_;
  std::optional<Stop> stop_;
};

}  // namespace bushd::link
