// The image for ATmega2560 alone on a bus.
#pragma once

#include <memory>
#include <string>

#include "sim/bus_fixture.h"
#include "sim_avr/avr_mcu.h"

namespace bushd::sim {

class AvrAlone : public testing::Test {
 protected:
  static constexpr std::uint32_t kBaud = 500'000;
  static constexpr std::uint32_t kTickNs = 2'560'000;
  static constexpr std::uint8_t kAddress = 2;
  static constexpr TimeNs kBootNs = 200'000'000;

  // `boots`: boot number of the boot before.
  explicit AvrAlone(std::uint32_t baud = kBaud, std::uint16_t boots = 6)
      : bus_(baud, &recorder_), master_(bus_) {
    bus_.add_mcu([this, baud, boots](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
      AvrOptions options;
      options.image = AVR_IMAGES "-" + std::to_string(baud) + ".elf";
      options.address = kAddress;
      options.boots = boots;
      auto mcu = std::make_unique<AvrMcu>(options, index, driver, sink);
      avr_ = mcu.get();
      return mcu;
    });
    master_.patience_ns = 6'000'000;
  }

  void pass(TimeNs ns) { bus_.advance_to(bus_.now_ns() + ns); }
  void reboot() {
    bus_.reboot(0);
    pass(kBootNs);
  }

  // All motors may run the table in slot 0.
  void make_ready() {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 10'000, {400, 300, 200}, 150));
    ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  }

  void run(std::uint8_t motor, std::uint32_t steps) {
    const bushd_table_run_entry entry{motor, 0, 1, steps};
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(
        bushd_encode_table_run(0, master_.poll(kAddress).tick + 24, &entry, 1, payload.data()));
    master_.send(kAddress, BUSHD_MSG_TABLE_RUN, payload);
  }

  std::size_t steps_made(std::uint8_t motor) const {
    return recorder_.times(0, Signal::kStep, motor, true).size();
  }

  Recorder recorder_;
  Bus bus_;
  Master master_;
  AvrMcu* avr_ = nullptr;
};

}  // namespace bushd::sim
