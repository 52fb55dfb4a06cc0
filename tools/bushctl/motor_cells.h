// What tables say of a motor, cell by cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "api/reply.h"
#include "api/snapshot.h"
#include "client/status.h"

namespace bushctl {

using bushd::client::description_of;

bool has_position(const bushd::api::MotorState& motor);
bool has_unit(const bushd::units::Scale& scale);

// "constant@3"
std::string text_of(const bushd::api::TableRef& table);

// What it does, in a word for tables.
const char* moving_word(const bushd::api::MotorState& motor, const char* moves, const char* rests);
// By itself, or as a move says.
const char* moves_text(const bushd::api::MotorState& motor);

// Since when it is not heard, which limit switch is active, who has armed it.
std::string notes_text(const bushd::api::MotorState& motor);
// What there is to say of an MCU beside its state: why it is so, and its program.
std::string about(const bushd::api::StateSnapshot& mcu);

// "12.345 mm", and bare steps of a motor without a unit; of one whose position nobody knows "-".
std::string position_text(std::int64_t steps, double user, const bushd::units::Scale& scale);
std::string position_text(const bushd::api::MotorState& motor, std::int64_t steps, double user,
                          const bushd::units::Scale& scale);

// "1.250 mm/s", and bare steps per second of a motor without a unit.
std::string speed_text(const bushd::api::MotorState& motor, const bushd::units::Scale& scale);

// Where a motor stands between its soft limits: "-5 |----x---------| 25"; outside of them an arrow
// points to where it is. "": it has none. `columns`: of the bar, at least 2.
std::string range_text(const bushd::api::MotorState& motor,
                       const bushd::api::MotorDescription& description, std::size_t columns = 15);

}  // namespace bushctl
