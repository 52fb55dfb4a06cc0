// What tables say of a motor, cell by cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "api/reply.h"
#include "api/snapshot.h"
#include "client/status.h"
#include "grid.h"

namespace bushctl {

using bushd::client::description_of;

bool has_position(const bushd::api::MotorState& motor);
bool has_unit(const bushd::units::Scale& scale);

// "constant@3"
std::string text_of(const bushd::api::TableRef& table);

// What it does, in a word for tables.
const char* moving_word(const bushd::api::MotorState& motor, const char* moves, const char* rests);

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

// Which columns a table of motors has, for the room there is.
struct MotorColumns {
  bool place = true;     // MCU, output, group and table
  std::size_t bar = 15;  // columns between the soft limits, at least 2
  bool target = true;
};

// With its heading.
Grid motor_grid(const MotorColumns& columns);
std::vector<std::string> motor_row(const bushd::api::MotorState& motor,
                                   const bushd::api::MotorDescription& description,
                                   const bushd::api::StateSnapshot& mcu, bool of_mcu,
                                   const MotorColumns& columns);

}  // namespace bushctl
