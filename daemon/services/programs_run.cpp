// Runs of programs: from the request to the one result.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/output_bits.h"
#include "daemon/services/program_words.h"
#include "daemon/services/programs.h"
#include "engine/program.h"
#include "words/remedy.h"

namespace bushd::daemon {
namespace {

using api::Outcome;

constexpr const char* kStoppedBefore = "it was stopped before it began";

}  // namespace

Result<void> Programs::may_run(McuId id) const {
  const CheckedProgram& program = *mcus_[id].program;
  const Mcu& mcu = installation_[id];
  for (const MotorId motor : program.motors) {
    const std::string& name = installation_[motor].name();
    if (auto may = interlocks_.may_move(motor); !may) return fail(name + ": " + may.error().text());
    if (installation_[motor].has_plan()) {
      return fail(name + " moves; run " + words::remedy("stop", name) + " first");
    }
    if (installation_[motor].hold().is_set()) {
      return fail(name + ": " + installation_[motor].hold().text() + "; run " +
                  words::remedy("release", name) + " first");
    }
  }
  if (mcus_[id].run || view(id).under_way()) {
    return fail("the program of MCU " + mcu.name() + " is under way already");
  }
  if (mcus_[id].upload || mcus_[id].erase) {
    return fail("MCU " + mcu.name() + " gets or erases its program; wait for its end");
  }
  if (!is_loaded(id)) {
    return fail("MCU " + mcu.name() + " does not have it any more; put it again");
  }
  const auto now = check_program(installation_, program.name, program.text);
  if (!now) return fail(now.error());
  if (now->bytes != program.bytes || now->tables != program.tables) {
    return fail(
        "tables, speeds or limits of its motors are not those with which it was put; put it again");
  }
  for (std::size_t i = 0; i < now->motors.size(); ++i) {
    const motion::Motor& motor = installation_[now->motors[i]];
    for (const std::int64_t end :
         {now->walk.motors[i].least_steps, now->walk.motors[i].most_steps}) {
      if (auto may = motor.reach().may_move_to(end); !may) {
        return fail(motor.name() + ": " + may.error().text());
      }
    }
  }
  return {};
}

Result<std::vector<McuId>> Programs::mcus_of(const api::RunPrograms& request) const {
  if (request.programs.empty()) return fail("no program is named");
  if (auto may = interlocks_.may_move(); !may) return fail(may.error());
  std::vector<McuId> mcus;
  for (const std::string& name : request.programs) {
    const auto id = find(name);
    if (!id) {
      return fail("no MCU has a program \"" + name +
                  "\"; 'bushctl program list' shows those that there are");
    }
    if (std::ranges::find(mcus, *id) != mcus.end()) return fail(name + " is named twice");
    if (!mcus.empty() && installation_[*id].config.bus != installation_[mcus.front()].config.bus) {
      return fail(request.programs.front() + " and " + name +
                  " are on two buses, whose ticks have nothing in common; run them one by one");
    }
    if (auto may = may_run(*id); !may) return fail(name + ": " + may.error().text());
    mcus.push_back(*id);
  }
  return mcus;
}

void Programs::request(const api::Asker& asker, const api::RunPrograms& request) {
  auto mcus = mcus_of(request);
  if (!mcus) return asker.answer(api::Refused{mcus.error().text()});
  std::vector<MotorId> all;
  for (const McuId id : *mcus) {
    const std::vector<MotorId>& motors = mcus_[id].program->motors;
    all.insert(all.end(), motors.begin(), motors.end());
    mcus_[id].run = Run{.motors = motors, .without_host = mcus_[id].program->text.without_host};
  }
  const auto by = open_.precedence().overtaken(asker.after_stops, all);
  if (by) {
    for (const McuId id : *mcus) mcus_[id].run.reset();
    return open_.not_begun(asker, *by);
  }
  asker.answer(api::Accepted{});
  open_.open(asker, all, OpenMoves::Purpose::kProgram);
  for (const MotorId motor : all) installation_[motor].give_to_mcu(motion::InProgram{});
  starts_.push_back({.asker = asker, .mcus = std::move(*mcus)});
  installation_.changed = true;
}

bool Programs::has_line_table(McuId id) const {
  const tables::TablePtr& table = mcus_[id].program->line_table;
  return !table || installation_[id].has_table(table->view());
}

// As soon as its MCUs have the tables of lines, which may have been replaced since, the disk knows
// of the motion, and drivers are enabled. If that does not come to pass,
// the start is given up.
Programs::Ready Programs::make_ready(std::int64_t now_us, const Start& start) {
  bool ready = true;
  for (const McuId id : start.mcus) {
    if (auto may = interlocks_.may_begin(mcus_[id].run->motors.front()); !may) {
      give_up(start, Outcome::kStopped, "it did not begin: " + may.error().text());
      return Ready::kNever;
    }
    if (!has_line_table(id)) {
      const Mcu& mcu = installation_[id];
      const bushd_table& table = mcus_[id].program->line_table->view();
      if (!std::exchange(mcus_[id].run->table_asked, true)) {
        mcu.offers.uploads->upload(mcu.on_bus(), table);
      } else if (!mcu.uploads()) {
        give_up(start, Outcome::kFault,
                "MCU " + mcu.name() + " did not take the table of its lines; run it again");
        return Ready::kNever;
      }
      ready = false;
    }
    for (const MotorId motor : mcus_[id].run->motors) {
      const auto its = kept_.make_ready(now_us, motor);
      if (!its) {
        give_up(start, Outcome::kFault, its.error().text());
        return Ready::kNever;
      }
      ready = *its && ready;
    }
    ready = idle_drivers_.make_ready(now_us, id) && ready;
    ready = !installation_[id].busy() && ready;
  }
  return ready ? Ready::kNow : Ready::kNotYet;
}

void Programs::begin(std::int64_t now_us, Start& start) {
  const Mcu& first = installation_[start.mcus.front()];
  link::Programs& programs = *first.offers.programs;
  std::vector<link::McuIndex> on_bus;
  for (const McuId id : start.mcus) on_bus.push_back(installation_[id].on_bus());
  const link::Tick at = programs.earliest_program_start(now_us, on_bus);
  for (const McuId id : start.mcus) {
    OfMcu& its = mcus_[id];
    for (const MotorId motor : its.run->motors) kept_.not_wanted(motor);
    its.last_number = its.last_number == UINT8_MAX ? 1 : its.last_number + 1;
    if (its.last_number == view(id).state.number) {
      its.last_number = its.last_number == UINT8_MAX ? 1 : its.last_number + 1;
    }
    its.run->number = its.last_number;
    its.run->asked = true;
    its.run->forbidden_before = forbidden(id);
    programs.run_program(installation_[id].on_bus(), its.run->number, at);
  }
  const std::int64_t ticks = at - first.bus().tick_at(now_us);
  start.confirmed_by_us =
      now_us + ticks * installation_.bus_of(first).config.tick_us * kConfirmedIn / kConfirmedOf;
}

// Whether it is over: all have begun, or none does.
bool Programs::follow(std::int64_t now_us, Start& start) {
  if (!start.confirmed_by_us) {
    const Ready ready = make_ready(now_us, start);
    if (ready == Ready::kNow) begin(now_us, start);
    return ready == Ready::kNever;
  }
  const auto of = [this](McuId id) -> const auto& { return mcus_[id].run; };
  if (std::ranges::all_of(start.mcus, [&](McuId id) { return of(id) && of(id)->taken; })) {
    return true;
  }
  const bool one_ended =
      std::ranges::any_of(start.mcus, [&](McuId id) { return !of(id) || of(id)->stop_wanted; });
  if (!one_ended && now_us < *start.confirmed_by_us) return false;
  for (const McuId id : start.mcus) {
    if (!of(id) || of(id)->stop_wanted) continue;
    mcus_[id].run->ended_by =
        one_ended ? "another program that was to begin with it did not"
                  : "not every MCU was known to have got its start in time; run it again";
    mcus_[id].run->stop_wanted = true;
  }
  return true;
}

void Programs::give_up(const Start& start, Outcome outcome, const std::string& reason) {
  for (const McuId id : start.mcus) end(id, outcome, reason);
}

// Precondition: its MCUs have not been asked.
void Programs::give_up_start_of(McuId id, Outcome outcome, const std::string& reason) {
  std::erase_if(starts_, [&](const Start& start) {
    if (std::ranges::find(start.mcus, id) == start.mcus.end()) return false;
    give_up(start, outcome, reason);
    return true;
  });
}

void Programs::end_overtaken(std::int64_t) {
  std::erase_if(starts_, [this](const Start& start) {
    if (start.confirmed_by_us) return false;
    std::vector<MotorId> all;
    for (const McuId id : start.mcus) {
      all.insert(all.end(), mcus_[id].run->motors.begin(), mcus_[id].run->motors.end());
    }
    const auto by = open_.precedence().overtaken(start.asker.after_stops, all);
    if (!by) return false;
    open_.stopped_by(all, by->by);
    give_up(start, Outcome::kStopped, kStoppedBefore);
    return true;
  });
}

// -- what runs

void Programs::step(std::int64_t now_us) {
  std::erase_if(starts_, [&](Start& start) { return follow(now_us, start); });
  for (const McuId id : installation_.mcus()) {
    if (mcus_[id].upload) follow_upload(now_us, id);
    if (mcus_[id].erase) follow_erase(now_us, id);
    follow(id);
  }
}

std::int64_t Programs::next_wake_us() const {
  std::int64_t wake = INT64_MAX;
  for (const Start& start : starts_) wake = std::min(wake, start.confirmed_by_us.value_or(wake));
  for (const McuId id : installation_.mcus()) {
    const OfMcu& its = mcus_[id];
    if (its.upload) wake = std::min(wake, its.upload->stored_by_us.value_or(wake));
    if (its.erase) wake = std::min(wake, its.erase->stored_by_us.value_or(wake));
  }
  return wake;
}

Programs::Forbidden Programs::forbidden(McuId id) const {
  const bushd_report& report = installation_[id].report();
  return {.positive = report.forbidden_positive, .negative = report.forbidden_negative};
}

// A program of before this daemon, or of before its MCU was lost.
void Programs::adopt(McuId id) {
  const Mcu& mcu = installation_[id];
  const bushd_program_state& state = view(id).state;
  const bool without_host = (state.flags & BUSHD_PROGRAM_WITHOUT_HOST) != 0;
  Run run{.number = state.number,
          .asked = true,
          .known = false,
          .without_host = without_host,
          .taken = true};
  for (const MotorId motor : mcu.motors()) {
    if (!has_bit(state.motors, installation_[motor].output())) continue;
    if (installation_[motor].has_plan()) continue;
    installation_[motor].give_to_mcu(motion::InProgram{});
    run.motors.push_back(motor);
  }
  const bool at_power_on = (state.flags & BUSHD_PROGRAM_AT_POWER_ON) != 0;
  const bool goes_on = without_host && mcu.config.programs_without_host &&
                       (!at_power_on || mcu.config.programs_at_power_on);
  run.stop_wanted = !goes_on;
  outputs_.log(LogLevel::kWarning, id,
               fmt::format("MCU {}: a program of before, with the checksum {:08x}, {}{}",
                           mcu.name(), state.crc, goes_on ? "goes on" : "is stopped",
                           at_power_on ? "; it begins whenever the power comes" : ""));
  mcus_[id].run = std::move(run);
  installation_.changed = true;
}

// An MCU that answers hears of a stop, also while it is not configured.
void Programs::follow(McuId id) {
  const Mcu& mcu = installation_[id];
  OfMcu& its = mcus_[id];
  if (mcu.offers.programs == nullptr) return;
  if (mcu.offline() || !view(id).known) {
    if (its.run) its.run->stop_asked = its.run->pause_asked = false;
    return;
  }
  if (its.kept && mcu.online() && !mcu.busy()) know_again(id);
  if (!its.run && view(id).under_way() && !installation_.shutting_down) adopt(id);
  if (!its.run || !its.run->asked) return;
  Run& run = *its.run;
  const bushd_program_state& state = view(id).state;
  if (state.number == run.number && state.stage >= BUSHD_PROGRAM_WAITS) run.taken = true;
  if (run.stop_wanted && !std::exchange(run.stop_asked, true)) {
    return mcu.offers.programs->stop_program(mcu.on_bus(), BUSHD_STOP_RAMP);
  }
  if (mcu.online() && !mcu.busy()) follow_end(id);
}

// Precondition: it was asked for, and what is known of its MCU is true now.
void Programs::follow_end(McuId id) {
  const Mcu& mcu = installation_[id];
  Run& run = *mcus_[id].run;
  const bushd_program_state& state = view(id).state;
  if (!run.taken) {
    if (!run.stop_asked) return;
    const Outcome outcome = run.ended_by ? Outcome::kFault : Outcome::kStopped;
    return end(id, outcome, std::string(run.ended_by.value_or(kStoppedBefore)));
  }
  if (state.number != run.number) {
    return end(id, Outcome::kLink, "MCU " + mcu.name() + " restarted while it was under way");
  }
  if (state.stage < BUSHD_PROGRAM_WAITS) {
    return end(id, Outcome::kLink,
               "somebody else has put another program into MCU " + mcu.name() + " meanwhile");
  }
  if (state.stage == BUSHD_PROGRAM_RUNS) run.pause_asked = false;
  if (state.stage != BUSHD_PROGRAM_ENDED) return;
  // Positions of the end, not of before.
  const bushd_report& report = mcu.report();
  if (static_cast<std::int32_t>(report.tick - state.tick) < 0) return;
  if (((report.moving | report.autonomous) & state.motors) != 0) return;
  // A travel begins at one switch, and the other one may cut it.
  const Forbidden now = forbidden(id);
  const Forbidden& before = run.forbidden_before;
  const unsigned positive = now.positive & ~before.positive;
  const unsigned negative = now.negative & ~before.negative;
  for (const MotorId motor : run.motors) {
    const bool met = has_bit(positive | negative, installation_[motor].output());
    if (!met || installation_.config()[motor].limit_action != BUSHD_STOP_IMMEDIATE) continue;
    installation_[motor].trust().is_uncertain(
        "it was stopped immediately at its limit switch and may have overrun");
  }
  ProgramEnd ending = end_of_program(state, mcu);
  if (run.ended_by) ending = {Outcome::kFault, *run.ended_by};
  end(id, ending.outcome, ending.reason + where(id));
}

void Programs::end(McuId id, Outcome outcome, const std::string& reason) {
  const Run run = *std::exchange(mcus_[id].run, std::nullopt);
  if (outcome != Outcome::kReached && outcome != Outcome::kStopped) {
    outputs_.log(LogLevel::kWarning, id,
                 "MCU " + installation_[id].name() + ": its program has ended: " + reason);
  }
  for (const MotorId motor : run.motors) {
    kept_.not_wanted(motor);
    installation_[motor].take_from_mcu(motion::InProgram{});
    if (run.known) open_.end(motor, outcome, reason);
  }
  installation_.changed = true;
}

void Programs::refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) {
  auto& run = mcus_[mcu.id].run;
  if (type != BUSHD_MSG_PROGRAM || !run || !run->asked) return;
  if (run->taken) {
    // A pause before its first tick, or of one that has just ended.
    if (std::exchange(run->pause_asked, false)) run->stop_wanted = true;
    return;
  }
  const std::string reason =
      "MCU " + mcu.name() + " refused to run it: " + bushd_status_text(status);
  if (status != BUSHD_E_LATE) return end(mcu.id, Outcome::kFault, reason);
  // It may have been taken all the same, and is being stopped.
  if (!run->ended_by) run->ended_by = reason;
  run->stop_wanted = run->stop_asked = true;
}

