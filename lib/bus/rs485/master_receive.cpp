// What answers, their absence and changes of an MCU's phase mean, and for which machine.
#include <algorithm>

#include "bus/bus_times.h"
#include "bus/rs485/master.h"

namespace bushd::link {
namespace {

template <class Message>
bool decoded(const Transactions::Answer& answer,
             bushd_status (*decode)(const std::uint8_t*, std::size_t, Message*), Message* message) {
  return decode(answer.payload.data(), answer.payload.size(), message) == BUSHD_OK;
}

// Together with the report of this number, 0: with none. One with news alone has the number after
// that: otherwise it answers somebody else, by chance under the same sequence number.
bool follows(std::uint8_t known, const bushd_report& report) {
  if (bushd_report_is_whole(&report)) return true;
  return known != 0 && report.number == known % UINT8_MAX + 1;
}

// The ticks from which an MCU has no data, unwrapped. Never before the present tick, whatever the
// line says: ticks executed cannot be asked for again.
void unwrap_known_until(McuView& view) {
  const bushd_report& report = view.report;
  for (unsigned m = 0; m < report.motor_count; ++m) {
    const auto ahead = static_cast<std::int16_t>(report.motor[m].known_until -
                                                 static_cast<std::uint16_t>(report.tick));
    view.known_until[m] = view.tick + std::max<std::int16_t>(ahead, 0);
  }
}

}  // namespace

void Rs485Master::overheard(std::int64_t now_us, const bushd_frame& frame) {
  synchroniser_.overheard(now_us, frame);
}

bool Rs485Master::answered(std::int64_t now_us, const Transactions::Answer& answer) {
  heard_ = true;
  poller_.answered(answer.mcu);
  switch (answer.type) {
    case BUSHD_MSG_POLL: {
      const McuRecord& mcu = mcus_[answer.mcu];
      bushd_report report = mcu.known != 0 ? mcu.view.report : bushd_report{};
      if (mcu.known == 0) report.motor_count = BUSHD_MOTORS_PER_MCU;
      if (!decoded(answer, bushd_decode_report, &report)) return false;
      const bool restarted = report.boot_number != mcu.view.identity.boot_number;
      if (report.number == 0 && !restarted) return poller_.no_room(answer.mcu);
      if (!restarted && !follows(mcu.known, report)) return false;
      handle_report(now_us, answer, report);
      return true;
    }
    case BUSHD_MSG_IDENTIFY: {
      bushd_identity identity;
      if (!decoded(answer, bushd_decode_identity, &identity)) return false;
      connector_.identity(identity);
      return true;
    }
    case BUSHD_MSG_TABLES: {
      bushd_tables held;
      if (!decoded(answer, bushd_decode_tables, &held)) return false;
      connector_.tables(answer.mcu, held, !emergency_.active());
      return true;
    }
    case BUSHD_MSG_PROGRAM_STATE: {
      bushd_program_state state;
      if (!decoded(answer, bushd_decode_program_state, &state)) break;  // a refusal
      connector_.program_told(now_us, answer.mcu, state);
      return true;
    }
    default:
      break;
  }
  bushd_acknowledgement message;
  if (!decoded(answer, bushd_decode_acknowledgement, &message)) return false;
  connector_.acknowledged(now_us, answer.mcu, answer.type, message.status);
  return true;
}

bool Rs485Master::unanswered(std::int64_t now_us, McuIndex mcu, std::uint8_t type) {
  if (mcus_[mcu].view.phase == McuPhase::kOffline) {
    connector_.not_found(now_us, mcu);
    return false;
  }
  if (poller_.missed(now_us, mcu, type)) connector_.give_up_unanswering(now_us, mcu);
  ask_again_for_start(now_us, mcu);
  return true;
}

// A first frame was lost, or the answer that would have told of it.
void Rs485Master::ask_again_for_start(std::int64_t now_us, McuIndex mcu) {
  if (!streams_.start_is_open(mcu)) return;
  repair_time_.missed(now_us);
  mcus_[mcu].poll_wanted = true;
}

void Rs485Master::ended(std::int64_t now_us, McuIndex mcu, std::uint8_t type) {
  if (type == BUSHD_MSG_POLL) poller_.ended(now_us);
  if (type == BUSHD_MSG_IDENTIFY) connector_.identify_ended(now_us, mcu);
}

void Rs485Master::handle_report(std::int64_t now_us, const Transactions::Answer& answer,
                                const bushd_report& report) {
  const McuIndex index = answer.mcu;
  McuRecord& mcu = mcus_[index];
  McuView& view = mcu.view;
  if (view.phase == McuPhase::kOffline) return;
  if (report.boot_number != view.identity.boot_number) {
    ++mcu.health.restarts;
    view.identity.boot_number = report.boot_number;
    connector_.give_up(index, "restarted", now_us);
    return;
  }
  view.report = report;
  view.reported = true;
  mcu.known = report.number;
  mcu.answered = false;
  view.outdated_us = 0;
  poller_.follow_report(now_us, index);
  connector_.follow_stop(index);
  constexpr unsigned kSwitchedOff = BUSHD_FAULT_OVERCURRENT | BUSHD_FAULT_DISABLED;
  if ((report.faults & kSwitchedOff) != 0) connector_.drivers_off(index);
  synchroniser_.expect_own_time(index, connector_.may_have_own_time(index));
  const auto agreement = synchroniser_.follow_report(now_us, index, answer.line_us, answer.in_time);
  if (agreement == Synchroniser::Agreement::kOtherTime && view.phase == McuPhase::kOnline) {
    // Moves are planned in the bus's time: who counts otherwise has to be told it before it gets
    // any, and of those it has got nothing holds.
    connector_.give_up(index, "counts other ticks than before", now_us);
    return;
  }
  unwrap_known_until(view);
  const bool in_step = agreement == Synchroniser::Agreement::kInStep;
  if (view.phase == McuPhase::kConnecting) {
    const bool listens =
        synchroniser_.perhaps_another(now_us) && !synchroniser_.two_masters(now_us);
    connector_.follow_report(now_us, index, in_step && !listens);
    return;
  }
  if (!in_step && (report.flags & BUSHD_FLAG_CONFIGURED) == 0) {
    connector_.give_up(index, "lost its configuration", now_us);
    return;
  }
  streams_.follow_report(index);
  ask_again_for_start(now_us, index);
  ask_at_end(now_us, index);
  events_.push_back(McuReported{index});
  if (connector_.has_more_to_tell(index) && streams_.active(index) == 0) {
    reconfigure(index, mcu.setup);
  }
}

// The master's clock lags behind the MCU's, or leads by what crystals drift at most. A motor that
// rests by its plan may be on a line that goes on elsewhere: its MCU is asked again at the ends of
// others.
void Rs485Master::ask_at_end(std::int64_t now_us, McuIndex mcu) {
  constexpr std::int64_t kMostDriftUs = 200;
  std::optional<Tick> end = streams_.next_end(mcu);
  if (!end && streams_.active(mcu) != 0) {
    for (const McuIndex i : mcus_.indices()) end = std::max(end, streams_.next_end(i));
  }
  // What lies farther ahead the next report asks for.
  const Tick soon = clock().tick_at(now_us) + clock().ticks_in(2 * fieldbus::kPollPeriodUs);
  const auto known_us = [&](std::optional<Tick> tick) {
    return tick && *tick <= soon ? clock().begin_us(*tick) + kMostDriftUs : INT64_MAX;
  };
  poller_.expect_motion(mcu, streams_.active(mcu), known_us(streams_.last_end(mcu)));
  poller_.expect_news(mcu, known_us(end));
}

void Rs485Master::found(std::int64_t now_us, McuIndex) {
  synchroniser_.hurry(now_us);
}

void Rs485Master::came_online(McuIndex mcu) {
  streams_.came_online(mcu);
  events_.push_back(McuOnline{mcu});
}

void Rs485Master::went_offline(McuIndex mcu, bool was_online) {
  poller_.went_offline(mcu);
  streams_.drop_all(mcu);
  if (was_online) events_.push_back(McuOffline{mcu});
}

void Rs485Master::refused(McuIndex mcu, std::uint8_t type, std::uint8_t status) {
  events_.push_back(RequestRefused{.mcu = mcu, .type = type, .status = status});
}

void Rs485Master::program_reported(McuIndex mcu) {
  events_.push_back(ProgramReported{mcu});
}

}  // namespace bushd::link
