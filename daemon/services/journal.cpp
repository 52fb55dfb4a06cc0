#include "daemon/services/journal.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "base/json_text.h"
#include "base/output_bits.h"
#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

// What moves a motor by itself, as the log of moves has it.
constexpr std::string_view kHoming = "homing";
std::string_view what_moves(const motion::Motor& motor) {
  if (motor.is<motion::Homing>()) return kHoming;
  if (motor.is<motion::InProgram>()) return "program";
  return motor.is<motion::Travelling>() ? "travel" : "local";
}

constexpr std::size_t kRowsPerLine = 500;  // of a trajectory

}  // namespace

Journal::Journal(const Installation& installation, Outputs& outputs)
    : installation_(installation),
      outputs_(outputs),
      // The log of moves is appended to: its ids must not begin anew with every daemon.
      last_id_(static_cast<std::uint64_t>(outputs.wall_clock_us())) {
  for ([[maybe_unused]] const MotorId motor : installation.motors()) {
    id_.add(std::uint64_t{0});
    autonomous_.add();
    table_told_.add();
  }
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) told_.add();
}

// Where no file has it, nobody could tell from the log what the motor was to do.
void Journal::tell_table(MotorId motor, const tables::Table& table) {
  if (!table.path().empty() || table_told_[motor] == table.content_hash()) return;
  table_told_[motor] = table.content_hash();
  const bushd_table& codes = table.view();
  nlohmann::json line = {{"event", "table"},
                         {"name", table.name()},
                         {"table_sha256", table.content_hash()},
                         {"time_unit_ns", codes.time_unit_ns},
                         {"cruise", codes.cruise},
                         {"accel", std::span(codes.accel.code, codes.accel.count)}};
  if (!table.symmetric()) {
    const std::span decel(codes.decel.code, codes.decel.count);
    line["decel"] = std::vector<std::uint16_t>(decel.rbegin(), decel.rend());
  }
  outputs_.move_log(json_text(line));
}

// What edges mean. Where no key says so, all is active high.
void Journal::tell_levels(const Mcu& mcu) {
  const bushd_set_outputs& outputs = mcu.config.outputs;
  const bool enable_low = outputs.enabled == BUSHD_ENABLED_LOW;
  if (!enable_low && (outputs.step_low | outputs.direction_low) == 0) return;
  const auto numbers = [](std::uint16_t mask) {
    std::vector<int> low;
    for (int output = 0; mask >> output != 0; ++output) {
      if (mask >> output & 1) low.push_back(output);
    }
    return low;
  };
  const nlohmann::json line = {{"event", "levels"},
                               {"bus", installation_.bus_of(mcu).config.name},
                               {"address", mcu.config.address.value},
                               {"enable_low", enable_low},
                               {"step_low", numbers(outputs.step_low)},
                               {"direction_low", numbers(outputs.direction_low)}};
  outputs_.move_log(json_text(line));
}

void Journal::goes_online(Mcu& mcu) {
  told_[mcu.id].reset();
  tell_levels(mcu);
}

void Journal::started(MotorId id, std::int64_t steps, motion::Tick start, std::uint32_t late_ns,
                      bool by_table) {
  const motion::Motor& motor = installation_[id];
  const Mcu& mcu = installation_.mcu_of(id);
  const config::Bus& bus = installation_.bus_of(mcu).config;
  const auto& share = motor.axis().line();
  const tables::Table& table = share && share->by ? *share->by : *installation_.table_of(id);
  tell_table(id, table);
  id_[id] = ++last_id_;
  nlohmann::json line = {{"event", "move"},
                         {"id", id_[id]},
                         {"motor", motor.name()},
                         {"bus", bus.name},
                         {"address", mcu.config.address.value},
                         {"output", motor.output().value},
                         {"table_file", table.path()},
                         {"table_sha256", table.content_hash()},
                         {"tick_ns", bus.tick_ns()},
                         {"format", bus.format == BUSHD_FORMAT_FINE ? "fine" : "coarse"},
                         {"moves", by_table ? "table" : "stream"},
                         {"start_tick", start},
                         {"steps", steps},
                         {"from_steps", motor.axis().from_steps()}};
  if (share && share->track) {
    line["path"] = {
        {"line", share->line}, {"way", share->way}, {"from", share->from}, {"to", share->to}};
  } else if (share) {
    // The same for all motors of a line, but for the increment.
    line["line"] = {{"line", share->line},
                    {"way", share->way},
                    {"increment", share->increment},
                    {"longest", share->longest},
                    {"direction", share->direction},
                    {"from", share->from},
                    {"to", share->to}};
  }
  if (const auto& followed = motor.axis().trajectory()) {
    line["trajectory"] = {{"trajectory", followed->number}, {"column", followed->motor}};
  }
  if (late_ns != 0) line["late_ns"] = late_ns;
  if (motor.axis().shortest_delay() != 0) line["shortest_delay"] = motor.axis().shortest_delay();
  if (const bushd_emission& emission = mcu.config.emission.settings;
      emission.mode != BUSHD_EMISSION_EVEN) {
    line["emission"] = fieldbus::kEmissionNames.at(emission.mode);
    line["step_us"] = emission.step_us;
    line["dir_setup_us"] = emission.dir_setup_us;
    if (bushd_emission_is_staggered(emission.mode)) line["settle_us"] = emission.settle_us;
    if (emission.mode == BUSHD_EMISSION_PHASES) {
      line["phase_sequence"] =
          fieldbus::kSequenceNames.at(installation_.drives()[id].phase_sequence);
    }
  }
  outputs_.move_log(json_text(line));
}

