// Receiving: what an answer, or its absence, means for an MCU and its streams.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "link/master.h"

namespace bushd::link {
namespace {

constexpr int kMaxSilent = 10;  // unanswered requests in a row: about 0.4 s
constexpr unsigned kMinQueueTicks = 2 * kMaxTicksPerFrame;  // one runs while the next arrives
constexpr std::int64_t kMinQueueUs = 150'000;               // two lost answers and a frame
constexpr std::int64_t kRetryUs = 500'000;                  // between two looks for a silent MCU
constexpr std::int64_t kRefusedRetryUs = 2'000'000;  // for an MCU that does not fit: no hurry
constexpr std::int64_t kClockJumpUs = 400'000;  // more than any latency: the bus's time began anew

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
        ++bad_frames_;
        break;
    }
  }
}

void Master::handle_frame(std::int64_t now_us, const bushd_frame& frame) {
  // Only the answer that is awaited counts: an old one, an echo or a stranger's frame would be
  // taken for it.
  if (!outstanding_ || frame.tag != outstanding_->tag ||
      frame.type != (outstanding_->type | BUSHD_TYPE_REPLY) ||
      frame.address != mcus_[outstanding_->mcu].setup.address) {
    return;
  }
  const std::size_t mcu = outstanding_->mcu;
  const std::uint8_t type = outstanding_->type;
  if (type == BUSHD_MSG_POLL) {
    bushd_report report;
    if (bushd_decode_report(frame.payload, frame.payload_size, &report) != BUSHD_OK) {
      ++bad_frames_;
      return;
    }
    answered(now_us);
    handle_report(now_us, mcu, report);
  } else if (type == BUSHD_MSG_IDENTIFY) {
    bushd_identity identity;
    if (bushd_decode_identity(frame.payload, frame.payload_size, &identity) != BUSHD_OK) {
      ++bad_frames_;
      return;
    }
    answered(now_us);
    handle_identity(now_us, mcu, identity);
  } else {
    bushd_acknowledgement acknowledgement;
    if (bushd_decode_acknowledgement(frame.payload, frame.payload_size, &acknowledgement) !=
        BUSHD_OK) {
      ++bad_frames_;
      return;
    }
    answered(now_us);
    handle_acknowledgement(now_us, mcu, type, acknowledgement.status);
  }
}

void Master::answered(std::int64_t now_us) {
  const std::int64_t latency_us = now_us - outstanding_->expected_us;
  patience_us_ = std::clamp(std::max(4 * latency_us, patience_us_ - patience_us_ / 8),
                            kMinPatienceUs, kMaxPatienceUs);
  mcus_[outstanding_->mcu].silent = 0;
  outstanding_.reset();
}

void Master::handle_timeout(std::int64_t now_us) {
  const std::size_t index = outstanding_->mcu;
  const std::uint8_t type = outstanding_->type;
  outstanding_.reset();
  Mcu& mcu = mcus_[index];
  if (mcu.view.phase == McuPhase::kOffline) {
    // Each look at a silent MCU costs the line a time-out: the more are silent, the rarer.
    const auto silent = std::count_if(mcus_.begin(), mcus_.end(), [](const Mcu& m) {
      return m.view.phase == McuPhase::kOffline;
    });
    mcu.retry_due_us = now_us + kRetryUs * silent;
    return;
  }
  ++timeouts_;
  patience_us_ = std::min(2 * patience_us_, kMaxPatienceUs);
  if (++mcu.silent >= kMaxSilent) {
    go_offline(index, "does not answer", now_us + kRetryUs);
  } else if (type == BUSHD_MSG_POLL) {
    // Soon again, but after queues that run low: a dead MCU must not starve the others.
    mcu.poll_due_us = now_us;
  }
}

std::string Master::unfit(const Mcu& mcu, const bushd_identity& identity) const {
  if (identity.protocol_version != BUSHD_PROTOCOL_VERSION) {
    return "speaks protocol version " + std::to_string(identity.protocol_version) +
           ", this program version " + std::to_string(BUSHD_PROTOCOL_VERSION) +
           ": update the older of the two";
  }
  for (unsigned m = identity.motors; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (mcu.setup.table_of_motor[m] >= 0) {
      return "has only " + std::to_string(identity.motors) + " outputs, but output " +
             std::to_string(m) + " is configured";
    }
  }
  std::size_t codes = 0;
  for (const bushd_table* table : mcu.setup.tables) {
    codes += table->accel.count;
    if (table->decel.code != table->accel.code) codes += table->decel.count;
  }
  if (codes > identity.table_codes) {
    return "has memory for " + std::to_string(identity.table_codes) +
           " table codes, but its motors' tables need " + std::to_string(codes) +
           ": use shorter tables or fewer on this MCU";
  }
  const std::int64_t queue_us =
      static_cast<std::int64_t>(identity.queue_ticks) * setup_.tick_ns / 1000;
  if (identity.queue_ticks < kMinQueueTicks || queue_us < kMinQueueUs) {
    return "has a queue of " + std::to_string(identity.queue_ticks) + " ticks, " +
           std::to_string(queue_us / 1000) + " ms; needed are " + std::to_string(kMinQueueTicks) +
           " ticks and " + std::to_string(kMinQueueUs / 1000) + " ms: use a longer tick";
  }
  return {};
}

