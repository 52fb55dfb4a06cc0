// A bus with slaves that are not the firmware: they keep to docs/protocol.md as far as a test lets
// them, and remember all that they were sent. Time is simulated; bytes take theirs.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "bus/rs485/master.h"

namespace bushd::test {

using link::McuIndex;

using Bytes = std::vector<std::uint8_t>;

struct Heard {
  std::int64_t at_us;  // end of the frame
  std::uint8_t address;
  std::uint8_t type;
  Bytes payload;
};

struct Slave {
  bushd_identity identity{.protocol_version = BUSHD_PROTOCOL_VERSION,
                          .motors = 16,
                          .firmware_version = 1,
                          .boot_number = 500,
                          .slots = 256,
                          .queue_ticks = 256,
                          .table_codes = 4000,
                          .capabilities = BUSHD_CAN_COARSE | BUSHD_CAN_FINE |
                                          BUSHD_CAN_TABLE_TICKS | BUSHD_CAN_TABLE_RUN,
                          .unique_id = {}};
  std::uint8_t address = 1;
  bool answers = true;
  std::map<std::uint8_t, std::uint8_t> refusals;  // request type -> status
  // Frames for which this returns true are lost on the way here.
  std::function<bool(const Heard&)> loses = [](const Heard&) { return false; };

  // Lies in its reports.
  std::function<void(bushd_report&)> spoils = [](bushd_report&) {};

  // What it knows.
  std::uint8_t flags = 0;
  std::uint8_t epoch = 0;
  std::uint8_t faults = 0;
  std::int64_t zero_us = -1'000'000;  // when its tick 0 began
  std::uint32_t sync_id = 0;          // of the last SYNC heard, and when that was
  std::int64_t sync_us = 0;
  std::map<std::uint8_t, std::vector<std::uint16_t>> tables;
  std::map<std::uint8_t, bushd_table_held> held;
  std::array<int, BUSHD_MOTORS_PER_MCU> table_of{};
  std::array<std::uint32_t, BUSHD_MOTORS_PER_MCU> known_until{};
  std::array<std::uint16_t, BUSHD_MOTORS_PER_MCU> delay{};
  struct OutOfOrderRange {
    std::uint32_t from;
    std::uint32_t until;
    std::uint16_t delay;
  };
  std::array<std::optional<OutOfOrderRange>, BUSHD_MOTORS_PER_MCU> out_of_order;
  std::array<std::optional<bushd_table_run_entry>, BUSHD_MOTORS_PER_MCU> run;  // taken
  std::array<std::int32_t, BUSHD_MOTORS_PER_MCU> position{};
  // Everything it took, by motor and tick.
  std::array<std::map<std::uint32_t, std::int16_t>, BUSHD_MOTORS_PER_MCU> taken;
  // What has come of its program, and what it tells of it.
  Bytes program;
  bushd_program_state program_state{.stage = BUSHD_PROGRAM_NONE,
                                    .reason = BUSHD_PROGRAM_NO_REASON,
                                    .number = 0,
                                    .flags = 0,
                                    .motors = 0,
                                    .memory = 8192,
                                    .size = 0,
                                    .crc = 0,
                                    .frame = 0,
                                    .point = 0,
                                    .repeats = 0,
                                    .start_tick = 0,
                                    .tick = 0};
  bool runs_program() const {
    return program_state.stage >= BUSHD_PROGRAM_WAITS && program_state.stage <= BUSHD_PROGRAM_ENDS;
  }
  std::uint16_t rejected = 0;
  // The last report. One that has it gets what is new.
  bushd_report told{};
  std::uint16_t low_water = UINT16_MAX;
};

// One step a tick and motor for ever, unless a test says otherwise; notes what it was asked.
class FakeSource : public link::TickSource {
 public:
  std::function<std::int16_t(std::uint8_t motor, link::Tick tick)> displacement =
      [](std::uint8_t motor, link::Tick tick) {
        return static_cast<std::int16_t>((tick * 7 + motor) % 1000);
      };
  // The delay of the step running at the end of `tick - 1`.
  std::function<std::uint16_t(std::uint8_t motor, link::Tick tick)> delay =
      [](std::uint8_t, link::Tick tick) { return static_cast<std::uint16_t>(100 + tick % 100); };

  std::uint16_t render(McuIndex, std::uint8_t motor, link::Tick first, unsigned count,
                       std::int16_t* out, std::size_t stride) override {
    for (unsigned i = 0; i < count; ++i) out[i * stride] = displacement(motor, first + i);
    return delay(motor, first + count);
  }

