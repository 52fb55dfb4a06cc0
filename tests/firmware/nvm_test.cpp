// What an MCU keeps over resets, as ports walk over it: a little at a time, while masters go on
// changing it.
#include <array>
#include <functional>

#include "firmware/rig.h"

namespace bushd::test {
namespace {

constexpr std::uint16_t kCodes = 60;

struct Walk {
  std::vector<std::pair<const std::uint8_t*, std::size_t>> parts;
  std::size_t bytes = 0;
  bool ended = false;
};

class Nvm : public testing::Test {
 protected:
  Nvm() {
    EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE), BUSHD_OK);
    rig.sync_to(1000);
    EXPECT_EQ(rig.upload(0, ramp_law()), BUSHD_OK);
  }

  std::size_t most() const { return BUSHD_MCU_NVM_MAX_BYTES(kCodes); }

  // `meanwhile` comes after this many bytes.
  Walk walk(std::uint16_t most_at_once, std::size_t after, const std::function<void()>& meanwhile) {
    Walk found;
    bushd_mcu_nvm_scan pass{};
    bushd_mcu_nvm_begin_scan(&pass);
    bool done = false;
    while (found.bytes <= most()) {
      if (!done && found.bytes >= after) {
        meanwhile();
        done = true;
      }
      const bushd_mcu_nvm_region part =
          bushd_mcu_nvm_scan_next(rig.mutable_mcu(), &pass, most_at_once);
      if (part.at == nullptr) {
        found.ended = true;
        break;
      }
      found.bytes += part.size;
      found.parts.emplace_back(static_cast<const std::uint8_t*>(part.at), part.size);
    }
    return found;
  }

  // Nothing but the MCU's own memory: its struct and its table codes.
  void expect_own(const Walk& found) const {
    const auto within = [](const auto& part, const void* from, std::size_t size) {
      const auto* const begin = static_cast<const std::uint8_t*>(from);
      return part.first >= begin && part.first + part.second <= begin + size;
    };
    for (const auto& part : found.parts) {
      EXPECT_TRUE(within(part, &rig.mcu(), sizeof(bushd_mcu)) ||
                  within(part, rig.mcu().config.codes, kCodes * sizeof(std::uint16_t)) ||
                  within(part, rig.mcu().config.currents,
                         rig.options().current_motors * sizeof(bushd_mcu_currents)) ||
                  within(part, rig.mcu().config.velocity,
                         rig.options().velocity_motors * sizeof(bushd_mcu_velocity)));
    }
  }

  Rig rig{RigOptions{.code_count = kCodes}};
};

TEST_F(Nvm, AWalkGoesOverAllOfIt) {
  const Walk found = walk(7, 0, [] {});
  EXPECT_TRUE(found.ended);
  expect_own(found);
  const std::size_t used = rig.mcu().tables.codes_used;
  ASSERT_GT(used, 0u);
  EXPECT_EQ(found.bytes,
            most() - 2 * (kCodes - used) - (BUSHD_MOTORS_PER_MCU - rig.options().motors) -
                (BUSHD_MAX_CURRENT_MOTORS - rig.options().current_motors) * sizeof(bushd_currents) -
                (BUSHD_MAX_VELOCITY_MOTORS - rig.options().velocity_motors) *
                    sizeof(bushd_mcu_velocity_settings));
}

// A walk that stood behind the last code went on through all memory, and the ports wrote it down.
TEST_F(Nvm, AWalkEndsWhenTablesAreForgottenMeanwhile) {
  for (const std::uint16_t at_once : std::array<std::uint16_t, 3>{1, 3, 16}) {
    for (std::size_t after = 0; after <= most(); ++after) {
      SCOPED_TRACE(std::to_string(at_once) + " bytes at once, forgotten after " +
                   std::to_string(after));
      const Walk found = walk(
          at_once, after, [&] { EXPECT_EQ(rig.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_OK); });
      ASSERT_TRUE(found.ended);
      ASSERT_NO_FATAL_FAILURE(expect_own(found));
      ASSERT_EQ(rig.upload(0, ramp_law()), BUSHD_OK);
    }
  }
}

TEST_F(Nvm, AWalkEndsWhenATableGivesItsCodesBackMeanwhile) {
  Law longer = ramp_law();
  Law shorter = longer;
  shorter.accel.resize(1);
  shorter.decel.resize(1);
  for (std::size_t after = 0; after <= most(); ++after) {
    SCOPED_TRACE("begun anew after " + std::to_string(after));
    const Walk found = walk(1, after, [&] { EXPECT_EQ(rig.begin(0, shorter), BUSHD_OK); });
    ASSERT_TRUE(found.ended);
    ASSERT_NO_FATAL_FAILURE(expect_own(found));
    ASSERT_EQ(rig.upload(0, longer), BUSHD_OK);
  }
}

}  // namespace
}  // namespace bushd::test
