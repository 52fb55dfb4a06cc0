// Receiving: what answers, or their absence, mean for MCUs.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "link/master.h"
#include "link/master_limits.h"

namespace bushd::link {
namespace {

constexpr std::int64_t kPollAgainUs = kPollPeriodUs * 2 / 5;
constexpr std::int64_t kClockJumpUs = 400'000;  // more than any latency: it is another time
// A master says SYNC at least as often; two of them in a row may be lost.
constexpr std::int64_t kOtherMasterUs = 3 * kSyncPeriodUs;

// By how much a counter that stops at its largest value has grown; after a restart it is smaller.
std::uint16_t grown(std::uint16_t now, std::uint16_t before) {
  return static_cast<std::uint16_t>(now >= before ? now - before : now);
}

}  // namespace

void Master::overheard(std::int64_t now_us, const bushd_frame& frame) {
  bushd_sync sync;
  if (frame.type == BUSHD_MSG_SYNC &&
      bushd_decode_sync(frame.payload, frame.payload_size, &sync) == BUSHD_OK &&
      sync.master != setup_.master) {
    other_master_until_us_ = now_us + kOtherMasterUs;
  }
}

bool Master::answered(std::int64_t now_us, const Transactions::Answer& answer) {
  mcus_[answer.mcu].silent = 0;
  const auto decoded = [&answer](auto decode, auto* message) {
    return decode(answer.payload.data(), answer.payload.size(), message) == BUSHD_OK;
  };
  switch (answer.type) {
    case BUSHD_MSG_POLL: {
      bushd_report report;
      if (!decoded(bushd_decode_report, &report)) return false;
      handle_report(now_us, answer, report);
      return true;
    }
    case BUSHD_MSG_IDENTIFY: {
      bushd_identity identity;
      if (!decoded(bushd_decode_identity, &identity)) return false;
      identities_.push_back(identity);
      return true;
    }
    case BUSHD_MSG_TABLES: {
      bushd_tables held;
      if (!decoded(bushd_decode_tables, &held)) return false;
      handle_tables(answer.mcu, held);
      return true;
    }
    default: {
      bushd_acknowledgement acknowledgement;
      if (!decoded(bushd_decode_acknowledgement, &acknowledgement)) return false;
      handle_acknowledgement(now_us, answer.mcu, answer.type, acknowledgement.status);
      return true;
    }
  }
}

bool Master::unanswered(std::int64_t now_us, McuIndex index, std::uint8_t type) {
  Mcu& mcu = mcus_[index];
  if (mcu.view.phase == McuPhase::kOffline) {
    // Each look at a silent MCU costs the line a time-out: the more are silent, the rarer.
    const auto silent = std::count_if(mcus_.begin(), mcus_.end(), [](const Mcu& m) {
      return m.view.phase == McuPhase::kOffline;
    });
    mcu.retry_due_us = now_us + kRetryUs * silent;
    return false;
  }
  ++mcu.health.timeouts;
  if (++mcu.silent >= kMaxSilent) {
    go_offline(index, "does not answer", now_us + kRetryUs);
  } else if (type == BUSHD_MSG_POLL) {
    // Sooner than usual; but a dead MCU must not starve the others.
    mcu.poll_due_us = now_us + kPollAgainUs;
  }
  return true;
}

void Master::ended(std::int64_t now_us, McuIndex mcu, std::uint8_t type) {
  if (type == BUSHD_MSG_IDENTIFY) finish_identify(now_us, mcu);
}

void Master::note_health(Mcu& mcu, const bushd_report& report) {
  McuHealth& health = mcu.health;
  health.crc_errors +=
      grown(report.bad_frames, std::exchange(mcu.crc_errors_told, report.bad_frames));
  health.rejected_frames +=
      grown(report.rejected_frames, std::exchange(mcu.rejected_told, report.rejected_frames));
  health.run_downs += grown(report.run_downs, std::exchange(mcu.run_downs_told, report.run_downs));
  health.rate_ppm = report.rate_ppb * 1e-3;
  if (report.low_water_ticks != UINT16_MAX) {
    health.low_water_ticks =
        std::min(health.low_water_ticks.value_or(UINT16_MAX), report.low_water_ticks);
  }
}

void Master::handle_report(std::int64_t now_us, const Transactions::Answer& answer,
                           const bushd_report& report) {
  const McuIndex index = answer.mcu;
  Mcu& mcu = mcus_[index];
  McuView& view = mcu.view;
  if (view.phase == McuPhase::kOffline) return;
  if (report.boot_number != view.identity.boot_number) {
    ++mcu.health.restarts;
    go_offline(index, "restarted", now_us);
    return;
  }
  // An answer that lay unread while this program slept does not tell what time it is.
  bool in_step = answer.in_time && (report.flags & BUSHD_FLAG_SYNCED) != 0 &&
                 (report.flags & BUSHD_FLAG_MARK) != 0;
  view.report = report;
  view.reported = true;
  mcu.asked_since_mark = true;
  note_health(mcu, report);
  // The MCU has switched its drivers off, and people are to find out why.
  if (report.faults & BUSHD_FAULT_OVERCURRENT) mcu.powered = false;
  view.tick = clock_.unwrap(report.tick, now_us);
  if (in_step) {
    if (clock_.valid() && std::abs(view.tick - clock_.tick_at(now_us)) > ticks_in(kClockJumpUs)) {
      // Moves are planned in the bus's time: who counts otherwise has to be told it before it gets
      // any, and of those it has got nothing holds.
      if (view.phase == McuPhase::kOnline) {
        go_offline(index, "counts other ticks than before", now_us);
        return;
      }
      in_step = std::none_of(mcus_.begin(), mcus_.end(), [](const Mcu& other) {
        return other.view.phase == McuPhase::kOnline;
      });
      if (in_step) clock_.reset();
      view.tick = clock_.unwrap(report.tick, now_us);
    }
    // It tells of the poll's end.
    if (in_step) clock_.sample(view.tick, report.tick_ns + answer.line_us * 1000, now_us);
  }
  for (unsigned m = 0; m < report.motor_count; ++m) {
    // Never before the present tick, whatever the line says: ticks executed cannot be asked for
    // again.
    const auto ahead = static_cast<std::int16_t>(report.motor[m].known_until -
                                                 static_cast<std::uint16_t>(report.tick));
    view.known_until[m] = view.tick + std::max<std::int16_t>(ahead, 0);
  }
  if (view.phase == McuPhase::kConnecting) {
    follow_connecting(now_us, index, in_step);
    return;
  }
  if (!in_step && (report.flags & BUSHD_FLAG_CONFIGURED) == 0) {
    go_offline(index, "lost its configuration", now_us);
    return;
  }
  follow_replacements(index);
  follow_streams(index);
  events_.push_back(McuReported{index});
}

}  // namespace bushd::link
