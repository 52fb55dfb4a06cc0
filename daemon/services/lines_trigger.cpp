// Lines that wait for a trigger: their MCUs hold the run, and each begins it by the edge at its own
// input (docs/decisions/0048-triggered-lines.md). When all have begun it is a line like any other.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <utility>

#include "daemon/services/lines.h"
#include "daemon/services/trigger.h"
#include "words/remedy.h"

namespace bushd::daemon {

void Lines::request(const api::Asker& asker, const api::ArmLine& request) {
  auto line = line_to_arm(request);
  if (!line) return asker.answer(api::Refused{line.error().text()});
  asker.answer(api::Accepted{});
  const std::uint64_t number = ++last_number_;
  line->straight()->trigger.emplace();
  open(asker, number, *line);
  Line& kept = lines_.emplace(number, std::move(*line)).first->second;
  log(kept);
  arm(request, number, kept);
}

api::MoveLine Lines::as_move(const api::ArmLine& request) {
  return {.kind = request.kind,
          .motors = request.motors,
          .speed = request.speed,
          .duration_s = request.duration_s};
}

Result<Line> Lines::line_to_arm(const api::ArmLine& request) const {
  const auto motors = installation_.find(request.motors);
  if (!motors) return fail(motors.error());
  for (const MotorId id : *motors) {
    const motion::Motor& motor = installation_[id];
    if (!motor.has_plan()) continue;
    return fail(motion::busy_text(motor) + "; run " +
                words::remedy(motor.moves() ? "stop" : "disarm", motor.name()) + " first");
  }
  if (const auto delay = check_trigger_delay(request.delay_us); !delay) return fail(delay.error());
  auto line = line_of(as_move(request));
  if (!line) return line;
  for (std::size_t i = 0; i < line->motors.size(); ++i) {
    if (line->straight()->way.increment(i) != 0) continue;
    return fail(installation_[line->motors[i]].name() +
                ": a move of no steps; leave it out, as a trigger cannot begin that");
  }
  if (const auto may = may_wait(*line); !may) return fail(may.error());
  return line;
}

Result<void> Lines::may_wait(const Line& line) const {
  const motion::Way& way = line.straight()->way;
  for (const McuId id : installation_.mcus_of(line.motors)) {
    const Mcu& mcu = installation_[id];
    if (!mcu.can_arm_lines()) {
      return fail(fmt::format(
          "MCU {} makes no lines that a trigger begins: it has no trigger input, or makes no lines "
          "by itself (LINE_RUN); move them without a trigger, or arm single motors",
          mcu.name()));
    }
    for (const MotorId other : mcu.motors()) {
      const motion::Motor& motor = installation_[other];
      if (motor.is<motion::Armed>()) {
        return fail(fmt::format("{} waits for the trigger of MCU {} already{}; run {} first",
                                motor.name(), mcu.name(), open_.asked_for_by(other),
                                words::remedy("disarm", motor.name())));
      }
      if (motor.is<motion::OnLine>() && motor.axis().line() && motor.axis().line()->in_mcus) {
        return fail(fmt::format(
            "{} moves on a line that MCU {} makes, which has room for one; wait for its result",
            motor.name(), mcu.name()));
      }
    }
    if (auto has_table = check_table(way, mcu); !has_table) return has_table;
    if (!mcu.keeps_up_with(way.table()->view(), way.shortest_delay(), has_all_of(line, mcu))) {
      return fail(fmt::format(
          "MCU {} makes no line as fast as this one by itself; give a lower --speed, or move them "
          "without a trigger",
          mcu.name()));
    }
  }
  return {};
}

// It has been uploaded if that was possible.
Result<void> Lines::check_table(const motion::Way& way, const Mcu& mcu) const {
  const bushd_table& table = way.table()->view();
  if (mcu.has_table(table)) return {};
  const std::string what =
      fmt::format("the line goes by a table of its own, which MCU {} does not have", mcu.name());
  if (!mcu.can_upload(table)) {
    return fail(what +
                ", and has no room for: a line that waits for a trigger needs motors of one table "
                "there, whose ways are equal or a tenth of the longest at most. Move it without a "
                "trigger");
  }
  if (!installation_.rests(mcu)) {
    return fail(what +
                ", and takes only while all its motors rest: wait for their results, or stop them");
  }
  if (const auto takes_us = upload_us(table, installation_.bus_of(mcu).config.baud);
      takes_us > kMostArmedUs) {
    return fail(
        fmt::format("{}, and would take {:.1f} s to get, which is longer than clients wait: "
                    "use a higher baud rate, or move it without a trigger",
                    what, static_cast<double>(takes_us) / 1e6));
  }
  return fail(what + ", and has not taken: try again, or move it without a trigger");
}

void Lines::arm(const api::ArmLine& request, std::uint64_t number, Line& line) {
  const auto edge = request.edge == api::Edge::kRising ? BUSHD_EDGE_RISING : BUSHD_EDGE_FALLING;
  const bushd_delay shortest_delay = line.straight()->way.shortest_delay();
  std::map<McuId, std::vector<link::Trigger::ArmedOnLine>> parts;
  std::vector<motion::LineShare> shares;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    shares.push_back(line.share(i, 0, line.longest()));
    shares.back().line = number;
    shares.back().in_mcus = true;
    shares.back().waits = true;
    const Mcu& mcu = installation_.mcu_of(line.motors[i]);
    parts[mcu.id].push_back({.motor = installation_[line.motors[i]].output().value,
                             .run = mcu.line_run(shares.back(), shortest_delay, 0)});
  }
  std::map<McuId, std::uint8_t> numbers;
  for (const auto& [id, of_mcu] : parts) {
    const Mcu& mcu = installation_[id];
    numbers[id] = mcu.offers.trigger->arm_line(
        mcu.on_bus(), edge, static_cast<std::uint32_t>(request.delay_us), of_mcu);
  }
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    motion::OnLine on_line;
    on_line.line = number;
    on_line.target_steps = line.end_of(i);
    on_line.last_run = line.legs() == 1;
    const McuId mcu = installation_.config()[line.motors[i]].mcu;
    installation_[line.motors[i]].line().arm(numbers[mcu], on_line, std::move(shares[i]),
                                             shortest_delay);
  }
  installation_.changed = true;
}

