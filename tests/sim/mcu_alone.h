// One MCU alone on a bus. Who derives from it adds it.
#pragma once

#include <memory>

#include "sim/bus_fixture.h"

namespace bushd::sim {

class McuAlone : public testing::Test {
 protected:
  static constexpr std::uint32_t kBaud = 500'000;
  static constexpr std::uint32_t kTickNs = 2'560'000;
  static constexpr std::uint8_t kAddress = 2;

  McuAlone(std::uint32_t baud, TimeNs boot_ns)
      : boot_ns_(boot_ns), bus_(baud, &recorder_), master_(bus_) {
    master_.patience_ns = 6'000'000;
  }
  // Some faults of the chip must be there before it boots: those of a constructor are.
  void SetUp() override { pass(boot_ns_); }

  template <class Kind, class Options>
  Kind* add(const Options& options) {
    Kind* added = nullptr;
    bus_.add_mcu([&](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
      auto mcu = std::make_unique<Kind>(options, index, driver, sink);
      added = mcu.get();
      return mcu;
    });
    return added;
  }

  void pass(TimeNs ns) { bus_.advance_to(bus_.now_ns() + ns); }
  void reboot(TimeNs boot_ns) {
    bus_.reboot(0);
    pass(boot_ns);
  }
  void reboot() { reboot(boot_ns_); }

  void emit_phases(bushd_phase_sequence sequence) {
    bushd_emission emission{};
    emission.mode = BUSHD_EMISSION_PHASES;
    emission.sequence = sequence;
    emission.hold_current = true;
    ASSERT_EQ(master_.acknowledged(kAddress, emission), BUSHD_OK);
  }

  // By the table in bank 0.
  void run(std::uint8_t motor, std::uint32_t steps) {
    const bushd_table_run_entry entry{motor, 0, 1, steps, 0};
    master_.send(kAddress, BUSHD_MSG_TABLE_RUN,
                 test::table_run_payload(0, master_.poll(kAddress).tick + 24, entry));
  }

  std::size_t steps_made(std::uint8_t motor) const {
    return recorder_.times(0, Signal::kStep, motor, true).size();
  }

  const TimeNs boot_ns_;
  Recorder recorder_;
  Bus bus_;
  FrameMaster master_;
};

}  // namespace bushd::sim
