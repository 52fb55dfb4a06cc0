#include "bus/emission_setup.h"

#include <algorithm>

#include "engine/slots.h"
#include "engine/velocity.h"

namespace bushd::fieldbus {
namespace {

constexpr std::array<std::uint16_t, 6> kCapabilities = {0,
                                                        BUSHD_CAN_BURST,
                                                        BUSHD_CAN_COMMON_DIR,
                                                        BUSHD_CAN_STAGGERED,
                                                        BUSHD_CAN_PHASES,
                                                        BUSHD_CAN_COMMON_DIR | BUSHD_CAN_STAGGERED};
// By bushd_emission_mode, which of kStepsNames.
constexpr std::array<std::uint8_t, 6> kStepsOf = {0, 1, 1, 2, 3, 2};

std::string at(Error place, std::string message) {
  place.message = std::move(message);
  return place.text();
}

std::string us_of_ns(std::uint32_t ns) {
  return std::to_string(ns / 1000) + "." + std::to_string(ns / 100 % 10) + " us";
}

}  // namespace

std::string emission_keys(std::uint8_t mode) {
  std::string keys = "steps = \"" + std::string(kStepsNames.at(kStepsOf.at(mode))) + "\"";
  if (bushd_emission_has_common_dir(mode)) keys += " with direction = \"common\"";
  return keys;
}

const char* remedy_of(unsigned refusal) {
  return refusal == BUSHD_E_STATE
             ? "a motor of it moves, by its local inputs perhaps; it is asked again"
             : "its firmware and this program do not fit each other: update the older of the two";
}

Result<unsigned> max_steps_per_tick(const EmissionSetup& setup, const bushd_identity& identity,
                                    std::uint32_t tick_ns) {
  const auto can = [&](std::uint8_t mode) {
    return (kCapabilities.at(mode) & ~identity.capabilities) == 0;
  };
  if (!can(setup.settings.mode)) {
    std::string allowed;
    for (std::uint8_t mode = 0; mode < kEmissionNames.size(); ++mode) {
      if (!can(mode)) continue;
      allowed.append(allowed.empty() ? "" : "; ").append(emission_keys(mode));
    }
    return fail(at(setup.mode_at, "asks for " + emission_keys(setup.settings.mode) +
                                      ", which this MCU cannot do; allowed: " + allowed));
  }
  if (identity.slots < BUSHD_MIN_SLOTS) {
    return fail("says that it has " + std::to_string(identity.slots) +
                " slots a tick; needed are " + std::to_string(BUSHD_MIN_SLOTS) +
                ": update its firmware");
  }
  bushd_emission_grid grid;
  const bushd_status status = bushd_emission_fit(&setup.settings, tick_ns, identity.slots, &grid);
  if (status != BUSHD_OK) return fail(emission_refusal(setup, status, identity.slots, tick_ns));
  return grid.max_steps;
}

std::uint32_t longest_dir_setup_us(const bushd_table& table) {
  const std::uint64_t first_ns = std::uint64_t{table.accel.code[0]} * table.time_unit_ns;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(first_ns / 2000, UINT32_MAX));
}

std::uint32_t longest_dir_setup_us(std::int32_t least_speed) {
  const std::uint32_t period_ns =
      bushd_velocity_period(least_speed, least_speed) * BUSHD_VELOCITY_INTERVAL_NS;
  return period_ns / 2000;
}

std::string emission_refusal(const EmissionSetup& setup, unsigned status, std::uint16_t slots,
                             std::uint32_t tick_ns) {
  const std::uint32_t half_slot_ns = (tick_ns - tick_ns / BUSHD_TICK_SLEW_DIVISOR) / (2u * slots);
  const std::string half_slot = us_of_ns(half_slot_ns) + ", half a slot of this MCU";
  const bushd_emission& settings = setup.settings;
  switch (status) {
    case BUSHD_E_PULSE_WIDTH:
      return at(setup.pulse_at,
                "is " + std::to_string(settings.pulse_us) +
                    " us, longer than the STEP pulses of this MCU; allowed: " + half_slot +
                    ", or as long as it makes them if that is less. A longer "
                    "tick_us makes slots longer");
    case BUSHD_E_DIR_SETUP:
      return at(setup.dir_setup_at,
                "is " + std::to_string(settings.dir_setup_us) + " us; allowed: " +
                    (bushd_emission_has_common_dir(settings.mode)
                         ? half_slot + ": so long before a pulse the common DIR changes"
                         : "less than a tick"));
    case BUSHD_E_STEP_PERIOD:
      return at(setup.step_at, "is " + std::to_string(settings.step_us) +
                                   " us; allowed: what a tick holds besides dir_setup_us");
    default:
      return at(setup.mode_at,
                std::string("is refused: ") + bushd_status_text(status) + "; " + remedy_of(status));
  }
}

}  // namespace bushd::fieldbus
