#include "daemon/services/motor_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/nearest_name.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {
namespace {

using config::SettingKey;

std::string assignment(SettingKey key, const std::string& value) {
  return std::string(config::name_of(key)) + " = " + value;
}

constexpr const char* kHalfSteps = "half";

bool has_program(const Mcu& mcu) {
  if (!mcu.can_have_program()) return false;
  const link::ProgramView& its = mcu.offers.programs->program(mcu.on_bus());
  return its.uploading || (its.known && its.state.stage >= BUSHD_PROGRAM_LOADED);
}

// The file has not been edited since. A key that was written with its default value is one that
// was left out no more.
bool is_as_replaced(const config::Settings& in_file, SettingKey key, const std::string& replaces) {
  const std::string begin = assignment(key, "");
  const bool is_line = replaces.starts_with(begin);
  const bool written = in_file.written[static_cast<std::size_t>(key)];
  if (replaces.empty() || (is_line && !written)) return replaces.empty() && !written;
  const auto replaced =
      config::with(in_file, key, is_line ? replaces.substr(begin.size()) : replaces);
  return replaced && config::text_of(*replaced, key) == config::text_of(in_file, key);
}

}  // namespace

MotorSettings::MotorSettings(Installation& installation, const Positions& positions,
                             KeptPositions& kept, Journal& journal, Outputs& outputs,
                             std::function<bool(MotorId)> about_to_move)
    : installation_(installation),
      positions_(positions),
      kept_(kept),
      journal_(journal),
      outputs_(outputs),
      about_to_move_(std::move(about_to_move)),
      file_sha256_(installation.config().text_sha256) {
  for (const MotorId id : installation.motors()) {
    const config::Motor& motor = installation.config()[id];
    in_file_.add(config::settings_of(motor, installation.config().mcu_of(motor)));
  }
}

config::Settings MotorSettings::settings_of(MotorId id) const {
  config::Settings settings = in_file_[id];
  const motion::Motor& motor = installation_[id];
  settings.coordinates = motor.scale().coordinates();
  settings.soft_limits = motor.scale().soft_limits();
  settings.max_speed = motor.scale().max_speed();
  settings.drive = installation_.drives()[id];
  return settings;
}