void Master::handle_identity(std::int64_t now_us, std::size_t index,
                             const bushd_identity& identity) {
  Mcu& mcu = mcus_[index];
  mcu.view.identity = identity;
  mcu.view.identified = true;
  if (const std::string why = unfit(mcu, identity); !why.empty()) {
    mcu.view.detail = why;
    mcu.retry_due_us = now_us + kRefusedRetryUs;
    return;
  }
  mcu.view.phase = McuPhase::kConnecting;
  mcu.view.detail = "being configured";
  mcu.view.reported = false;
  mcu.scripted = false;
  mcu.script.clear();
  mcu.poll_now = true;
  sync_due_us_ = std::min(sync_due_us_, now_us);
}

void Master::write_script(Mcu& mcu) const {
  const auto add = [&mcu](std::uint8_t type, auto&& encode) {
    Request request{.type = type, .payload = std::vector<std::uint8_t>(BUSHD_FRAME_MAX_PAYLOAD)};
    request.payload.resize(encode(request.payload.data()));
    mcu.script.push_back(std::move(request));
  };
  const bushd_configure configure = {setup_.tick_ns, setup_.format};
  add(BUSHD_MSG_CONFIGURE, [&](std::uint8_t* p) { return bushd_encode_configure(&configure, p); });
  for (std::size_t slot = 0; slot < mcu.setup.tables.size(); ++slot) {
    const bushd_table& table = *mcu.setup.tables[slot];
    const bool symmetric = table.decel.code == table.accel.code;
    std::vector<std::uint16_t> codes(table.accel.code, table.accel.code + table.accel.count);
    if (!symmetric) {
      codes.insert(codes.end(), table.decel.code, table.decel.code + table.decel.count);
    }
    const auto s = static_cast<std::uint8_t>(slot);
    const bushd_table_begin begin = {
        .slot = s,
        .accel_count = static_cast<std::uint16_t>(table.accel.count),
        .decel_count = static_cast<std::uint16_t>(symmetric ? 0 : table.decel.count),
        .cruise = table.cruise,
        .time_unit_ns = table.time_unit_ns};
    add(BUSHD_MSG_TABLE_BEGIN,
        [&](std::uint8_t* p) { return bushd_encode_table_begin(&begin, p); });
    bushd_table_end end = {.slot = s, .crc = BUSHD_CRC16_START};
    for (std::size_t at = 0; at < codes.size(); at += BUSHD_TABLE_DATA_MAX_CODES) {
      const auto count = static_cast<std::uint8_t>(
          std::min<std::size_t>(codes.size() - at, BUSHD_TABLE_DATA_MAX_CODES));
      add(BUSHD_MSG_TABLE_DATA, [&](std::uint8_t* p) {
        return bushd_encode_table_data(s, static_cast<std::uint16_t>(at), count, &codes[at], p);
      });
    }
    for (const std::uint16_t code : codes) {
      std::uint8_t bytes[2];
      bushd_put_u16(bytes, code);
      end.crc = bushd_crc16(end.crc, bytes, sizeof bytes);
    }
    add(BUSHD_MSG_TABLE_END, [&](std::uint8_t* p) { return bushd_encode_table_end(&end, p); });
  }
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (mcu.setup.table_of_motor[m] < 0) continue;
    const bushd_assign assign = {m, static_cast<std::uint8_t>(mcu.setup.table_of_motor[m])};
    add(BUSHD_MSG_ASSIGN, [&](std::uint8_t* p) { return bushd_encode_assign(&assign, p); });
  }
  std::uint8_t actions = BUSHD_CONTROL_CLEAR_FAULTS;
  if (mcu.powered.value_or(true)) actions |= BUSHD_CONTROL_ENABLE;
  const bushd_control control = {actions};
  add(BUSHD_MSG_CONTROL, [&](std::uint8_t* p) { return bushd_encode_control(&control, p); });
}

void Master::handle_acknowledgement(std::int64_t now_us, std::size_t index, std::uint8_t type,
                                    std::uint8_t status) {
  Mcu& mcu = mcus_[index];
  if (!mcu.script.empty() && mcu.script.front().type == type) mcu.script.pop_front();
  mcu.poll_now = mcu.script.empty();
  if (status == BUSHD_OK || mcu.view.phase == McuPhase::kOnline) return;
  go_offline(index,
             std::string("refused its configuration: ") +
                 bushd_status_text(static_cast<bushd_status>(status)),
             now_us + kRetryUs);
}

