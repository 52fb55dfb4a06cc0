#include "config/board_section.h"

#include <fmt/format.h>

namespace bushd::config {

using tables::TomlReader;

namespace {

Result<Converter> read_converter(const TomlReader& bus) {
  if (bus.has("start_hz")) {
    return fail(bus.error("start_hz",
                          "is for a board that counts delay codes, and this one has a converter. "
                          "Remove one of both lines"));
  }
  const auto reader = bus.section("converter", "a table such as { max_hz = 2500, max_code = 250 }");
  if (!reader) return fail(reader.error());
  if (auto known = reader->only({"max_hz", "max_code"}); !known) return fail(known.error());
  const auto max_hz = reader->integer("max_hz", kLeastHzPerCode, kMaxConverterHz, "Hz");
  if (!max_hz) return fail(max_hz.error());
  const auto max_code = reader->integer("max_code", 1, kMaxConverterCode);
  if (!max_code) return fail(max_code.error());
  if (*max_hz < kLeastHzPerCode * *max_code) {
    return fail(reader->error(
        "max_hz", fmt::format("is {} Hz, which gives code 1 less than {} Hz; allowed with max_code "
                              "= {}: {} Hz and more. Use a smaller max_code",
                              *max_hz, kLeastHzPerCode, *max_code, kLeastHzPerCode * *max_code)));
  }
  return Converter{.max_hz = static_cast<std::uint32_t>(*max_hz),
                   .max_code = static_cast<std::uint32_t>(*max_code)};
}

// How the board times its steps.
Result<void> read_pace(const TomlReader& reader, Bus* bus) {
  if (reader.has("converter")) {
    const auto converter = read_converter(reader);
    if (!converter) return fail(converter.error());
    bus->converter = *converter;
    return {};
  }
  const auto start_hz = reader.integer("start_hz", 1, 100, "Hz");
  if (!start_hz) return fail(start_hz.error());
  bus->start_hz = static_cast<std::uint32_t>(*start_hz);
  return {};
}

}  // namespace

Result<void> read_board(const TomlReader& reader, Bus* bus) {
  if (auto pace = read_pace(reader, bus); !pace) return pace;
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
