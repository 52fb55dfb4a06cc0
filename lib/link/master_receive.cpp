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

void Master::receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    bushd_frame frame;
    switch (bushd_receive_byte(&receiver_, byte, &frame)) {
      case BUSHD_RECEIVE_MORE:
        break;
      case BUSHD_RECEIVE_FRAME:
        handle_frame(now_us, frame);
        break;
      case BUSHD_RECEIVE_BAD_CRC:
      case BUSHD_RECEIVE_BAD_LENGTH:
        ++bus_health_.crc_errors;
        break;
    }
  }
}

void Master::handle_frame(std::int64_t now_us, const bushd_frame& frame) {
  if ((frame.type & BUSHD_TYPE_REPLY) == 0) {
    // Another master's, or the echo of an own one.
    bushd_sync sync;
    if (frame.type == BUSHD_MSG_SYNC &&
        bushd_decode_sync(frame.payload, frame.payload_size, &sync) == BUSHD_OK &&
        sync.master != setup_.master) {
      other_master_until_us_ = now_us + kOtherMasterUs;
    }
    return;
  }
  // Only answers that are awaited count: an old one, or one to another master, would be taken for
  // them.
  if (!exchange_ || frame.tag != exchange_->tag ||
      frame.type != (exchange_->type | BUSHD_TYPE_REPLY)) {
    ++bus_health_.stray_frames;
    return;
  }
  const auto awaited =
      std::find_if(exchange_->awaited.begin(), exchange_->awaited.end(),
                   [&](const Awaited& a) { return mcus_[a.mcu].setup.address == frame.address; });
  const bool several = exchange_->slots > 1;  // MCUs may answer
  if (awaited == exchange_->awaited.end() || (awaited->answered && !several)) {
    ++bus_health_.stray_frames;
    return;
  }
  // What an answer leads to may end the exchange: nothing of it is used afterwards.
  const Awaited from = *awaited;
  answered(now_us, *awaited);
  if (!handle_answer(now_us, from, frame)) ++bus_health_.crc_errors;
  // Answers come in the order of their slots: after the last one nobody is waited for.
  if (!several && exchange_ && from.mcu == exchange_->awaited.back().mcu) finish_exchange(now_us);
}

// Who has not answered is silent.
void Master::finish_exchange(std::int64_t now_us) {
  const Exchange exchange = *std::exchange(exchange_, std::nullopt);
  for (const Awaited& awaited : exchange.awaited) {
    if (!awaited.answered) handle_silence(now_us, awaited.mcu, exchange.type);
  }
}

void Master::answered(std::int64_t now_us, Awaited& awaited) {
  awaited.answered = true;
  mcus_[awaited.mcu].silent = 0;
  // In which of several slots it came is not known here.
  if (exchange_->slots > 1) return;
  const std::int64_t latency_us = std::max<std::int64_t>(now_us - awaited.expected_us, 0);
  bus_health_.latency.add(latency_us);
  patience_us_ = std::clamp(std::max(4 * latency_us, patience_us_ - patience_us_ / 8),
                            kMinPatienceUs, kMaxPatienceUs);
}

// Returns false if the payload makes no sense.
bool Master::handle_answer(std::int64_t now_us, const Awaited& from, const bushd_frame& frame) {
  const std::size_t mcu = from.mcu;
  const std::uint8_t* const payload = frame.payload;
  const std::size_t size = frame.payload_size;
  switch (exchange_->type) {
    case BUSHD_MSG_POLL: {
      bushd_report report;
      if (bushd_decode_report(payload, size, &report) != BUSHD_OK) return false;
      handle_report(now_us, mcu, report, from.expected_us - exchange_->sent_us);
      return true;
    }
    case BUSHD_MSG_IDENTIFY: {
      bushd_identity identity;
      if (bushd_decode_identity(payload, size, &identity) != BUSHD_OK) return false;
      exchange_->identities.push_back(identity);
      if (exchange_->slots == 1) finish_identify(now_us, mcu, exchange_->identities);
      return true;
    }
    case BUSHD_MSG_TABLES: {
      bushd_tables held;
      if (bushd_decode_tables(payload, size, &held) != BUSHD_OK) return false;
      handle_tables(mcu, held);
      return true;
    }
    default: {
      bushd_acknowledgement acknowledgement;
      if (bushd_decode_acknowledgement(payload, size, &acknowledgement) != BUSHD_OK) return false;
      handle_acknowledgement(now_us, mcu, exchange_->type, acknowledgement.status);
      return true;
    }
  }
}

void Master::handle_timeout(std::int64_t now_us) {
  if (exchange_->identities.empty()) {
    finish_exchange(now_us);
    return;
  }
  const Exchange exchange = *std::exchange(exchange_, std::nullopt);
  finish_identify(now_us, exchange.awaited.front().mcu, exchange.identities);
}

void Master::handle_silence(std::int64_t now_us, std::size_t index, std::uint8_t type) {
  Mcu& mcu = mcus_[index];
  if (mcu.view.phase == McuPhase::kOffline) {
    // Each look at a silent MCU costs the line a time-out: the more are silent, the rarer.
    const auto silent = std::count_if(mcus_.begin(), mcus_.end(), [](const Mcu& m) {
      return m.view.phase == McuPhase::kOffline;
    });
    mcu.retry_due_us = now_us + kRetryUs * silent;
    return;
  }
  ++mcu.health.timeouts;
  patience_us_ = std::min(2 * patience_us_, kMaxPatienceUs);
  if (++mcu.silent >= kMaxSilent) {
    go_offline(index, "does not answer", now_us + kRetryUs);
  } else if (type == BUSHD_MSG_POLL) {
    // Sooner than usual; but a dead MCU must not starve the others.
    mcu.poll_due_us = now_us + kPollAgainUs;
  }
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

// `line_us`: since the poll's end, of which the report tells; adapter latency comes on top.
void Master::handle_report(std::int64_t now_us, std::size_t index, const bushd_report& report,
                           std::int64_t line_us) {
  Mcu& mcu = mcus_[index];
  McuView& view = mcu.view;
  if (view.phase == McuPhase::kOffline) return;
  if (report.boot_number != view.identity.boot_number) {
    ++mcu.health.restarts;
    go_offline(index, "restarted", now_us);
    return;
  }
  // An answer that lay unread while this program slept does not tell what time it is.
  const bool in_time = now_us <= exchange_->timeout_us;
  bool in_step =
      in_time && (report.flags & BUSHD_FLAG_SYNCED) != 0 && (report.flags & BUSHD_FLAG_MARK) != 0;
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
    if (in_step) clock_.sample(view.tick, report.tick_ns + line_us * 1000, now_us);
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
  events_.push_back({Event::Kind::kReport, index});
}

}  // namespace bushd::link
