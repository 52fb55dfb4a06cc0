#include "conformance/targets.h"

#include <gtest/gtest.h>

#include <vector>

#ifdef AVR_IMAGES
#include "sim/avr/avr_mcu.h"
#endif
#ifdef LM3S_IMAGES
#include "sim/qemu/qemu_mcu.h"
#endif

namespace bushd::sim {
namespace {

template <class Image, class Options>
class ImageUnderTest : public McuUnderTest {
 public:
  explicit ImageUnderTest(Options options) : options_(std::move(options)) {}
  std::unique_ptr<Mcu> make(const Birth& birth, std::size_t index, Mcu::Driver& driver,
                            EdgeSink* sink) override {
    options_.address = birth.address;
    options_.unique_id = birth.unique_id;
    options_.boots = birth.boots;
    auto mcu = std::make_unique<Image>(options_, index, driver, sink);
    mcu->on_conversion = on_conversion;
    mcu_ = mcu.get();
    return mcu;
  }
  void expect_unharmed() const override {
    EXPECT_EQ(mcu_->overruns(), 0u);
    EXPECT_EQ(mcu_->bytes_cut(), 0u);
  }

 protected:
  Image* mcu_ = nullptr;

 private:
  Options options_;
};

#ifdef AVR_IMAGES
class Avr : public ImageUnderTest<AvrMcu, AvrOptions> {
 public:
  using ImageUnderTest::ImageUnderTest;
  std::uint32_t full_tick_ns(bushd_format format) const override {
    return format == BUSHD_FORMAT_FINE ? 4'000'000 : 2'560'000;
  }
  TimeNs keeps_within_ns(std::size_t codes) const override {
    return 3'000'000'000 + static_cast<TimeNs>(codes) * 10'000'000;
  }
  std::uint64_t nvm_writes() const override { return mcu_->eeprom_writes(); }
  void hang() override { mcu_->hang(); }
  void flip_nvm_bit() override { mcu_->flip_eeprom_bit(43 + 30, 2); }  // nvm.h
  void expect_unharmed() const override {
    ImageUnderTest::expect_unharmed();
    EXPECT_GE(mcu_->untouched_ram(), AvrMemoryWatch::kReserve);
    testing::Test::RecordProperty("untouched_ram_bytes", static_cast<int>(mcu_->untouched_ram()));
  }
};

class Atmega2560 final : public Avr {
 public:
  Atmega2560() : Avr({.image = AVR_IMAGES "-500000.elf", .memory_owners = AVR_MEMORY_OWNERS}) {}
  McuOptions twin() const override {
    return {.slots = 128,
            .queue_ticks = 64,
            .code_count = 952,
            .disabled_capabilities = BUSHD_CAN_TABLE_TICKS | BUSHD_CAN_CURRENTS |
                                     BUSHD_CAN_VELOCITY | BUSHD_CAN_SCRATCH | BUSHD_CAN_SLOW_RUNS |
                                     BUSHD_CAN_PROGRAM | BUSHD_CAN_ELEMENTARY};
  }
};

class Atmega1284p final : public Avr {
 public:
  Atmega1284p()
      : Avr({.image = ATMEGA1284P_IMAGES "-500000.elf",
             .memory_owners = ATMEGA1284P_MEMORY_OWNERS,
             .chip = "atmega1284p"}) {}
  McuOptions twin() const override {
    return {.motors = 8,
            .slots = 128,
            .queue_ticks = 64,
            .code_count = 1536,
            .disabled_capabilities = BUSHD_CAN_TABLE_TICKS | BUSHD_CAN_LINE_RUN |
                                     BUSHD_CAN_COMMON_DIR | BUSHD_CAN_KEYPAD | BUSHD_CAN_SCRATCH |
                                     BUSHD_CAN_SLOW_RUNS | BUSHD_CAN_PROGRAM | BUSHD_CAN_ELEMENTARY,
            .current_motors = 1,
            .velocity_motors = 2};
  }
};
#endif

#ifdef LM3S_IMAGES
class Lm3s6965 final : public ImageUnderTest<QemuMcu, QemuOptions> {
 public:
  Lm3s6965()
      : ImageUnderTest({.image = LM3S_IMAGES "-500000.elf", .memory_owners = LM3S_MEMORY_OWNERS}) {}
  McuOptions twin() const override {
    return {.slots = 128,
            .queue_ticks = 512,
            .code_count = 12288,
            .program_bytes = 4096,
            .disabled_capabilities = BUSHD_CAN_CURRENTS | BUSHD_CAN_VELOCITY | BUSHD_CAN_KEYPAD};
  }
  std::uint32_t full_tick_ns(bushd_format) const override { return 2'560'000; }
  TimeNs keeps_within_ns(std::size_t) const override { return 2'000'000'000; }
  std::uint64_t nvm_writes() const override { return mcu_->flash_writes(); }
  void hang() override { mcu_->stop_ticks(); }
  bool power_comes_back_next() override {
    mcu_->power_comes_back_next();
    return true;
  }
  void flip_nvm_bit() override { mcu_->flip_flash_bit(0x27800 + 20 + 32, 2); }  // nvm.h
};
#endif

template <class Kind>
Target target(const char* name) {
  return {name, [] { return std::make_unique<Kind>(); }};
}

std::vector<Target> those_that_deny(std::uint32_t capabilities, bool deny) {
  std::vector<Target> those = targets();
  std::erase_if(those, [=](const Target& target) {
    return ((target.make()->twin().disabled_capabilities & capabilities) != 0) != deny;
  });
  return those;
}

}  // namespace

std::vector<Target> targets() {
  return {
#ifdef AVR_IMAGES
      target<Atmega2560>("Atmega2560"),
      target<Atmega1284p>("Atmega1284p"),
#endif
#ifdef LM3S_IMAGES
      target<Lm3s6965>("Lm3s6965"),
#endif
  };
}

std::vector<Target> targets_with(std::uint32_t capabilities) {
  return those_that_deny(capabilities, false);
}

std::vector<Target> targets_without(std::uint32_t capabilities) {
  return those_that_deny(capabilities, true);
}

}  // namespace bushd::sim