void Master::handle_report(std::int64_t now_us, std::size_t index, const bushd_report& report) {
  Mcu& mcu = mcus_[index];
  McuView& view = mcu.view;
  if (view.phase == McuPhase::kOffline) return;
  if (report.boot_number != view.identity.boot_number) {
    go_offline(index, "restarted", now_us);
    return;
  }
  const bool in_step =
      (report.flags & BUSHD_FLAG_SYNCED) != 0 && (report.flags & BUSHD_FLAG_MARK) != 0;
  view.report = report;
  view.reported = true;
  mcu.asked_since_mark = true;
  view.tick = clock_.unwrap(report.tick, now_us);
  if (in_step) {
    if (clock_.valid() && std::abs(view.tick - clock_.tick_at(now_us)) > ticks_in(kClockJumpUs)) {
      clock_.reset();
      view.tick = report.tick;
    }
    const std::int64_t line_ns =
        static_cast<std::int64_t>(BUSHD_REPORT_SIZE(report.motor_count) + BUSHD_FRAME_OVERHEAD) *
        10'000'000'000 / setup_.baud;
    clock_.sample(view.tick, report.tick_ns + line_ns, now_us);
  }
  for (unsigned m = 0; m < report.motor_count; ++m) {
    // Never before the present tick, whatever the line says: ticks executed cannot be asked for
    // again.
    const auto ahead = static_cast<std::int16_t>(report.motor[m].known_until -
                                                 static_cast<std::uint16_t>(report.tick));
    view.known_until[m] = view.tick + std::max<std::int16_t>(ahead, 0);
  }
  if (view.phase == McuPhase::kConnecting) {
    if (!mcu.powered) {
      const bool switched_off =
          (report.flags & BUSHD_FLAG_CONFIGURED) != 0 && (report.flags & BUSHD_FLAG_ENABLED) == 0;
      mcu.powered = !switched_off;
    }
    // A motor may still be running down from before; tables are for motors at rest.
    if (!mcu.scripted && report.moving == 0) {
      write_script(mcu);
      mcu.scripted = true;
    } else if (mcu.scripted && mcu.script.empty() && in_step &&
               (report.state != BUSHD_STATE_BUSY || !*mcu.powered)) {
      view.phase = McuPhase::kOnline;
      view.detail.clear();
      mcu.epoch = mcu.newest_epoch = report.epoch;
      events_.push_back({Event::Kind::kOnline, index});
    }
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

// A replacement was taken if the MCU is in the epoch that it opened.
void Master::follow_replacements(std::size_t index) {
  Mcu& mcu = mcus_[index];
  std::uint16_t failed = mcu.view.report.epoch == mcu.epoch ? std::uint16_t{0} : mcu.replaced;
  mcu.replaced = 0;
  mcu.epoch = mcu.view.report.epoch;
  // What was queued before stays in force, whatever has been sent since. If not even the start has
  // come, it has to be sent again, as one.
  for (unsigned m = 0; m < mcu.view.report.motor_count; ++m) {
    if ((failed >> m & 1) == 0) continue;
    mcu.stream[m].next = std::max(mcu.view.known_until[m], mcu.stream[m].start);
    mcu.stream[m].finished = false;
    mcu.stream[m].delay_sent.reset();
  }
  // One not even sent must be known to have failed before its tick is taken for executed.
  if (mcu.replacing != 0 && too_late(mcu.replace_at, mcu.view.tick)) {
    failed |= std::exchange(mcu.replacing, std::uint16_t{0});
  }
  if (failed != 0) {
    events_.push_back({.kind = Event::Kind::kReplaceFailed, .mcu = index, .motors = failed});
  }
}

// All frames sent before the poll were handled before its answer was made: what is not known is
// lost.
void Master::follow_streams(std::size_t index) {
  Mcu& mcu = mcus_[index];
  for (unsigned m = 0; m < mcu.view.report.motor_count; ++m) {
    Stream& stream = mcu.stream[m];
    if (!stream.active) continue;
    const Tick known = mcu.view.known_until[m];
    const bool moving = (mcu.view.report.moving >> m & 1) != 0;
    // Of a stream that has not begun nothing can be missing; but a busy line may keep it waiting
    // past its start.
    const bool begun = stream.next != stream.start;
    if (begun ? known >= stream.next : moving || known <= stream.start) continue;
    if (!moving && known > stream.start) {
      stream.active = false;
      events_.push_back(
          {.kind = Event::Kind::kLateStart, .mcu = index, .motor = static_cast<std::uint8_t>(m)});
      continue;
    }
    stream.next = std::max(known, stream.start);
    stream.finished = false;
    stream.delay_sent.reset();
  }
}

void Master::drop_streams(Mcu& mcu) {
  for (Stream& stream : mcu.stream) stream = {};
  mcu.replacing = 0;
  mcu.replaced = 0;
}

void Master::go_offline(std::size_t index, const std::string& cause, std::int64_t retry_due_us) {
  Mcu& mcu = mcus_[index];
  const bool was_online = mcu.view.phase == McuPhase::kOnline;
  mcu.view.phase = McuPhase::kOffline;
  mcu.view.detail = cause;
  mcu.retry_due_us = retry_due_us;
  mcu.silent = 0;
  mcu.poll_now = false;
  mcu.script.clear();
  drop_streams(mcu);
  if (was_online) events_.push_back({Event::Kind::kOffline, index});
}

}  // namespace bushd::link
