// How an MCU is to emit steps, as the configuration has it, and what an MCU that cannot do so means
// for the one who wrote it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.h"
#include "engine/emission.h"
#include "engine/table.h"

namespace bushd::fieldbus {

struct EmissionSetup {
  bushd_emission settings{};
  // A motor makes a step before work, which tells how long the supply current needs after one.
  bool measures() const {
    return bushd_emission_is_staggered(settings.mode) &&
           settings.settle_us == BUSHD_SETTLE_MEASURED;
  }
  // Where they stand; without messages.
  Error mode_at{};
  Error step_at{};
  Error dir_setup_at{};
  Error pulse_at{};
};

// By bushd_emission_mode, in the log of moves.
inline constexpr std::array<std::string_view, 6> kEmissionNames = {
    "even", "burst", "common-dir", "staggered", "phases", "common-dir-staggered"};

// What `steps` and `direction` of a configuration may be.
inline constexpr std::array<std::string_view, 4> kStepsNames = {"even", "burst", "staggered",
                                                                "phases"};
inline constexpr std::array<std::string_view, 2> kDirectionNames = {"own", "common"};

// `steps = "burst"`, and `direction = "common"` where the mode has one DIR for all.
std::string emission_keys(std::uint8_t mode);

// By bushd_phase_sequence.
inline constexpr std::array<std::string_view, 4> kSequenceNames = {"wave", "full", "half",
                                                                   "three-phase"};

// How many steps of a motor find room in a tick; or why the MCU cannot do so, as far as it can be
// told without asking.
Result<unsigned> max_steps_per_tick(const EmissionSetup& setup, const bushd_identity& identity,
                                    std::uint32_t tick_ns);

// The longest dir_setup_us with which no step of this table is made later than the table says. DIR
// changes where a run begins; the first step comes after the first delay, in a line after half of
// that. A step that has to wait would be followed by the next one too soon. For even emission: the
// other modes let all steps wait.
std::uint32_t longest_dir_setup_us(const bushd_table& table);
// By the velocity loop, which turns a motor at its least speed, in 1/64 step/s, above 0.
std::uint32_t longest_dir_setup_us(std::int32_t least_speed);

// What can be done about a refusal that the configuration is not to blame for.
const char* remedy_of(unsigned refusal);

// What its refusal means.
std::string emission_refusal(const EmissionSetup& setup, unsigned status, std::uint16_t slots,
                             std::uint32_t tick_ns);

}  // namespace bushd::fieldbus