  // None: what the displacements are follows no table.
  std::function<std::optional<RunSegment>(std::uint8_t motor, link::Tick first, unsigned max_ticks)>
      segment = [](std::uint8_t, link::Tick, unsigned) { return std::nullopt; };
  std::function<link::Tick(std::uint8_t motor)> end = [](std::uint8_t) { return INT64_MAX; };

  std::optional<RunSegment> run_at(McuIndex, std::uint8_t motor, link::Tick first,
                                   unsigned max_ticks) override {
    return segment(motor, first, max_ticks);
  }
  link::Tick end_tick(McuIndex, std::uint8_t motor) override { return end(motor); }
};

class FakeBus {
 public:
  static constexpr std::uint32_t kBaud = 500'000;
  static constexpr std::uint32_t kTickNs = 2'560'000;

  // Slaves get the addresses 1, 2, ...; all outputs of `motors` have table 0.
  explicit FakeBus(int slaves = 1, int motors = 4, bushd_format format = BUSHD_FORMAT_FINE,
                   std::uint32_t tick_ns = kTickNs, std::uint32_t baud = kBaud);

  void run_for(std::int64_t us);
  bool run_until(const std::function<bool()>& done, std::int64_t limit_us = 20'000'000);
  void connect();
  bool online(std::size_t mcu = 0) const {
    return master->view(McuIndex{mcu}).phase == link::McuPhase::kOnline;
  }
  template <class Event>
  int count() const {
    return static_cast<int>(std::count_if(events.begin(), events.end(), [](const auto& event) {
      return std::holds_alternative<Event>(event);
    }));
  }
  template <class Event>
  std::optional<Event> last() const {
    const auto found = std::find_if(events.rbegin(), events.rend(), [](const auto& event) {
      return std::holds_alternative<Event>(event);
    });
    return found == events.rend() ? std::nullopt : std::optional(std::get<Event>(*found));
  }
  link::Tick earliest_replace(std::uint16_t motors = 0b1111, std::size_t mcu = 0) const {
    const link::ToReplace one = {.mcu = McuIndex{mcu}, .motors = motors};
    return master->earliest_replace(now_us, {&one, 1});
  }
  std::uint32_t tick(std::size_t slave) const { return tick_of(slaves[slave]); }
  std::uint32_t tick_of(const Slave& slave) const;
  std::vector<Heard> heard_of(std::uint8_t type) const;

  std::int64_t now_us = 1'000'000;
  std::int64_t turnaround_us = 100;
  std::int64_t adapter_latency_us = 0;  // of answers
  std::vector<Slave> slaves;
  FakeSource source;
  std::vector<std::uint16_t> codes;
  bushd_table table{};
  link::BusSetup setup;
  std::unique_ptr<link::Rs485Master> master;
  std::vector<Heard> heard;  // every frame of the master
  std::vector<link::Event> events;
  int reads = 0;  // of what slaves have sent, as a program that waits for it
  std::int64_t master_bytes = 0;
  std::int64_t slave_bytes = 0;

 private:
  void advance(std::int64_t limit_us);
  void read();
  // When the program comes to read; INT64_MAX: nothing is on its way.
  std::int64_t read_due_us() const;
  std::int64_t line_us(std::size_t bytes) const;
  void hear(const Heard& frame, std::uint8_t sequence);
  void act(Slave& slave, const Heard& frame, std::uint8_t sequence);
  // A frame of ticks, however it was coded: by motor, the displacements and the delay at the end.
  struct Ticks {
    std::uint8_t epoch;
    std::uint8_t flags;
    std::uint32_t first_tick;
    std::uint32_t count;
    std::map<unsigned, std::pair<std::vector<std::int16_t>, std::uint16_t>> of_motor;
  };
  static Ticks read_ticks(const Heard& frame);
  Ticks read_table_ticks(const Heard& frame) const;
  void take_ticks(Slave& slave, const Ticks& ticks);
  void take_motor_ticks(Slave& slave, unsigned motor, const Ticks& ticks) const;
  void take_table_run(Slave& slave, const Heard& frame);
  static std::uint8_t put_program(Slave& slave, const Heard& frame);
  static std::uint8_t control_program(Slave& slave, const Heard& frame);
  // `delay_us` after the request's end.
  void answer(const Slave& slave, const Heard& frame, std::uint8_t sequence, const Bytes& payload,
              std::int64_t delay_us = 0);
  void follow_time(Slave& slave);
  Bytes report(Slave& slave, const bushd_poll_entry& entry);

  bushd_receiver receiver_{};
  std::multimap<std::int64_t, std::pair<Heard, std::uint8_t>> frames_;
  std::multimap<std::int64_t, Bytes> arrivals_;
  std::int64_t line_free_us_ = 0;
};

}  // namespace bushd::test