// The MCU begins it whatever this configuration says, so somebody has to erase it.
void Programs::warn_of_power_on(const Mcu& mcu) {
  if (mcu.offers.programs == nullptr || !view(mcu.id).known) return;
  const bushd_program_state& state = view(mcu.id).state;
  if ((state.flags & BUSHD_PROGRAM_AT_POWER_ON) == 0 || mcu.config.programs_at_power_on) return;
  outputs_.log(LogLevel::kWarning, mcu.id,
               fmt::format("MCU {} has a program that begins whenever its power comes, and "
                           "programs_at_power_on does not allow it; erase it: 'bushctl program "
                           "erase {:08x}'",
                           mcu.name(), state.crc));
}

// Another firmware, or one that denies programs: nobody will tell what has become of it.
void Programs::goes_online(Mcu& mcu) {
  warn_of_power_on(mcu);
  if (!mcus_[mcu.id].run || mcu.can_have_program()) return;
  end(mcu.id, Outcome::kLink, "MCU " + mcu.name() + " came back and knows no programs");
}

void Programs::goes_offline(Mcu& mcu, const std::string& cause) {
  OfMcu& its = mcus_[mcu.id];
  if (its.upload) end_upload(mcu.id, fail(cause));
  if (its.erase) {
    std::exchange(its.erase, std::nullopt)
        ->asker.answer(api::Completed{.outcome = Outcome::kLink, .reason = cause, .detail = {}});
  }
  if (!its.run) return;
  Run& run = *its.run;
  run.stop_asked = run.pause_asked = false;
  if (!run.asked) return give_up_start_of(mcu.id, Outcome::kLink, cause);
  if (!run.without_host) {
    return end(mcu.id, Outcome::kLink, cause + "; its program ends as soon as it hears no host");
  }
  if (!run.taken) {
    run.stop_wanted = true;
    run.ended_by = cause + " before it was known to have begun";
  }
  outputs_.log(LogLevel::kWarning, mcu.id,
               "MCU " + mcu.name() + ": its program goes on without a host" +
                   (run.stop_wanted ? "; it is stopped as soon as the MCU is heard" : ""));
}

