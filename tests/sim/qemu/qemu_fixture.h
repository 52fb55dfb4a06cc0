// The image for LM3S6965 alone on a bus.
#pragma once

#include <string>

#include "sim/mcu_alone.h"
#include "sim/qemu/qemu_mcu.h"

namespace bushd::sim {

class QemuAlone : public McuAlone {
 protected:
  static constexpr std::uint16_t kBoots = 41;

  explicit QemuAlone(std::uint32_t baud = kBaud) : QemuAlone(baud, image_path(baud)) {}
  QemuAlone(std::uint32_t baud, const std::string& image, std::uint16_t recorded_boots = 1)
      : McuAlone(baud, 100'000'000) {
    qemu_ = add<QemuMcu>(QemuOptions{.image = image,
                                     .address = kAddress,
                                     .boots = kBoots,
                                     .recorded_boots = recorded_boots,
                                     .memory_owners = LM3S_MEMORY_OWNERS});
  }

  static std::string image_path(std::uint32_t baud) {
    return LM3S_IMAGES "-" + std::to_string(baud) + ".elf";
  }

  QemuMcu* qemu_ = nullptr;
};

}  // namespace bushd::sim