bool Lines::waits(MotorId motor, std::uint64_t number) const {
  const auto* armed = installation_[motor].as<motion::Armed>();
  return armed != nullptr && armed->on_line && armed->on_line->line == number;
}

// Some of its MCUs have begun in the first reports after the edge, and others are yet to tell.
bool Lines::follow_trigger(std::int64_t now_us, std::uint64_t number, const Line& line,
                           Triggered& trigger) {
  std::vector<MotorId> begun;  // and not over
  std::vector<MotorId> waiting;
  for (const MotorId id : line.motors) {
    note_begin(id, number, trigger);
    if (on_line(id, number) != nullptr) begun.push_back(id);
    if (waits(id, number)) waiting.push_back(id);
  }
  trigger.waits = !waiting.empty();
  if (trigger.begins.empty())
    return !trigger.waits;  // an end of one that waits ends the others (Moves)
  trigger.begun = true;
  if (const auto cause = cause_to_wait_no_more(line, trigger, waiting)) {
    std::erase_if(waiting,
                  [&](MotorId id) { return installation_[id].as<motion::Armed>()->stops; });
    for (const MotorId id : waiting) {
      installation_[id].stop(*cause);
      // It may begin before its MCU hears of that.
      open_.say(id, api::Outcome::kStopped, {api::Outcome::kStopped, "stopped, because " + *cause});
    }
    moves_.stop(now_us, waiting);
    const bool all_stop = std::ranges::all_of(begun, [&](MotorId id) {
      return installation_[id].stops() && !installation_[id].is_paused();
    });
    if (!all_stop) end(now_us, number, line, *cause);
  } else {
    keep_together(now_us, begun);
  }
  return !trigger.waits;
}

// A short line may be over by the report that tells of its beginning.
void Lines::note_begin(MotorId id, std::uint64_t number, Triggered& trigger) const {
  const motion::Axis& axis = installation_[id].axis();
  const bool has_begun = axis.line() && axis.line()->line == number && !axis.line()->waits;
  if (!has_begun ||
      std::ranges::find(trigger.begins, id, &Triggered::Begin::motor) != trigger.begins.end())
    return;
  trigger.begins.push_back({.motor = id, .start = axis.start_tick(), .late_ns = axis.late_ns()});
}

std::optional<std::string> Lines::cause_to_wait_no_more(const Line& line, const Triggered& trigger,
                                                        const std::vector<MotorId>& waiting) const {
  const auto time = [](const Triggered::Begin& begin) {
    return std::pair(begin.start, begin.late_ns);
  };
  const auto [first, last] = std::ranges::minmax_element(trigger.begins, {}, time);
  for (const MotorId id : line.motors) {
    const bool is_left =
        std::ranges::find(trigger.begins, id, &Triggered::Begin::motor) != trigger.begins.end() ||
        std::ranges::find(waiting, id) != waiting.end();
    if (!is_left) return installation_[id].name() + " did not begin with the others";
  }
  for (const MotorId id : waiting) {
    if (installation_[id].as<motion::Armed>()->stops) {
      return installation_[id].name() + " was stopped before it began";
    }
    const Mcu& mcu = installation_.mcu_of(id);
    if (mcu.view().tick <= first->start + 1) continue;
    return fmt::format("the trigger has come to MCU {}, and not to MCU {}",
                       installation_.mcu_of(first->motor).name(), mcu.name());
  }
  const std::int64_t tick_ns = installation_[first->motor].axis().tick_ns();
  const std::int64_t apart_ns =
      (last->start - first->start) * tick_ns + last->late_ns - first->late_ns;
  if (apart_ns <= tick_ns) return std::nullopt;
  return fmt::format("the trigger came to MCU {} {} us later than to MCU {}",
                     installation_.mcu_of(last->motor).name(), apart_ns / 1000,
                     installation_.mcu_of(first->motor).name());
}

// What was asked of those that were known to have begun is for all.
void Lines::keep_together(std::int64_t now_us, const std::vector<MotorId>& begun) {
  std::vector<MotorId> go_on;
  bool stops = false;
  bool by_others = true;  // these stops: nobody has asked for them
  bool paused = false;
  bool resumes = false;
  for (const MotorId id : begun) {
    const motion::Motor& motor = installation_[id];
    if (!motor.stops()) go_on.push_back(id);
    const bool stopped = motor.stops() && !motor.is_paused();
    stops = stops || stopped;
    by_others = by_others && (!stopped || motor.moving()->by_others);
    paused = paused || motor.is_paused();
    resumes = resumes || motor.as<motion::OnLine>()->resumes;
  }
  if (go_on.empty() || (!stops && !paused)) return;
  if (stops) {
    moves_.stop(now_us, begun);
    if (!by_others) return;
    for (const MotorId id : begun) installation_[id].is_stopped_by_others();
    return;
  }
  moves_.pause(now_us, go_on);
  if (resumes) moves_.resume(now_us, go_on);
}

}  // namespace bushd::daemon
