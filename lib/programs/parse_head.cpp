#include "programs/parse_head.h"

#include <toml++/toml.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "engine/program.h"
#include "tables/table.h"
#include "tables/toml_reader.h"

namespace bushd::programs {
namespace {

using tables::TomlReader;

Result<void> read_motors(const TomlReader& toml, Program& program) {
  const auto array = toml.array("motors", "a list of names of motors");
  if (!array) return fail(array.error());
  for (const toml::node& node : **array) {
    const auto name = node.value<std::string>();
    if (!name || name->empty()) {
      return fail(toml.error("motors", program.motors.size(),
                             tables::describe(node) + "; allowed: the name of a motor"));
    }
    if (std::ranges::find(program.motors, *name) != program.motors.end()) {
      return fail(toml.error("motors", program.motors.size(), "\"" + *name + "\" is named twice"));
    }
    program.motors.push_back(*name);
  }
  if (!program.motors.empty() && program.motors.size() <= BUSHD_MOTORS_PER_MCU) return {};
  return fail(toml.error("motors", std::to_string(program.motors.size()) +
                                       " motors; allowed: 1 to 16, all of one MCU"));
}

Result<void> read_flag(const TomlReader& toml, const char* key, bool& flag) {
  if (!toml.has(key)) return {};
  const auto value = toml.boolean(key);
  if (!value) return fail(value.error());
  flag = *value;
  return {};
}

Result<void> read_range(const TomlReader& toml, Program& program) {
  constexpr const char* kKey = "range";
  constexpr const char* kAllowed =
      "two distances of each motor, the first not above 0, the second not below it: "
      "range = { theta = [-1, 1] }";
  if (!program.at_power_on) {
    if (!toml.has(kKey)) return {};
    return fail(toml.error(kKey, "is for at_power_on = true, which is not there; remove it"));
  }
  const toml::table* const table = toml.table(kKey);
  if (table == nullptr) {
    return fail(toml.error(toml.has(kKey) ? kKey : "at_power_on",
                           "needs a range, since nobody knows where motors are then; allowed: " +
                               std::string(kAllowed)));
  }
  for (const auto& [name, node] : *table) {
    if (std::ranges::find(program.motors, std::string(name.str())) == program.motors.end()) {
      return fail(
          toml.error(kKey, "\"" + std::string(name.str()) +
                               "\" is not in `motors`; allowed: the motors of the program"));
    }
  }
  for (std::size_t i = 0; i < program.motors.size(); ++i) {
    const std::string& name = program.motors[i];
    const toml::array* const ends = (*table)[name].as_array();
    if (ends == nullptr || ends->size() != 2) {
      return fail(toml.error(kKey, "\"" + name + "\" has no two distances; allowed: " + kAllowed));
    }
    const auto least = toml.number(kKey, i, (*ends)[0], kAllowed);
    if (!least) return fail(least.error());
    const auto most = toml.number(kKey, i, (*ends)[1], kAllowed);
    if (!most) return fail(most.error());
    if (*least > 0 || *most < 0) {
      return fail(
          toml.error(kKey, "that of \"" + name + "\" does not have 0; allowed: " + kAllowed));
    }
    program.range.push_back({*least, *most});
  }
  return {};
}

Result<std::vector<std::uint16_t>> read_codes(const TomlReader& toml, const char* key) {
  const auto array = toml.array(key, "a list of delays");
  if (!array) return fail(array.error());
  std::vector<std::uint16_t> codes;
  for (const toml::node& node : **array) {
    const auto code = toml.integer(key, codes.size(), node, 1, UINT16_MAX, "time units");
    if (!code) return fail(code.error());
    codes.push_back(static_cast<std::uint16_t>(*code));
  }
  return codes;
}

Result<void> read_written(const TomlReader& toml, Program& program) {
  if (auto only = toml.only({"time_unit_ns", "accel", "decel", "cruise"}); !only) return only;
  if (program.motors.size() != 1) {
    return fail(toml.error("", "for several motors; allowed: in programs of one motor"));
  }
  tables::TableContent content{.name = "codes of " + program.motors.front()};
  const auto unit = toml.integer("time_unit_ns", 1, tables::TableContent::kMaxTimeUnitNs, "ns");
  if (!unit) return fail(unit.error());
  content.time_unit_ns = static_cast<std::uint32_t>(*unit);
  auto accel = read_codes(toml, "accel");
  if (!accel) return fail(accel.error());
  content.accel = std::move(*accel);
  auto decel = read_codes(toml, "decel");
  if (!decel) return fail(decel.error());
  content.decel = std::move(*decel);
  if (toml.has("cruise")) {
    const auto cruise = toml.integer("cruise", 1, UINT16_MAX, "time units");
    if (!cruise) return fail(cruise.error());
    content.cruise = static_cast<std::uint16_t>(*cruise);
  }
  if (const auto table = tables::make_any_law(content); !table) {
    return fail(toml.error(table.error().key, table.error().message));
  }
  program.codes = std::move(content);
  return {};
}

}  // namespace

Result<void> read_head(const TomlReader& toml, Program& program) {
  if (auto only = toml.only(
          {"motors", "without_host", "kept", "at_power_on", "range", "unit", "codes", "frame"});
      !only) {
    return fail(only.error());
  }
  if (auto motors = read_motors(toml, program); !motors) return fail(motors.error());
  for (const auto& [key, flag] :
       {std::pair{"without_host", &program.without_host}, std::pair{"kept", &program.kept},
        std::pair{"at_power_on", &program.at_power_on}}) {
    if (auto read = read_flag(toml, key, *flag); !read) return read;
  }
  if (toml.has("codes")) {
    const auto codes = toml.section("codes", "time_unit_ns, accel, decel, cruise");
    if (!codes) return fail(codes.error());
    if (auto read = read_written(*codes, program); !read) return read;
  }
  if (auto read = read_range(toml, program); !read) return read;
  if (!toml.has("unit")) return {};
  const auto unit = toml.string("unit", "\"user\" or \"steps\"");
  if (!unit) return fail(unit.error());
  if (*unit != "user" && *unit != "steps") {
    return fail(toml.error("unit", "\"" + *unit + "\"; allowed: \"user\" or \"steps\""));
  }
  program.steps = *unit == "steps";
  return {};
}

Result<void> check_power_on(const TomlReader& toml, const Program& program) {
  if (!program.at_power_on) return {};
  for (const auto& [is, key] :
       {std::pair{program.kept, "kept"}, std::pair{program.without_host, "without_host"}}) {
    if (is) continue;
    return fail(toml.error("at_power_on", std::string("true wants ") + key + " = true as well"));
  }
  if (program.codes) {
    return fail(toml.error("codes", "are not kept over a power cut; allowed: without at_power_on"));
  }
  if (program.envelope) {
    return fail(toml.error("at_power_on",
                           "true, and an envelope is not kept over a power cut; "
                           "allowed: move_by and line_by"));
  }
  for (const Frame& frame : program.frames) {
    const auto* const move = std::get_if<Move>(&frame.what);
    const auto* const line = std::get_if<Line>(&frame.what);
    if (std::holds_alternative<Travel>(frame.what)) {
      return fail(frame.place +
                  ": a travel, in a program with at_power_on: nobody knows then "
                  "between which switches its motor is; allowed: move_by and line_by");
    }
    if ((move == nullptr || move->relative) && (line == nullptr || line->relative)) continue;
    return fail(frame.place +
                ": a position, in a program with at_power_on: nobody knows then where motors are; "
                "allowed: move_by and line_by");
  }
  return {};
}

}  // namespace bushd::programs
