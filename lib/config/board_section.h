// What is peculiar to buses that are commutator boards.
#pragma once

#include <cstdint>
#include <string>

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

Result<void> read_board(const tables::TomlReader& reader, Bus* bus);
// Its motors' numbers, and what it has no inputs for: it watches limit switches of its own.
Result<void> check_board_motor(const tables::TomlReader& reader, const std::string& board,
                               std::int64_t output);

}  // namespace bushd::config
