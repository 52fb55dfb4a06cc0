#include "config/serial_pulse_section.h"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "config/inputs.h"
#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::uint32_t kTickUs = 2560;  // of reports, and of the plan between them
constexpr std::array<std::string_view, 4> kLines = {"cd", "dsr", "cts", "ri"};
constexpr std::string_view kLineRule =
    "\"cd\", \"dsr\", \"cts\", \"ri\", or { line = \"cd\", active = \"on\" or \"off\" }";

Result<Input> read_line(const TomlReader& inputs, std::string_view key) {
  if (inputs.table(key) == nullptr) {
    if (!inputs.is_string(key))
      return fail(inputs.error(key, fmt::format("allowed: {}", kLineRule)));
    const auto line = read_word(inputs, key, kLines);
    if (!line) return fail(line.error());
    return Input{.number = static_cast<std::uint8_t>(*line)};
  }
  const auto reader = inputs.section(key, kLineRule);
  if (!reader) return fail(reader.error());
  Input input;
  const Keys keys = Keys(*reader)
                        .only({"line", "active"})
                        .needed_word("line", &input.number, kLines)
                        .word("active", &input.active_open, {"on", "off"});
  if (!keys.result()) return fail(keys.result().error());
  return input;
}

Result<void> read_lines(const TomlReader& bus, MotorInputs* lines) {
  const auto reader =
      bus.section("inputs", "a table such as { home = \"cd\", positive = \"dsr\" }");
  if (!reader) return fail(reader.error());
  if (auto known = reader->only({"positive", "negative", "home"}); !known) return known;
  struct Named {
    std::string_view key;
    std::optional<Input> MotorInputs::* input;
  };
  for (const Named& use :
       {Named{"positive", &MotorInputs::positive}, Named{"negative", &MotorInputs::negative},
        Named{"home", &MotorInputs::home}}) {
    if (!reader->has(use.key)) continue;
    const auto input = read_line(*reader, use.key);
    if (!input) return fail(input.error());
    for (const auto& other : {lines->positive, lines->negative, lines->home}) {
      if (!other || other->number != input->number || other->active_open == input->active_open) {
        continue;
      }
      return fail(reader->error(
          use.key, fmt::format("is {}, which another input has with the other level; allowed: one "
                               "level a line",
                               kLines[input->number])));
    }
    lines->*use.input = *input;
  }
  return {};
}

Result<void> read_direction_line(const TomlReader& bus, SerialPulse* pulse) {
  constexpr std::string_view kRule =
      "\"dtr\", \"rts\", or { line = \"dtr\", active = \"on\" or \"off\" }";
  if (bus.table("direction_line") == nullptr) {
    if (bus.has("direction_line") && !bus.is_string("direction_line")) {
      return fail(bus.error("direction_line", fmt::format("allowed: {}", kRule)));
    }
    return Keys(bus).needed_word("direction_line", &pulse->rts, {"dtr", "rts"}).result();
  }
  const auto reader = bus.section("direction_line", kRule);
  if (!reader) return fail(reader.error());
  return Keys(*reader)
      .only({"line", "active"})
      .needed_word("line", &pulse->rts, {"dtr", "rts"})
      .word("active", &pulse->positive_off, {"on", "off"})
      .result();
}

}  // namespace

Result<void> read_serial_pulse(const TomlReader& reader, Bus* bus) {
  if (auto known = reader.only(
          {"name", "kind", "port", "direction_line", "inputs", "tick_us", "emergency_stop"});
      !known) {
    return known;
  }
  if (auto read = read_direction_line(reader, &bus->serial_pulse); !read) return read;
  if (reader.has("inputs")) {
    if (auto read = read_lines(reader, &bus->serial_pulse.inputs); !read) return read;
  }
  bus->tick_us = kTickUs;
  return Keys(reader)
      .whole("tick_us", &bus->tick_us, BUSHD_MIN_TICK_NS / 1000, BUSHD_MAX_TICK_NS / 1000, "us")
      .result();
}

Result<void> take_serial_pulse(const TomlReader& reader, const Bus& bus, Motor* motor) {
  for (const std::string_view key :
       {"output", "inputs", "limit", "input_active", "local", "keypad", "velocity"}) {
    if (!reader.has(key)) continue;
    return fail(reader.error(
        key, fmt::format("does not apply to the motor of bus \"{}\", a serial port with one motor; "
                         "remove it, switches are named by `inputs` of the bus",
                         bus.name)));
  }
  motor->inputs = bus.serial_pulse.inputs;
  if (motor->home && !motor->inputs.home) {
    return fail(reader.error(
        "home", fmt::format("needs a home switch; add inputs = {{ home = \"cd\" }} to bus \"{}\"",
                            bus.name)));
  }
  return read_limit_action(reader, false, motor);
}

}  // namespace bushd::config
