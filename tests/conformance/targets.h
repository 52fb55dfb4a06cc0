// The kinds of MCU that must all do the same. A new port adds one here.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "sim/bus.h"

namespace bushd::sim {

// What an MCU has been given before it boots for the first time in a test.
struct Birth {
  std::uint8_t address;
  std::uint64_t unique_id;
  std::uint16_t boots;  // boot number of the boot before
};

class McuUnderTest {
 public:
  McuUnderTest() = default;
  McuUnderTest(const McuUnderTest&) = delete;
  McuUnderTest& operator=(const McuUnderTest&) = delete;
  virtual ~McuUnderTest() = default;

  // The virtual MCU that it is compared with: as many slots, ticks and codes, and the same
  // capabilities.
  virtual McuOptions twin() const = 0;
  // A tick in which it can make all that a frame may ask for: of all motors, to and fro, up to 127
  // steps.
  virtual std::uint32_t full_tick_ns(bushd_format format) const = 0;

  virtual std::unique_ptr<Mcu> make(const Birth& birth, std::size_t index, Mcu::Driver& driver,
                                    EdgeSink* sink) = 0;
  // Before `make`: what its current sensor reads when a conversion begins.
  std::function<std::uint16_t(TimeNs time_ns)> on_conversion;
  // Tables and settings over resets: what has changed is kept by then.
  virtual TimeNs keeps_within_ns(std::size_t codes) const = 0;
  virtual std::uint64_t nvm_writes() const = 0;  // since it booted for the first time
  virtual void flip_nvm_bit() = 0;               // of a table; from the next boot on

  virtual void hang() = 0;  // until its watchdog bites
  // Its next reset is that of a supply that was off; false: its simulator has none.
  virtual bool power_comes_back_next() { return false; }

  // After a test: what its simulator knows to be wrong.
  virtual void expect_unharmed() const = 0;
};

struct Target {
  std::string name;
  std::function<std::unique_ptr<McuUnderTest>()> make;

  // For gtest: the names of tests must be the same in every run.
  friend void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }
};

// Those whose image and simulator were there at build time.
std::vector<Target> targets();
// Targets that have all of these capabilities (BUSHD_CAN_*), and those that deny one. A
// test that needs a capability belongs to a suite of the former, and so is never skipped.
std::vector<Target> targets_with(std::uint32_t capabilities);
std::vector<Target> targets_without(std::uint32_t capabilities);

// A suite of tests with a parameter, for each of them; for none if no image was there.
#define BUSHD_FOR_TARGETS(suite, those)                         \
  GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(suite);         \
  INSTANTIATE_TEST_SUITE_P(Of, suite, testing::ValuesIn(those), \
                           [](auto& target) { return target.param.name; })

}  // namespace bushd::sim
