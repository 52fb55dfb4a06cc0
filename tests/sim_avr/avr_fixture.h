// The image for ATmega2560 alone on a bus.
#pragma once

#include <string>

#include "sim/mcu_alone.h"
#include "sim_avr/avr_mcu.h"

namespace bushd::sim {

class AvrAlone : public McuAlone {
 protected:
  static constexpr TimeNs kBootNs = 200'000'000;

  // `boots`: boot number of the boot before.
  explicit AvrAlone(std::uint32_t baud = kBaud, std::uint16_t boots = 6) : McuAlone(baud, kBootNs) {
    AvrOptions options;
    options.image = AVR_IMAGES "-" + std::to_string(baud) + ".elf";
    options.address = kAddress;
    options.memory_owners = AVR_MEMORY_OWNERS;
    options.boots = boots;
    avr_ = add<AvrMcu>(options);
  }

  // All motors may run the table in slot 0.
  void make_ready() {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 10'000, {400, 300, 200}, 150));
    ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  }

  AvrMcu* avr_ = nullptr;
};

}  // namespace bushd::sim
