// The part of the witness that is about CAMAC modules: what they ask for is in no request of a
// client, and they get the results.
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "daemon/services/camac_motors.h"
#include "own_ramp.h"
#include "witness.h"

namespace bushfaults {

void Witness::lam(TimeNs now_ns, const bushd::api::CamacLam& lam) {
  recent_.note(now_ns, fmt::format("  LAM of {:#x}", lam.raised));
  if (const auto wrong = crates_.raised(now_ns, lam)) violated(now_ns, *wrong);
  if (const auto wrong = shutter_.raised(lam)) violated(now_ns, *wrong);
}

// "camac-1-5: m07: why": of a motion of BUSHD-2 that did not end as it was asked for. Of one that
// stood, paused, the log of moves says nothing more.
void Witness::log(const std::string& text) {
  const std::string of_module = std::string(Crates::kBushd2Client) + ": ";
  if (!text.starts_with(of_module)) return;
  const std::size_t begin = of_module.size();
  Motor* motor = find(text.substr(begin, text.find(':', begin) - begin));
  if (motor == nullptr || !is_of_module(*motor) || !motor->over) return;
  motor->move.reset();
  motor->pauses = motor->goes_on = false;
  crates_.motion_ended(false);
}

void Witness::trigger(TimeNs now_ns, std::size_t mcu, bool rising) {
  starts_.trigger(now_ns, mcu, rising);
  const auto motor = ShutterPlace::motor(config_);
  if (motor && config_[*motor].mcu.value == mcu) shutter_.trigger(now_ns, rising);
}

void Witness::shutter_stepped(TimeNs now_ns, bool right, std::int64_t stands) {
  const bool second = second_ns_ >= 0 && now_ns - second_ns_ < 5'000'000'000;
  if (second) shutter_.disturbed();
  if (const auto wrong = shutter_.stepped(now_ns, right, stands)) {
    violated(now_ns, "the shutter: " + *wrong);
  }
}

void Witness::crate_answered(TimeNs now_ns, const Request& request,
                             const bushd::api::CamacResult& result) {
  if (const auto wrong = crates_.completed(now_ns, request, result)) {
    return violated(now_ns, *wrong);
  }
  if (request.block_mode != bushd::camac::BlockMode::kSingle) return;
  shutter_.begin_block();
  for (std::size_t i = 0; i < request.cycles.size(); ++i) {
    const auto wrong = shutter_.cycle(now_ns, request.cycles[i], result.block.responses[i]);
    if (wrong) {
      return violated(
          now_ns, fmt::format("BUSHD-1, cycle {} of {}: {}", i + 1, request.cycles.size(), *wrong));
    }
  }
  const bool lam = (result.requests >> (kBushd1Station - 1) & 1) != 0;
  if (const auto wrong = shutter_.observe(lam)) violated(now_ns, "BUSHD-1: " + *wrong);
}

void Witness::asked_by_module(TimeNs now_ns, const std::string& client, const std::string& what,
                              const std::string& motor) {
  const bool of_shutter = client == ShutterModel::kClient;
  if (!of_shutter && client != Crates::kBushd2Client) return;
  recent_.note(now_ns, fmt::format("  {} of {}: {}", what, client, motor));
  if (of_shutter && what == "move") return shutter_moves(now_ns, *find(motor));
  const bool on_line = what == "move line";  // its MCU has another table
  if (what == "move" || on_line) {
    return module_moves(now_ns, *find(motor), crates_.accepted(motor), on_line);
  }
  Request stop{.client = client, .ask = Ask::kStop};
  stop.add(motor, 0);
  stop_accepted(stop);
}

// From now on it is a move as everybody's, but that nobody hears its result.
void Witness::module_moves(TimeNs now_ns, Motor& motor, const Crates::Accepted& accepted,
                           bool on_line) {
  if (accepted.wrong) return violated(now_ns, *accepted.wrong);
  program_ = accepted.motion;
  Request request{.client = Crates::kBushd2Client,
                  .number = ++module_moves_,
                  .ask = Ask::kMoveBy,
                  .line = on_line,
                  .unknown_way = !program_};
  request.add(motor.name, program_ ? program_->steps : 0);
  if (program_) {
    const auto& module = config_.crates.front().modules.front();
    const bushd::config::Bus& bus = config_.buses.front();
    const auto table = bushd::daemon::table_of_program(program_->program, module.f_start_hz, "");
    if (!table || !bushd::daemon::falls_to_the_middle(program_->program)) {
      return violated(now_ns, motor.name + " moves by codes that rise");
    }
    motor.own_ramp_excess = std::max(
        motor.own_ramp_excess, own_ramp_excess((*table)->view(), bus.tick_us * 1000, bus.format));
  }
  asks(now_ns, request);
}

// A step: its direction is known by who has started it.
void Witness::shutter_moves(TimeNs now_ns, Motor& motor) {
  Request request{.client = ShutterModel::kClient,
                  .number = ++module_moves_,
                  .ask = Ask::kMoveBy,
                  .unknown_way = true};
  request.add(motor.name, 0);
  asks(now_ns, request);
}

// A module's own request. It is accepted already, and nobody hears its result; of earlier ones only
// those that still move a motor are known.
void Witness::asks(TimeNs now_ns, const Request& request) {
  std::erase_if(asked_, [&](const auto& entry) {
    const bool its = std::get<1>(entry.first) == request.client;
    return its && std::ranges::none_of(
                      motors_, [&](const Motor& other) { return other.move == entry.first; });
  });
  const Key key = key_of(request.id());
  Asked& asked = asked_[key];
  asked = Asked{.request = request,
                .since_ns = now_ns,
                .due_since_ns = now_ns,
                .accepted = true,
                .finished = true};
  this->accepted(now_ns, key, asked);
}

void Witness::module_ended(TimeNs now_ns, Motor& motor, const End& end, bool whole) {
  const bool reached = end.word == "reached";
  const bool on_line = asked_.at(*motor.move).request.line;
  ++moves_by_result_[(on_line ? "camac streamed " : "camac ") + end.word];
  const std::size_t of = index_of(motor);
  const bool approach = units_.backlash_steps(of) != 0;
  const Request& request = asked_.at(*motor.move).request;
  if (reached && whole) {
    check_program(now_ns, motor, approach ? units_.approach_shortest_delay_ns(of, request) : 0);
  }
  crates_.motion_ended(reached);
  motor.move.reset();
}

// From its first step to its last it has taken the time of its codes, of which none is shorter than
// the shortest delay, rounded up to a code. Ticks are emitted up to 1/64 faster or slower while an
// MCU is brought into step, each of the two steps is up to a tick off, and the last one may be late
// by one more (sim/pace.h).
void Witness::check_program(TimeNs now_ns, const Motor& motor, TimeNs shortest_delay_ns) {
  if (!program_ || std::abs(program_->steps) < 2) return;
  const TimeNs tick_ns = config_.buses.front().tick_ns();
  TimeNs due_ns = 0;
  TimeNs rounding_ns = 0;
  for (const TimeNs delay_ns : program_->delays_ns) {
    due_ns += std::max(delay_ns, shortest_delay_ns);
    if (delay_ns < shortest_delay_ns) rounding_ns += program_->unit_ns;
  }
  const TimeNs took_ns =
      plant_.last_step_ns(motor.mcu, motor.output) - plant_.first_step_ns(motor.mcu, motor.output);
  const TimeNs drift_ns = due_ns / 63;
  const TimeNs latest_ns = due_ns + rounding_ns + drift_ns + 3 * tick_ns;
  if (took_ns >= due_ns - drift_ns - 2 * tick_ns && took_ns <= latest_ns) return;
  violated(now_ns, fmt::format("{} made {} steps of a program in {} us, not in {}", motor.name,
                               program_->steps, took_ns / 1000, due_ns / 1000));
}

}  // namespace bushfaults
