// The image for LM3S6965 alone on a bus.
#pragma once

#include <memory>
#include <string>

#include "sim/bus_fixture.h"
#include "sim_qemu/qemu_mcu.h"

namespace bushd::sim {

class QemuAlone : public testing::Test {
 protected:
  static constexpr std::uint32_t kBaud = 500'000;
  static constexpr std::uint32_t kTickNs = 2'560'000;
  static constexpr std::uint8_t kAddress = 3;
  static constexpr std::uint16_t kBoots = 41;
  static constexpr TimeNs kBootNs = 100'000'000;

  explicit QemuAlone(std::uint32_t baud = kBaud) : QemuAlone(baud, image_path(baud)) {}
  QemuAlone(std::uint32_t baud, const std::string& image) : bus_(baud, &recorder_), master_(bus_) {
    bus_.add_mcu([this, &image](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
      QemuOptions options;
      options.image = image;
      options.address = kAddress;
      options.boots = kBoots;
      auto mcu = std::make_unique<QemuMcu>(options, index, driver, sink);
      qemu_ = mcu.get();
      return mcu;
    });
    master_.patience_ns = 6'000'000;
  }

  // Some faults of the chip must be there before it boots: those of a constructor are.
  void SetUp() override { pass(kBootNs); }

  static std::string image_path(std::uint32_t baud) {
    return LM3S_IMAGES "-" + std::to_string(baud) + ".elf";
  }

  void pass(TimeNs ns) { bus_.advance_to(bus_.now_ns() + ns); }
  void reboot(TimeNs boot_ns = kBootNs) {
    bus_.reboot(0);
    pass(boot_ns);
  }

  std::size_t steps_made(std::uint8_t motor) const {
    return recorder_.times(0, Signal::kStep, motor, true).size();
  }

  Recorder recorder_;
  Bus bus_;
  Master master_;
  QemuMcu* qemu_ = nullptr;
};

}  // namespace bushd::sim