std::uint64_t Journal::line_laid(const motion::Way& way, const std::vector<OnWay>& motors) {
  nlohmann::json line = {{"event", "line"}, {"way", ++last_id_}, {"longest", way.longest()}};
  if (way.is_elementary()) line["law"] = "elementary";
  for (const auto& [id, increment, shortest_delay, table] : motors) {
    tell_table(id, *table);
    line["motors"].push_back({{"motor", installation_[id].name()},
                              {"increment", increment},
                              {"shortest_delay", shortest_delay},
                              {"table_file", table->path()},
                              {"table_sha256", table->content_hash()}});
    if (way.is_elementary()) {
      line["motors"].back()["output"] = installation_[id].output().value;
    }
  }
  outputs_.move_log(json_text(line));
  return last_id_;
}

// Its points are the client's; here is by which tables, and how long it is.
std::uint64_t Journal::path_laid(const std::vector<MotorId>& motors, const motion::Path& path) {
  nlohmann::json line = {
      {"event", "path"},         {"way", ++last_id_},         {"segments", path.segments()},
      {"longest", path.steps()}, {"unit_ns", path.unit_ns()}, {"units", path.units()}};
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const tables::Table& table = *installation_.table_of(motors[i]);
    tell_table(motors[i], table);
    line["motors"].push_back({{"motor", installation_[motors[i]].name()},
                              {"from_steps", path.point(0, i)},
                              {"to_steps", path.point(path.segments(), i)},
                              {"shortest_delay", path.motors()[i].shortest_delay},
                              {"table_file", table.path()},
                              {"table_sha256", table.content_hash()}});
  }
  outputs_.move_log(json_text(line));
  return last_id_;
}

void Journal::trajectory_rows(LoggedTrajectory& logged, const motion::Trajectory& trajectory,
                              const std::vector<MotorId>& motors) {
  const bool cubic = trajectory.interpolation() == motion::Trajectory::Interpolation::kCubic;
  do {
    const std::size_t until = std::min(trajectory.rows(), logged.rows + kRowsPerLine);
    const bool last = until == trajectory.rows() && trajectory.closed();
    nlohmann::json line = {{"event", "trajectory"},
                           {"trajectory", logged.number},
                           {"interpolation", cubic ? "cubic" : "linear"},
                           {"closed", last}};
    for (const MotorId id : motors) line["motors"].push_back(installation_[id].name());
    line["rows"] = nlohmann::json::array();
    for (; logged.rows < until; ++logged.rows) {
      nlohmann::json row = {trajectory.time_ns(logged.rows)};
      for (std::size_t m = 0; m < motors.size(); ++m) {
        row.push_back(trajectory.position(logged.rows, m));
      }
      line["rows"].push_back(std::move(row));
    }
    outputs_.move_log(json_text(line));
  } while (logged.rows < trajectory.rows());
}

void Journal::changed(MotorId motor, const motion::Change& change) {
  nlohmann::json line = {{"event", change.target_steps ? "retarget" : "stop"},
                         {"id", id_[motor]},
                         {"motor", installation_[motor].name()},
                         {"tick", change.at}};
  if (change.target_steps) line["target_steps"] = *change.target_steps;
  if (change.target_steps && change.shortest_delay != 0)
    line["shortest_delay"] = change.shortest_delay;
  if (change.target_steps && installation_[motor].axis().line()) {
    line["run_steps"] = change.run_steps;
  }
  outputs_.move_log(json_text(line));
}

void Journal::ended(MotorId motor, std::string_view result) {
  const nlohmann::json line = {{"event", "result"},
                               {"id", id_[motor]},
                               {"motor", installation_[motor].name()},
                               {"result", result},
                               {"position_steps", installation_[motor].position_steps()}};
  outputs_.move_log(json_text(line));
}

