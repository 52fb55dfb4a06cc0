#include "daemon/services/waiting_requests.h"

#include <algorithm>
#include <utility>

#include "base/output_bits.h"
#include "base/overloaded.h"
#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

bool has_common(const std::vector<MotorId>& a, const std::vector<MotorId>& b) {
  return std::ranges::any_of(a,
                             [&](MotorId motor) { return std::ranges::find(b, motor) != b.end(); });
}

// Longer than an MCU has ticks ahead.
constexpr std::int64_t kMostTicksUs = 1'000'000;

bool waits_for_trigger(const api::Request& request) {
  return std::holds_alternative<api::Arm>(request) || std::holds_alternative<api::ArmLine>(request);
}

}  // namespace

std::optional<std::vector<MotorId>> WaitingRequests::motors_of(const api::Request& request) const {
  using Motors = Result<std::vector<MotorId>>;
  const auto found = std::visit(
      Overloaded{
          [&](const api::MovePath& r) -> Motors {
            // When all of its points are here.
            const std::size_t rows = r.positions.size() / std::max<std::size_t>(r.motors.size(), 1);
            const bool last =
                r.first_row >= 0 && r.rows >= 0 &&
                static_cast<std::size_t>(r.first_row) + rows >= static_cast<std::size_t>(r.rows);
            return r.dry_run || !last ? Motors() : installation_.find(r.motors);
          },
          [&](const api::Follow& r) -> Motors {
            return r.part == api::Follow::Part::kRun ? installation_.find(r.motors) : Motors();
          },
          [&](const api::Jog& r) -> Motors {
            const bool begins = r.per_s != 0 && !r.renew;
            return begins ? installation_.find(api::MotorNames{r.motor}) : Motors();
          },
          [&](const auto& r) -> Motors {
            if constexpr (requires { r.dry_run; }) {
              if (r.dry_run) return {};
            }
            // It moves each by an amount, or to one, or says that it stands there.
            if constexpr (requires { r.motors.front().amount; })
              return installation_.find(r.motors);
            return {};
          }},
      request);
  if (!found || found->empty() || !interlocks_.may_move()) return std::nullopt;
  const bool moves = !std::holds_alternative<api::SetPosition>(request);
  // What is refused anyway leaves the disk alone.
  for (const MotorId motor : *found) {
    const bool may =
        moves ? interlocks_.may_move(motor) && !installation_[motor].trust().uncertain_reason()
              : installation_.mcu_of(motor).online();
    if (!may) return std::nullopt;
  }
  return *found;
}

bool WaitingRequests::any_held(const std::vector<MotorId>& motors) const {
  return std::ranges::any_of(held_,
                             [&](const Held& held) { return has_common(held.motors, motors); });
}

bool WaitingRequests::is_refused_anyway(const api::Request& request,
                                        const std::vector<MotorId>& motors) const {
  const auto changes = [this](MotorId motor) { return kept_.being_restored(motor); };
  return !any_held(motors) && std::ranges::none_of(motors, changes) && !would_take_(request);
}

// It has ticks of the motor that are to pass, though by plan the motor stands: its MCU would not
// arm it yet.
bool WaitingRequests::has_ticks(MotorId id) const {
  const Mcu& mcu = installation_.mcu_of(id);
  return mcu.online() && installation_[id].is<motion::Resting>() &&
         has_bit(mcu.report().moving, installation_[id].output());
}

Result<bool> WaitingRequests::make_ready(std::int64_t now_us, Held& held) {
  const auto room = line_room_.has_room(held.request, held.motors);
  if (!room || !*room) return room;
  const bool may_have_ticks =
      waits_for_trigger(held.request) && now_us < held.since_us + kMostTicksUs;
  bool ready = !may_have_ticks || std::ranges::none_of(held.motors, [this](MotorId motor) {
    return has_ticks(motor);
  });
  const bool moves = !std::holds_alternative<api::SetPosition>(held.request);
  for (const MotorId motor : held.motors) {
    const McuId mcu = installation_.config()[motor].mcu;
    if (moves && !idle_drivers_.make_ready(now_us, mcu)) ready = false;
    const auto one = kept_.make_ready(now_us, motor);
    if (!one) return fail(installation_[motor].name() + ": " + one.error().text());
    ready = ready && *one;
  }
  // When the line's motors are known to be where they are.
  return ready && line_tables_.make_ready(now_us, held.request, held.table);
}