void MotorSettings::request(const api::Asker& asker, const api::Configure& request) {
  using Kind = api::Configure::Kind;
  if (request.kind == Kind::kChange) return change(asker, request);
  if (request.kind == Kind::kSaved) return saved(asker, request);
  const auto motors = installation_.find_or_all(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  asker.answer(api::Accepted{});
  asker.answer(api::Completed{.reason = "done", .detail = configuration_of(*motors)});
}

Result<MotorSettings::Plan> MotorSettings::plan_of(
    const api::Configure& request, const ById<MotorId, config::Settings>* from) const {
  if (request.changes.empty()) return fail("no change is named; try 'offset=12.5'");
  Plan plan;
  for (const auto& [name, word, value] : request.changes) {
    const auto id = installation_.find(name);
    if (!id) return fail(id.error());
    const auto key = config::setting_key_of(word);
    if (!key) {
      std::vector<std::string_view> known;
      for (const config::SettingKey each : config::kSettingKeys) known.push_back(name_of(each));
      return fail(name + ": \"" + word + "\" cannot be changed in operation" +
                  did_you_mean(word, known) +
                  fmt::format("; allowed: {}. Edit bushd.toml and restart bushd for other keys",
                              fmt::join(known, ", ")));
    }
    for (const MotorId motor : changed_by(*id, *key)) {
      if (auto added = add(plan, motor, *key, value, from); !added) return fail(added.error());
    }
  }
  return plan;
}

Result<void> MotorSettings::add(Plan& plan, MotorId id, SettingKey key, const std::string& value,
                                const ById<MotorId, config::Settings>* from) const {
  const auto at =
      static_cast<std::size_t>(std::ranges::find(plan.motors, id) - plan.motors.begin());
  if (at == plan.motors.size()) {
    plan.motors.push_back(id);
    plan.settings.push_back(from ? (*from)[id] : settings_of(id));
  }
  auto changed = config::with(plan.settings[at], key, value);
  if (!changed) return fail(installation_[id].name() + ": " + changed.error().message);
  Change change{.motor = id,
                .key = key,
                .before = config::text_of(plan.settings[at], key),
                .after = config::text_of(*changed, key)};
  plan.settings[at] = std::move(*changed);
  plan.changes.push_back(std::move(change));
  return {};
}

// The named one first.
std::vector<MotorId> MotorSettings::changed_by(MotorId id, SettingKey key) const {
  std::vector<MotorId> motors{id};
  if (!config::is_of_mcu(key)) return motors;
  for (const MotorId other : installation_.motors()) {
    const bool beside = &installation_.mcu_of(other) == &installation_.mcu_of(id);
    if (beside && other != id) motors.push_back(other);
  }
  return motors;
}

Result<void> MotorSettings::may_be_changed(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  constexpr const char* kAtRest = "; what bushd.toml says of it can be changed at rest only";
  if (!motor.is<motion::Resting>()) return fail(motion::busy_text(motor) + kAtRest);
  if (about_to_move_(id)) return fail(motor.name() + " is about to move" + kAtRest);
  if (!positions_.being_set(id)) return {};
  return fail(motor.name() + ": its position is being set; wait for that result");
}

bool MotorSettings::begins_phases_anew(const Plan& plan, MotorId id) {
  return std::ranges::any_of(plan.changes, [id](const Change& change) {
    return change.motor == id && change.key == SettingKey::kPhaseSequence &&
           change.before != change.after;
  });
}

// An MCU is set up anew with what it keeps of a motor, while all of its motors rest.
Result<void> MotorSettings::mcu_takes(const Plan& plan, MotorId id) const {
  const auto drive_of = [&plan](std::size_t i) { return plan.settings[i].drive; };
  Drives drives = installation_.drives();
  for (std::size_t i = 0; i < plan.motors.size(); ++i) drives[plan.motors[i]] = drive_of(i);
  if (drives[id] == installation_.drives()[id]) return {};
  const Mcu& mcu = installation_.mcu_of(id);
  if (begins_phases_anew(plan, id) && has_program(mcu)) {
    return fail("MCU " + mcu.name() +
                " has a program, whose steps would go another way; erase it first: 'bushctl "
                "program list' shows its name");
  }
  if (!installation_.rests(mcu)) {
    return fail("a motor of MCU " + mcu.name() + " moves; what it does by itself can be " +
                "changed when all of them are at rest");
  }
  const bool other_table = drives[id].acceleration != installation_.drives()[id].acceleration;
  if (other_table && mcu.view().phase == link::McuPhase::kConnecting) {
    return fail("MCU " + mcu.name() + " is being set up; wait until it is ready");
  }
  if (auto good = installation_.has_table(id, installation_.tables(), drives); !good) return good;
  const link::McuSetup setup = installation_.setup_of(mcu.id, installation_.tables(), drives);
  if (setup.tables.size() > BUSHD_TABLE_BANKS) {
    return fail("MCU " + mcu.name() + " would need " + std::to_string(setup.tables.size()) +
                " different tables; allowed: " + std::to_string(BUSHD_TABLE_BANKS) +
                ". Give its motors the same `acceleration`, or the same table");
  }
  return mcu.has_room(setup);
}

void MotorSettings::change(const api::Asker& asker, const api::Configure& request) {
  const auto plan = plan_of(request, nullptr);
  if (!plan) return asker.answer(api::Refused{plan.error().text()});
  for (const MotorId motor : plan->motors) {
    auto may = may_be_changed(motor);
    if (may) may = mcu_takes(*plan, motor);
    if (!may) return asker.answer(api::Refused{may.error().text()});
  }
  asker.answer(api::Accepted{});
  carry_out(*plan, asker);
  api::Completed answer{.reason = text_of(*plan), .detail = configuration_of(plan->motors)};
  open_.push_back({asker, kept_.told(), std::move(answer), plan->motors});
}

void MotorSettings::carry_out(const Plan& plan, const api::Asker& asker) {
  // Where they stand for people, before.
  std::map<MotorId, std::string> from;
  for (std::size_t i = 0; i < plan.motors.size(); ++i) {
    const motion::Motor& motor = installation_[plan.motors[i]];
    if (motor.scale().coordinates().has_unit()) {
      from[plan.motors[i]] = motor.scale().coordinates().text(motor.position_steps());
    }
    put(plan.motors[i], plan.settings[i]);
    keep(plan.motors[i]);
  }
  const std::string who = daemon::text_of(asker);
  for (const Change& change : plan.changes) {
    if (change.before == change.after) continue;
    const motion::Motor& motor = installation_[change.motor];
    journal_.configured(change.motor, config::name_of(change.key), change.after, asker);
    // An MCU begins another sequence with its first phase, to which windings draw the rotor.
    if (change.key == SettingKey::kPhaseSequence) {
      installation_[change.motor].trust().is_uncertain(
          "its phases began anew when phase_sequence became " + change.after + ", and was " +
          change.before);
      kept_.keep_uncertain(change.motor);
    }
    outputs_.log(LogLevel::kInfo, change.motor,
                 motor.name() + ": " + assignment(change.key, change.after) + ", was " +
                     change.before + ", by " + who);
    kept_.past({.motor = motor.name(),
                .what = "config",
                .who = who,
                .from_steps = motor.position_steps(),
                .to_steps = motor.position_steps(),
                .result = std::string(api::word(api::Outcome::kDone)),
                .reason = assignment(change.key, change.after) + ", was " + change.before,
                .from_text = from[change.motor]});
  }
}

void MotorSettings::offset_set(MotorId id, const units::Coordinates& before, const api::Asker& by) {
  keep(id);
  const motion::Motor& motor = installation_[id];
  const auto offset = [](const units::Coordinates& coordinates) {
    return config::text_of(config::Settings{.coordinates = coordinates}, SettingKey::kOffset);
  };
  kept_.past({.motor = motor.name(),
              .what = "set",
              .who = daemon::text_of(by),
              .from_steps = motor.position_steps(),
              .to_steps = motor.position_steps(),
              .result = std::string(api::word(api::Outcome::kDone)),
              .reason = assignment(SettingKey::kOffset, offset(motor.scale().coordinates())) +
                        ", was " + offset(before),
              .from_text = before.text(motor.position_steps()),
              .to_text = motor.scale().coordinates().text(motor.position_steps())});
}

void MotorSettings::put(MotorId id, const config::Settings& settings) {
  installation_[id].scale().set_coordinates(settings.coordinates);
  installation_[id].scale().set_soft_limits(settings.soft_limits);
  installation_[id].scale().set_max_speed(settings.max_speed);
  if (settings.drive != installation_.drives()[id]) {
    installation_.put(id, settings.drive);
    Mcu& mcu = installation_.mcu_of(id);
    mcu.bus().reconfigure(mcu.on_bus(), installation_.setup_of(mcu.id));
  }
  installation_.changed = true;
}

// What bushd.toml says by now is nothing to keep. Keys that this daemon does not know stay.
void MotorSettings::keep(MotorId id) {
  state::Settings all = kept_.settings(id);
  const config::Settings now = settings_of(id);
  for (const SettingKey key : config::kSettingKeys) {
    if (!config::applies(now, key)) continue;
    const std::string value = config::text_of(now, key);
    const std::string in_file = config::text_of(in_file_[id], key);
    all.erase(std::string(config::name_of(key)));
    if (value == in_file) continue;
    all[std::string(config::name_of(key))] = {.value = value,
                                              .replaces = config::line_of(in_file_[id], key)};
  }
  kept_.keep(id, std::move(all));
}

void MotorSettings::take_kept() {
  for (const MotorId id : installation_.motors()) {
    const state::Settings all = kept_.settings(id);
    for (const bool first : {true, false}) {
      for (const SettingKey key : config::kSettingKeys) {
        const auto found = all.find(std::string(config::name_of(key)));
        if (found == all.end() || config::goes_first(key, found->second.value) != first) continue;
        take_kept(id, key, found->second);
      }
    }
    // An edit of the file ends a setting for good, also if it is taken back later.
    keep(id);
  }
}

void MotorSettings::take_kept(MotorId id, SettingKey key, const state::Setting& kept) {
  const motion::Motor& motor = installation_[id];
  const std::string in_file = config::text_of(in_file_[id], key);
  const std::string name(config::name_of(key));
  if (!is_as_replaced(in_file_[id], key, kept.replaces)) {
    outputs_.log(LogLevel::kInfo, id,
                 motor.name() + ": bushd.toml was edited: " + assignment(key, in_file) +
                     " counts, not " + kept.value + ", which was set in operation");
    return;
  }
  if (kept.value == in_file) return;
  auto settings = config::with(settings_of(id), key, kept.value);
  if (settings) {
    Drives drives = installation_.drives();
    drives[id] = settings->drive;
    const auto good = installation_.has_table(id, installation_.tables(), drives);
    if (!good) settings = fail(good.error());
  }
  if (!settings) {
    outputs_.log(LogLevel::kWarning, id,
                 motor.name() + ": what was set in operation is not possible any more: " +
                     settings.error().message + "; " + assignment(key, in_file) +
                     " of bushd.toml counts");
    return;
  }
  put(id, *settings);
  outputs_.log(LogLevel::kInfo, id,
               motor.name() + ": its " + name + " is " + kept.value +
                   ", as it was set in operation; bushd.toml says " + in_file);
}

// What a sequence with other steps means for all that is told in steps.
std::string MotorSettings::other_steps(const Plan& plan, MotorId id) const {
  for (const Change& change : plan.changes) {
    const bool of_it = change.motor == id && change.key == SettingKey::kPhaseSequence;
    const bool was_half = change.before == kHalfSteps;
    const bool is_half = change.after == kHalfSteps;
    if (!of_it || was_half == is_half) continue;
    const std::string means = std::string("; a step is ") + (is_half ? "half" : "twice") +
                              " as far now, and so soft limits, speeds and tables mean " +
                              (is_half ? "half" : "twice") + " as much";
    if (!installation_[id].scale().coordinates().has_unit()) return means;
    return means + ": write steps_per_unit anew into bushd.toml, and restart bushd";
  }
  return {};
}

// "theta: offset = 12.5; it stands at 31.00 mm, beyond its soft limits of ..."
std::string MotorSettings::text_of(const Plan& plan) const {
  std::string text;
  for (const MotorId id : plan.motors) {
    const motion::Motor& motor = installation_[id];
    text += (text.empty() ? "" : "; ") + motor.name() + ": ";
    const char* separator = "";
    for (const Change& change : plan.changes) {
      if (change.motor != id) continue;
      text += separator + assignment(change.key, change.after);
      separator = ", ";
    }
    if (begins_phases_anew(plan, id))
      text += "; its position is uncertain until it is set or homed";
    text += other_steps(plan, id);
    // Where nobody has heard of it there is nothing to be said.
    if (!installation_.mcu_of(id).online()) continue;
    const auto within = motor.reach().stands_within_soft_limits();
    if (!within) text += "; " + within.error().message;
  }
  if (!kept_.keeps()) text += "; counts until bushd ends, as there is no state store";
  return text;
}

api::Configuration MotorSettings::configuration_of(const std::vector<MotorId>& motors) const {
  api::Configuration out{
      .path = installation_.config().absolute_path, .sha256 = file_sha256_, .settings = {}};
  for (const MotorId id : motors) {
    const config::Settings now = settings_of(id);
    for (const SettingKey key : config::kSettingKeys) {
      if (!config::is_reported(now, key) && !config::is_reported(in_file_[id], key)) continue;
      if (!config::applies(now, key)) continue;
      out.settings.push_back({.motor = installation_[id].name(),
                              .key = std::string(config::name_of(key)),
                              .value = config::text_of(now, key),
                              .in_file = config::text_of(in_file_[id], key)});
    }
  }
  return out;
}

void MotorSettings::saved(const api::Asker& asker, const api::Configure& request) {
  const auto plan = plan_of(request, &in_file_);
  if (!plan) return asker.answer(api::Refused{plan.error().text()});
  asker.answer(api::Accepted{});
  for (std::size_t i = 0; i < plan->motors.size(); ++i) {
    in_file_[plan->motors[i]] = plan->settings[i];
    keep(plan->motors[i]);
  }
  file_sha256_ = request.file_sha256;
  outputs_.log(LogLevel::kInfo, {},
               installation_.config().absolute_path + " was written by " + daemon::text_of(asker));
  api::Completed answer{.reason = "done", .detail = configuration_of(plan->motors)};
  open_.push_back({asker, kept_.told(), std::move(answer)});
}

bool MotorSettings::being_set_up(const Open& open) const {
  return std::ranges::any_of(open.motors, [this](MotorId motor) {
    return installation_.mcu_of(motor).view().phase == link::McuPhase::kConnecting;
  });
}

// Whoever has been told that it is done finds it after a power cut, and its MCU has it, unless that
// is offline.
void MotorSettings::step(std::int64_t now_us) {
  std::erase_if(open_, [&](Open& open) {
    if (being_set_up(open)) return false;
    if (!open.until_us) open.until_us = now_us + kPatienceUs;
    const bool kept = kept_.kept_up_to() >= open.number;
    if (!kept && now_us < *open.until_us) return false;
    if (!kept) {
      open.answer.outcome = api::Outcome::kFault;
      open.answer.reason += "; this counts, but is not on the disk, so it is lost if bushd ends: " +
                            kept_.trouble().value_or("the disk does not answer") +
                            ". It is tried again; 'bushctl doctor' tells of the disk";
    }
    open.asker.answer(open.answer);
    return true;
  });
}

}  // namespace bushd::daemon
