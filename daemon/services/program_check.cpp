#include "daemon/services/program_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "config/words.h"
#include "daemon/services/travels.h"
#include "engine/frame.h"
#include "engine/run.h"
#include "motion/zone_run.h"
#include "tables/any_line.h"

namespace bushd::daemon {
namespace {

bool has_lines(const programs::Program& text) {
  return std::ranges::any_of(text.frames, [](const programs::Frame& frame) {
    return std::holds_alternative<programs::Line>(frame.what);
  });
}

// Motors of the line with most of them that is by the elementary law.
unsigned most_elementary(const programs::Program& text) {
  unsigned most = 0;
  for (const programs::Frame& frame : text.frames) {
    const auto* line = std::get_if<programs::Line>(&frame.what);
    if (line == nullptr || !line->elementary) continue;
    const auto motors =
        std::ranges::count_if(line->points.front(), [](const auto& at) { return at.has_value(); });
    most = std::max(most, static_cast<unsigned>(motors));
  }
  return most;
}

Result<McuId> mcu_of(const Installation& installation, const std::vector<MotorId>& motors) {
  const std::vector<McuId> mcus = installation.mcus_of(motors);
  if (mcus.size() > 1) {
    return fail("its motors are at " + installation[mcus[0]].name() + " and at " +
                installation[mcus[1]].name() +
                "; a program is for one MCU: write one for each, and run them together");
  }
  const Mcu& mcu = installation[mcus.front()];
  if (!mcu.can_have_program()) {
    return fail("MCU " + mcu.name() + " cannot have programs; docs/programs.md says which can");
  }
  return mcu.id;
}

Result<programs::MotorPlace> place_of(const Installation& installation, MotorId id) {
  const motion::Motor& motor = installation[id];
  const Mcu& mcu = installation.mcu_of(id);
  const bushd_table& table = installation.table_of(id)->view();
  const auto bank = mcu.bank_of(table);
  const auto shortest = motor.scale().shortest_delay_at({}, table.time_unit_ns);
  if (!shortest) return fail(motor.name() + ": " + shortest.error().text());
  if (!bank) {
    return fail("MCU " + mcu.name() + " does not have the table of " + motor.name() +
                " yet; try again when it is ready");
  }
  return programs::MotorPlace{.name = motor.name(),
                              .output = motor.output().value,
                              .bank = *bank,
                              .table = &table,
                              .coordinates = motor.scale().coordinates(),
                              .least_steps = motor.scale().lowest(),
                              .most_steps = motor.scale().highest(),
                              .shortest_delay_ns = *shortest * table.time_unit_ns,
                              .at_steps = motor.position_steps()};
}

// The codes of a program's text, if its motor may go by them.
Result<tables::TablePtr> written_codes(const Installation& installation, const Mcu& mcu,
                                       const CheckedProgram& program) {
  auto made = tables::make_any_law(*program.text.codes);
  if (!made || !bushd_table_is_written(&(*made)->view())) return made;
  const bushd_table& codes = (*made)->view();
  const motion::Motor& motor = installation[program.motors.front()];
  const auto shortest = motor.scale().shortest_delay_at({}, codes.time_unit_ns);
  if (!shortest) return fail(motor.name() + ": " + shortest.error().text());
  const std::uint16_t fastest = bushd_written_fastest(&codes);
  if (fastest < *shortest) {
    return fail(fmt::format(
        "{}: its codes have a step after {} us, and its max_speed allows none sooner than after {} "
        "us; write longer delays",
        motor.name(), fastest * std::uint64_t{codes.time_unit_ns} / 1000,
        *shortest * codes.time_unit_ns / 1000));
  }
  const std::uint32_t tick_ns = installation.bus_of(mcu).config.tick_ns();
  const std::uint32_t most = bushd_written_max_steps_per_tick(&codes, tick_ns);
  if (most > BUSHD_MAX_STEPS_PER_TICK) {
    return fail(fmt::format(
        "{}: by its codes it could make {} steps in a tick of {} us, which has room for {}; write "
        "longer delays",
        motor.name(), most, tick_ns / 1000, BUSHD_MAX_STEPS_PER_TICK));
  }
  return made;
}

constexpr std::uint64_t kLeastTicksFromEdge = 4;

// What an MCU would say of a travel only when its frame begins.
Result<void> check_travels(const Installation& installation, const CheckedProgram& program,
                           std::uint32_t tick_ns) {
  for (const programs::Frame& frame : program.text.frames) {
    const auto* const travel = std::get_if<programs::Travel>(&frame.what);
    if (travel == nullptr) continue;
    std::size_t i = 0;
    while (!travel->by[i]) ++i;
    const MotorId motor = program.motors[i];
    if (auto has = has_both_limits(installation.config()[motor]); !has) {
      return fail(fmt::format("{}: motor \"{}\": {}", frame.place, installation[motor].name(),
                              has.error().text()));
    }
    const std::uint64_t least_ns = kLeastTicksFromEdge * tick_ns;
    if (travel->at_edges && std::uint64_t{travel->delay_us} * 1000 < least_ns) {
      return fail(
          fmt::format("{}: after_edge_s: is {} us; allowed: {} ticks of the bus or more, "
                      "which are {} us",
                      frame.place, travel->delay_us, kLeastTicksFromEdge, (least_ns + 999) / 1000));
    }
  }
  return {};
}

constexpr double kSameScale = 1e-9;

// The delays of its envelope, by the table that the motor has now.
Result<tables::TableContent> envelope_codes(const Installation& installation,
                                            const CheckedProgram& program) {
  const tables::SpeedZones& zones = *program.text.envelope;
  const MotorId id = program.motors.front();
  const motion::Motor& motor = installation[id];
  const tables::TablePtr table = installation.table_of(id);
  if (table->name() != zones.table) {
    return fail(
        fmt::format("its envelope is for the table \"{}\", and {} goes by \"{}\"; write "
                    "an envelope for that one",
                    zones.table, motor.name(), table->name()));
  }
  const units::Scale& scale = motor.scale().coordinates().scale();
  const double own = static_cast<double>(scale.steps_per_unit.numerator) /
                     static_cast<double>(scale.steps_per_unit.denominator);
  if (zones.steps_per_unit && !(std::fabs(own / *zones.steps_per_unit - 1) < kSameScale)) {
    return fail(fmt::format(
        "its envelope has {:.10g} steps per unit, and {} has {} per {}; write "
        "an envelope for this motor",
        *zones.steps_per_unit, motor.name(), to_text(scale.steps_per_unit), scale.unit));
  }
  const auto shortest = motor.scale().shortest_delay_at({}, table->view().time_unit_ns);
  if (!shortest) return fail(motor.name() + ": " + shortest.error().text());
  const auto run = motion::zone_run(zones, table->view(), *shortest);
  if (!run) return fail("its envelope: " + run.error().text());
  auto codes = motion::written_codes(*run, "envelope of " + motor.name());
  if (!codes) return fail("its envelope " + codes.error().text());
  return codes;
}

// The table of its lines: one that the MCU has, or one that it will get.
Result<void> find_line_table(const Installation& installation, const Mcu& mcu,
                             CheckedProgram& program, programs::McuPlace& place) {
  std::vector<const bushd_table*> tables;
  for (const MotorId motor : program.motors) {
    const bushd_table* table = &installation.table_of(motor)->view();
    if (std::ranges::find(tables, table) == tables.end()) tables.push_back(table);
  }
  auto made = program.text.codes ? written_codes(installation, mcu, program)
                                 : tables::any_line_table(tables, "lines of " + program.name,
                                                          most_elementary(program.text));
  if (!made) return fail(made.error());
  const bushd_table& table = (*made)->view();
  const auto bank = mcu.bank_of(table);
  if (!bank && !mcu.can_upload(table)) return {};  // compile() says so
  if (!mcu.keeps_up_with(table, 0, false)) {
    return fail("MCU " + mcu.name() + " is too slow for lines of these motors' tables");
  }
  program.line_table = std::move(*made);
  program.line_table_is_there = bank.has_value();
  place.line_table = &program.line_table->view();
  place.line_bank = bank.value_or(BUSHD_SCRATCH_BANK);
  return {};
}

Result<CheckedProgram> compile_and_walk(const Installation& installation, const std::string& name,
                                        programs::Program text, bool walks) {
  CheckedProgram program{.name = name, .text = std::move(text)};
  auto motors = installation.find(program.text.motors);
  if (!motors) return fail(motors.error());
  program.motors = std::move(*motors);
  const auto mcu_id = mcu_of(installation, program.motors);
  if (!mcu_id) return fail(mcu_id.error());
  const Mcu& mcu = installation[*mcu_id];
  program.mcu = mcu.id;
  if (auto online = mcu.must_be_online(); !online) return fail(online.error());
  if (program.text.without_host && !mcu.config.programs_without_host) {
    return fail("it says without_host = true, and MCU " + mcu.name() +
                " may not go on without a host; set programs_without_host = true in its [[mcu]], "
                "or leave without_host out");
  }
  if (program.text.at_power_on && !mcu.config.programs_at_power_on) {
    return fail("it says at_power_on = true, and programs of MCU " + mcu.name() +
                " may not begin by themselves; set programs_at_power_on = true in its [[mcu]], or "
                "leave at_power_on out");
  }
  programs::McuPlace place{.name = "MCU " + mcu.name(),
                           .memory = mcu.offers.programs->program(mcu.on_bus()).state.memory,
                           .tick_ns = installation.bus_of(mcu).config.tick_ns(),
                           .lines = mcu.makes_lines(),
                           .elementary = mcu.makes_elementary_lines(),
                           .travels = mcu.can_travel(),
                           .has_trigger = mcu.can_trigger()};
  std::vector<programs::MotorPlace> places;
  for (const MotorId motor : program.motors) {
    auto its = place_of(installation, motor);
    if (!its) return fail(its.error());
    places.push_back(std::move(*its));
    program.tables.push_back(installation.table_of(motor)->content_hash());
  }
  if (auto good = check_travels(installation, program, place.tick_ns); !good) {
    return fail(good.error());
  }
  if (program.text.envelope) {
    auto codes = envelope_codes(installation, program);
    if (!codes) return fail(codes.error());
    program.text.codes = std::move(*codes);
  }
  if ((has_lines(program.text) || program.text.codes) && place.lines) {
    if (auto found = find_line_table(installation, mcu, program, place); !found) {
      return fail(found.error());
    }
  }
  if (program.line_table) program.tables.push_back(program.line_table->content_hash());
  auto bytes = programs::compile(program.text, place, places);
  if (!bytes) return fail(bytes.error());
  program.bytes = std::move(*bytes);
  program.crc = ~bushd_crc32(BUSHD_CRC32_START, program.bytes.data(), program.bytes.size());
  if (!walks) return program;
  auto walk = programs::rehearse(program.text, place, places, program.bytes, kMostWalkedFrames);
  if (!walk) return fail(walk.error());
  program.walk = std::move(*walk);
  return program;
}

}  // namespace

Result<programs::Program> parse_program(const api::PutProgram& request) {
  if (!config::is_name(request.program, config::kLongestName)) {
    return fail(fmt::format("\"{}\" is no name of a program; allowed: {}", request.program,
                            config::kNameRule));
  }
  std::size_t bytes = request.text.size();
  for (const auto& points : request.points) bytes += points.text.size() + points.file.size();
  if (bytes > api::PutProgram::kMostBytes) {
    return fail(fmt::format("program {} has {} bytes of text; allowed: {}", request.program, bytes,
                            api::PutProgram::kMostBytes));
  }
  return programs::parse(
      request.text, request.program, [&](const std::string& file) -> Result<std::string> {
        const auto found = std::ranges::find(request.points, file, &api::PutProgram::Points::file);
        if (found != request.points.end()) return found->text;
        return fail("the file \"" + file + "\" has not been sent with it");
      });
}

Result<CheckedProgram> compile_program(const Installation& installation, const std::string& name,
                                       programs::Program text) {
  return compile_and_walk(installation, name, std::move(text), false);
}

Result<CheckedProgram> check_program(const Installation& installation, const std::string& name,
                                     programs::Program text) {
  return compile_and_walk(installation, name, std::move(text), true);
}

api::ProgramEntry entry_of(const Installation& installation, const CheckedProgram& program) {
  const Mcu& mcu = installation[program.mcu];
  const programs::Rehearsal& walk = program.walk;
  const std::int64_t tick_us = installation.bus_of(mcu).config.tick_us;
  api::ProgramEntry entry{.mcu = mcu.name(),
                          .program = program.name,
                          .checksum = fmt::format("{:08x}", program.crc),
                          .without_host = program.text.without_host,
                          .at_power_on = program.text.at_power_on,
                          .kept = program.text.kept,
                          .bytes = static_cast<std::int32_t>(program.bytes.size()),
                          .duration_us = static_cast<std::int64_t>(walk.ticks) * tick_us,
                          .pulses = static_cast<std::int64_t>(walk.pulses),
                          .endless = walk.endless,
                          .waits_for_inputs = walk.waits_for_inputs,
                          .cut = walk.cut};
  for (std::size_t i = 0; i < program.motors.size(); ++i) {
    const motion::Motor& motor = installation[program.motors[i]];
    const std::int64_t stands = motor.position_steps();
    const programs::Rehearsal::Way way =
        walk.motors.empty() ? programs::Rehearsal::Way{stands, stands, stands, 0} : walk.motors[i];
    entry.motors.push_back({.motor = motor.name(),
                            .least_steps = way.least_steps,
                            .most_steps = way.most_steps,
                            .end_steps = way.end_steps,
                            .edges = static_cast<std::int64_t>(way.edges)});
  }
  return entry;
}

}  // namespace bushd::daemon
