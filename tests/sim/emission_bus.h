// A bus with one MCU, a way of emission, and rows of steps for its motors.
#pragma once

#include <array>
#include <cstdlib>
#include <vector>

#include "sim/bus_fixture.h"

namespace bushd::sim {

inline constexpr std::uint32_t kEightStepsNs = 16'384'000;  // eight T_step of the document
inline constexpr TimeNs kStepNs = 2'048'000;

inline bushd_emission of_mode(bushd_emission_mode mode, std::uint16_t step_us = 2048) {
  bushd_emission settings{};
  settings.mode = mode;
  settings.step_us = step_us;
  return settings;
}

class EmissionBus {
 public:
  explicit EmissionBus(std::uint32_t tick_ns, const McuOptions& options = {},
                       bushd_format format = BUSHD_FORMAT_COARSE)
      : tick_ns_(tick_ns), format_(format), bus(1'000'000, &recorder), master(bus) {
    bus.add_mcu(options);
    master.bring_up(tick_ns, format);
    master.upload_table(1, 0, 1000, {60'000, 30'000}, 20'000);
  }

  void use(const bushd_emission& settings, int motors) {
    ASSERT_EQ(master.acknowledged(1, settings), BUSHD_OK);
    for (int m = 0; m < motors; ++m) master.assign(1, static_cast<std::uint8_t>(m), 0);
    recorder.edges.clear();
  }

  // One row of steps a tick, a column a motor; they begin together, now, from rest to rest. Fine
  // ticks make the same steps.
  void begin(const std::vector<std::vector<int>>& rows) {
    const std::size_t motors = rows.front().size();
    const bool fine = format_ == BUSHD_FORMAT_FINE;
    const std::uint32_t first_tick = bus.mcu(0).core().tick + 20;
    test::Ticks ticks{
        .flags = static_cast<std::uint8_t>(BUSHD_TICKS_START | (fine ? BUSHD_TICKS_FINE : 0)),
        .first = first_tick,
        .count = static_cast<std::uint8_t>(rows.size()),
        .mask = static_cast<std::uint16_t>((1u << motors) - 1),
        .delays = std::vector<std::uint16_t>(motors, 0)};
    for (const auto& row : rows) {
      for (const int steps : row) ticks.displacements.push_back(test::displacement_of(steps, fine));
    }
    master.post(1, BUSHD_MSG_TICKS, test::ticks_payload(ticks));
    while (bus.mcu(0).core().tick != first_tick) bus.advance_to(bus.next_event_ns());
    start_ns = bus.now_ns();
  }
  void run(const std::vector<std::vector<int>>& rows) {
    begin(rows);
    bus.advance_to(start_ns + static_cast<TimeNs>(rows.size() + 3) * tick_ns_);
    ASSERT_EQ(master.poll(1).moving, 0);
  }

  // Until the MCU has measured its supply current, which moves a motor and takes it back.
  void settle() {
    bus.advance_to(bus.now_ns() + 40 * TimeNs{tick_ns_});
    ASSERT_EQ(master.poll(1).state, BUSHD_STATE_READY);
    recorder.edges.clear();
  }
  TimeNs settle_ns() const { return bus.mcu(0).core().emission.of.settle.of.step.back_ns; }

 private:
  std::uint32_t tick_ns_;
  bushd_format format_;

 public:
  Recorder recorder;
  Bus bus;
  FrameMaster master;
  TimeNs start_ns = 0;  // of the rows
};

}  // namespace bushd::sim