// -- stop, pause, resume

void Programs::stop(MotorId motor) {
  const McuId id = installation_.mcu_of(motor).id;
  auto& run = mcus_[id].run;
  if (!run || !installation_[motor].is<motion::InProgram>()) return;
  if (run->asked) {
    run->stop_wanted = true;
    return follow(id);
  }
  give_up_start_of(id, Outcome::kStopped, kStoppedBefore);
}

bool Programs::is_paused(MotorId motor) const {
  const Mcu& mcu = installation_.mcu_of(motor);
  return installation_[motor].is<motion::InProgram>() && mcu.can_have_program() && !mcu.busy() &&
         view(mcu.id).state.stage == BUSHD_PROGRAM_PAUSED;
}

void Programs::pause(MotorId motor) {
  const Mcu& mcu = installation_.mcu_of(motor);
  auto& run = mcus_[mcu.id].run;
  if (!run || !mcu.online()) return;
  if (!run->taken) return stop(motor);  // nothing has moved
  if (!std::exchange(run->pause_asked, true)) mcu.offers.programs->pause_program(mcu.on_bus());
}

// It moves all its motors.
Result<void> Programs::may_resume(MotorId motor) const {
  if (auto may = interlocks_.may_begin(motor); !may) return may;
  for (const MotorId other : mcus_[installation_.mcu_of(motor).id].run->motors) {
    const motion::Motor& its = installation_[other];
    if (its.hold().is_set()) {
      return fail(its.name() + ": " + its.hold().text() + "; run " +
                  words::remedy("release", its.name()) + " first");
    }
  }
  return {};
}

void Programs::resume(MotorId motor) {
  if (!is_paused(motor)) return;
  const Mcu& mcu = installation_.mcu_of(motor);
  mcus_[mcu.id].run->pause_asked = false;
  mcu.offers.programs->resume_program(mcu.on_bus());
}

void Programs::leave() {
  for (const McuId id : installation_.mcus()) {
    const auto& run = mcus_[id].run;
    if (!run || !run->taken || run->stop_wanted || !run->without_host) continue;
    end(id, Outcome::kLink, "the daemon ends, and its program goes on by itself");
  }
}

bool Programs::at_rest() const {
  return std::ranges::none_of(installation_.mcus(), [this](McuId id) {
    return mcus_[id].run && !installation_[id].offline();
  });
}

}  // namespace bushd::daemon
