// The image for ATmega2560 alone on a bus.
#pragma once

#include <algorithm>
#include <string>

#include "sim/avr/avr_mcu.h"
#include "sim/mcu_alone.h"

namespace bushd::sim {

class AvrAlone : public McuAlone {
 protected:
  // RAM and flash are tested in 122 ms, and what is kept, up to 2.3 KB, is read.
  static constexpr TimeNs kBootNs = 250'000'000;

  // `boots`: boot number of the boot before.
  explicit AvrAlone(std::uint32_t baud = kBaud, std::uint16_t boots = 6,
                    const std::string& kind = "-")
      : McuAlone(baud, kBootNs) {
    avr_ = add<AvrMcu>(AvrOptions{.image = AVR_IMAGES + kind + std::to_string(baud) + ".elf",
                                  .address = kAddress,
                                  .boots = boots,
                                  .memory_owners = AVR_MEMORY_OWNERS});
  }

  // All motors may run the table in bank 0.
  void make_ready() {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 10'000, {400, 300, 200}, 150));
    ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  }

  // It is polled every `poll_ms` (0: not) until all is done, and answers each time. The last
  // report.
  bushd_report answer_until(TimeNs end_ns, int poll_ms) {
    master_.frames.clear();
    std::size_t polls = 0;
    while (poll_ms != 0 && bus_.now_ns() < end_ns) {
      ++polls;
      master_.post(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, Bytes{1, kAddress, 100, 0, 0, 255});
      pass(poll_ms * TimeNs{1'000'000});
    }
    bus_.advance_to(std::max(end_ns, bus_.now_ns()));
    EXPECT_EQ(master_.frames.size(), polls);
    const bushd_report after = master_.poll(kAddress);
    EXPECT_EQ(after.moving, 0);
    EXPECT_EQ(after.faults, 0);
    EXPECT_EQ(after.bad_frames, 0);
    return after;
  }

  // Between two reports. Each tells a tick that began up to one before, and takes a share of one.
  static void expect_no_late_tick(const bushd_report& before, const bushd_report& after,
                                  TimeNs passed_ns, std::uint32_t tick_ns) {
    EXPECT_NEAR(after.tick - before.tick, static_cast<double>(passed_ns) / tick_ns, 1.5)
        << "late ticks";
  }

  AvrMcu* avr_ = nullptr;
};

// The image for ATmega1284P with a power stage behind its pins.
class Atmega1284pAlone : public McuAlone {
 protected:
  explicit Atmega1284pAlone(const PowerStageRules& rules = {}) : McuAlone(kBaud, 300'000'000) {
    avr_ = add<AvrMcu>(AvrOptions{.image = ATMEGA1284P_IMAGES "-500000.elf",
                                  .address = kAddress,
                                  .memory_owners = ATMEGA1284P_MEMORY_OWNERS,
                                  .chip = "atmega1284p",
                                  .power_stage = rules});
  }

  AvrMcu* avr_ = nullptr;
};

}  // namespace bushd::sim