void Journal::position_set(MotorId motor, std::int64_t from_steps, const api::Asker& by) {
  nlohmann::json line = {{"event", "set"},
                         {"motor", installation_[motor].name()},
                         {"from_steps", from_steps},
                         {"position_steps", installation_[motor].position_steps()},
                         {"number", by.number}};
  if (by.session) line["client"] = by.session->client_id();
  outputs_.move_log(json_text(line));
}

void Journal::position_corrected(MotorId motor, std::int64_t from_steps) {
  const nlohmann::json line = {{"event", "corrected"},
                               {"utime_us", outputs_.wall_clock_us()},
                               {"motor", installation_[motor].name()},
                               {"from_steps", from_steps},
                               {"position_steps", installation_[motor].position_steps()}};
  outputs_.move_log(json_text(line));
}

void Journal::offset_set(MotorId id, const api::Asker& by) {
  const motion::Motor& motor = installation_[id];
  nlohmann::json line = {{"event", "offset"},
                         {"motor", motor.name()},
                         {"position_steps", motor.position_steps()},
                         {"user", motor.scale().coordinates().user_of(motor.position_steps())},
                         {"offset", motor.scale().coordinates().scale().offset},
                         {"number", by.number}};
  if (by.session) line["client"] = by.session->client_id();
  outputs_.move_log(json_text(line));
}

void Journal::configured(MotorId id, std::string_view key, std::string_view value,
                         const api::Asker& by) {
  nlohmann::json line = {{"event", "config"},
                         {"motor", installation_[id].name()},
                         {"key", key},
                         {"value", value},
                         {"number", by.number}};
  if (by.session) line["client"] = by.session->client_id();
  outputs_.move_log(json_text(line));
}

void Journal::before_report(MotorId id, bool being_set) {
  if (autonomous_[id]) return;
  const motion::Motor& motor = installation_[id];
  const Mcu& mcu = installation_.mcu_of(id);
  const bool autonomous = has_bit(mcu.report().autonomous, motor.output());
  // Somebody has tapped a button between two reports.
  const bool tapped =
      installation_.drives()[id].moved_by_people() && !motor.has_plan() && !being_set &&
      mcu.report().motor[motor.output().value].position_steps != motor.position_steps();
  if (!autonomous && !tapped) return;
  autonomous_[id] = Autonomous{
      .since = told_[mcu.id], .from_steps = motor.position_steps(), .what = what_moves(motor)};
}

void Journal::after_report(const Mcu& mcu) {
  for (const MotorId motor : mcu.motors()) {
    const bool now = has_bit(mcu.report().autonomous, installation_[motor].output());
    if (!now) end_autonomous(motor, mcu);
  }
  told_[mcu.id] = mcu.view().tick;
}

void Journal::end_autonomous(MotorId id, const Mcu& mcu) {
  if (!autonomous_[id]) return;
  const Autonomous autonomous = *std::exchange(autonomous_[id], std::nullopt);
  const motion::Motor& motor = installation_[id];
  const config::Bus& bus = installation_.bus_of(mcu).config;
  const bool homed = autonomous.what == kHoming && mcu.report().homing == BUSHD_HOMING_DONE;
  nlohmann::json line = {{"event", "autonomous"},
                         {"motor", motor.name()},
                         {"bus", bus.name},
                         {"address", mcu.config.address.value},
                         {"output", motor.output().value},
                         {"tick_ns", bus.tick_ns()},
                         {"what", autonomous.what},
                         {"until_tick", mcu.view().tick},
                         {"from_steps", autonomous.from_steps},
                         {"set", homed || autonomous.set},
                         {"position_steps", motor.position_steps()}};
  if (autonomous.since) line["from_tick"] = *autonomous.since;
  outputs_.move_log(json_text(line));
}

void Journal::position_lost(MotorId motor, std::int64_t from_steps) {
  if (autonomous_[motor]) autonomous_[motor]->set = true;
  const bushd_report& report = installation_.mcu_of(motor).report();
  nlohmann::json line = {{"event", "restarted"},
                         {"utime_us", outputs_.wall_clock_us()},
                         {"motor", installation_[motor].name()},
                         {"mcu", installation_.mcu_of(motor).name()},
                         {"boot", report.boot_number},
                         {"from_steps", from_steps},
                         {"position_steps", installation_[motor].position_steps()}};
  if (const std::string cause = motion::reset_cause_word(report.reset_cause); !cause.empty()) {
    line["reset_cause"] = cause;
  }
  outputs_.move_log(json_text(line));
}

}  // namespace bushd::daemon
