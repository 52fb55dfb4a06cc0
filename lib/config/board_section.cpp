#include "config/board_section.h"

#include <fmt/format.h>

namespace bushd::config {

using tables::TomlReader;

Result<void> read_board(const TomlReader& reader, Bus* bus) {
  const auto start_hz = reader.integer("start_hz", 1, 100, "Hz");
  if (!start_hz) return fail(start_hz.error());
  bus->start_hz = static_cast<std::uint32_t>(*start_hz);
  bus->answer_ms = 100;
  if (!reader.has("answer_ms")) return {};
  const auto answer_ms = reader.integer("answer_ms", 10, 10'000, "ms");
  if (!answer_ms) return fail(answer_ms.error());
  bus->answer_ms = static_cast<std::uint32_t>(*answer_ms);
  return {};
}

Result<void> check_board_motor(const TomlReader& reader, const std::string& board,
                               std::int64_t output) {
  if (output > 7) {
    return fail(reader.error("output", fmt::format("is {}; allowed: 0..7 on commutator board "
                                                   "\"{}\"",
                                                   output, board)));
  }
  for (const char* const key :
       {"inputs", "limit", "input_active", "home", "local", "keypad", "velocity"}) {
    if (!reader.has(key)) continue;
    return fail(reader.error(
        key, fmt::format("is for motors of MCUs; the board \"{}\" has limit switches of its own "
                         "and no other inputs. Remove this line",
                         board)));
  }
  return {};
}

}  // namespace bushd::config