bool WaitingRequests::hold(std::int64_t now_us, const api::Asker& asker,
                           const api::Request& request) {
  const bool may_wait = kept_.keeps() || !idle_drivers_.none() || LineTables::concerns(request) ||
                        line_room_.concerns_any() || waits_for_trigger(request);
  if (!may_wait && held_.empty()) return false;
  auto motors = motors_of(request);
  if (!motors || is_refused_anyway(request, *motors)) return false;
  Held held{.asker = asker, .request = request, .motors = std::move(*motors), .since_us = now_us};
  if (held_.size() >= kMostHeld) {
    asker.answer(
        api::Refused{"too many requests wait for the disk or the line; try again in a moment"});
    return true;
  }
  // What comes later for a motor is carried out later.
  if (!any_held(held.motors)) {
    const auto ready = make_ready(now_us, held);
    if (!ready) {
      refuse(held, ready.error().text());
      return true;
    }
    if (*ready) {
      for (const MotorId motor : held.motors) kept_.not_wanted(motor);
      return false;
    }
  }
  held_.push_back(std::move(held));
  return true;
}

void WaitingRequests::waits_no_more(Held& held) {
  line_tables_.end(held.table);
  for (const MotorId motor : held.motors) kept_.not_wanted(motor);
}

void WaitingRequests::refuse(Held& held, const std::string& reason) {
  waits_no_more(held);
  held.asker.answer(api::Refused{reason});
}

bool WaitingRequests::is_let_go(std::int64_t now_us, const Held& held) {
  const auto* jog = std::get_if<api::Jog>(&held.request);
  if (jog == nullptr) return false;
  const std::int64_t keepalive_ms = std::max(jog->keepalive_ms, api::Jog::kKeepaliveMs.least);
  return now_us >= held.since_us + keepalive_ms * 1000 ||
         (held.asker.session && held.asker.session->gone());
}

void WaitingRequests::end_overtaken(std::int64_t) {
  std::erase_if(held_, [this](Held& held) {
    // It moves nothing; but with the daemon it ends too.
    const bool sets = std::holds_alternative<api::SetPosition>(held.request);
    if (sets && !installation_.shutting_down) return false;
    const auto by = open_moves_.precedence().overtaken(held.asker.after_stops, held.motors);
    if (!by) return false;
    waits_no_more(held);
    open_moves_.not_begun(held.asker, *by);
    return true;
  });
}

void WaitingRequests::step(std::int64_t now_us) {
  std::vector<MotorId> before;
  for (auto it = held_.begin(); it != held_.end() && !busy_();) {
    const bool in_turn = !has_common(it->motors, before);
    // What became impossible meanwhile is refused by who carries it out.
    const bool possible = motors_of(it->request).has_value();
    const auto ready = !in_turn   ? Result<bool>(false)
                       : possible ? make_ready(now_us, *it)
                                  : Result<bool>(true);
    if (ready && !*ready) {
      before.insert(before.end(), it->motors.begin(), it->motors.end());
      ++it;
      continue;
    }
    Held held = std::move(*it);
    it = held_.erase(it);
    line_tables_.end(held.table);
    if (is_let_go(now_us, held)) {
      refuse(held,
             "its client was silent for longer than its keepalive time while the jog waited "
             "to begin; nothing has moved");
      continue;
    }
    if (!ready) {
      refuse(held, ready.error().text());
      continue;
    }
    for (const MotorId motor : held.motors) kept_.not_wanted(motor);
    carry_out_(now_us, held.asker, held.request);
  }
}

}  // namespace bushd::daemon
