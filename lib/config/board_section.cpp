#include "config/board_section.h"

#include <fmt/format.h>

#include "config/words.h"

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
  Converter converter{};
  const Keys keys =
      Keys(*reader)
          .only({"max_hz", "max_code"})
          .needed_whole("max_hz", &converter.max_hz, kLeastHzPerCode, kMaxConverterHz, "Hz")
          .needed_whole("max_code", &converter.max_code, 1, kMaxConverterCode);
  if (!keys.result()) return fail(keys.result().error());
  const auto least_hz = kLeastHzPerCode * converter.max_code;
  if (converter.max_hz < least_hz) {
    return fail(reader->error(
        "max_hz", fmt::format("is {} Hz, which gives code 1 less than {} Hz; allowed with max_code "
                              "= {}: {} Hz and more. Use a smaller max_code",
                              converter.max_hz, kLeastHzPerCode, converter.max_code, least_hz)));
  }
  return converter;
}

// How the board times its steps.
Result<void> read_pace(const TomlReader& reader, Bus* bus) {
  if (reader.has("converter")) {
    const auto converter = read_converter(reader);
    if (!converter) return fail(converter.error());
    bus->converter = *converter;
    return {};
  }
  return Keys(reader).needed_whole("start_hz", &bus->start_hz, 1, 100, "Hz").result();
}

}  // namespace

Result<void> read_board(const TomlReader& reader, Bus* bus) {
  if (auto pace = read_pace(reader, bus); !pace) return pace;
  bus->answer_ms = 100;
  return Keys(reader).whole("answer_ms", &bus->answer_ms, 10, 10'000, "ms").result();
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
