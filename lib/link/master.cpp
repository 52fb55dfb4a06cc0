// Sending: what is due next on a line where only one may talk at a time. Order of urgency:
// replacements, what follows them, and the polls that confirm them; queues about to run empty,
// reports, time marks, configuration, filling queues, looking for silent MCUs. While an answer is
// awaited nothing is sent.
#include "link/master.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace bushd::link {
namespace {

constexpr std::int64_t kQueueTargetUs = 300'000;  // queues are kept this full
constexpr std::int64_t kQueueUrgentUs = 120'000;  // below this, ticks go before everything routine
constexpr std::int64_t kStartLeadUs =
    100'000;  // two polls: one lost first frame can still be repaired
constexpr std::int64_t kReplaceLeadUs =
    30'000;  // a frame in flight, an answer awaited, adapter latency
constexpr std::int64_t kMaxBacklogUs = 4'000;  // bytes handed to the port but not yet on the line
constexpr std::int64_t kStreamWakeUs = 5'000;
constexpr std::uint8_t kMaxEpochsAhead = 100;  // MCUs take up to 127

std::int64_t line_us(std::uint32_t baud, std::size_t bytes) {
  return static_cast<std::int64_t>(bytes) * 10'000'000 / baud + 1;
}

}  // namespace

Master::Master(BusSetup setup, TickSource& source)
    : setup_(std::move(setup)), source_(source), clock_(setup_.tick_ns) {
  for (const McuSetup& mcu : setup_.mcus) {
    mcus_.emplace_back();
    mcus_.back().setup = mcu;
  }
}

void Master::port_opened(std::int64_t now_us) {
  port_open_ = true;
  receiver_ = {};
  outstanding_.reset();
  line_free_us_ = now_us;
  sync_due_us_ = now_us;
  for (Mcu& mcu : mcus_) {
    mcu.view.detail = "no answer yet";
    mcu.retry_due_us = now_us;
  }
}

void Master::port_lost(std::int64_t now_us, const std::string& cause) {
  port_open_ = false;
  outstanding_.reset();
  mark_tag_.reset();
  for (std::size_t i = 0; i < mcus_.size(); ++i) go_offline(i, cause, now_us);
  clock_.reset();
}

Tick Master::ticks_in(std::int64_t us) const {
  return (us * 1000 + setup_.tick_ns - 1) / setup_.tick_ns;
}

Tick Master::earliest_start(std::int64_t now_us, std::size_t mcu, std::uint8_t motor) const {
  const Tick start = tick_at(now_us) + ticks_in(kStartLeadUs);
  return std::max(start, mcus_[mcu].stream[motor].next);
}

Tick Master::earliest_replace(std::int64_t now_us) const {
  return tick_at(now_us) + ticks_in(kReplaceLeadUs);
}

void Master::begin(std::size_t mcu, std::uint8_t motor, Tick start) {
  drop(mcu, motor);
  mcus_[mcu].stream[motor] = {
      .active = true, .finished = false, .start = start, .next = start, .delay_sent = {}};
}

void Master::drop(std::size_t mcu, std::uint8_t motor) {
  Mcu& m = mcus_[mcu];
  m.stream[motor].active = false;
  // Nor is a replacement that has been asked for and not yet sent.
  m.replacing &= static_cast<std::uint16_t>(~(1u << motor));
}

void Master::replace(std::size_t mcu, std::uint16_t motors, Tick first) {
  Mcu& m = mcus_[mcu];
  std::uint16_t sent = 0;  // motors of which ticks from `first` on have been sent already
  for (unsigned i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    Stream& stream = m.stream[i];
    if ((motors >> i & 1) == 0 || !stream.active) continue;
    stream.finished = false;
    const bool begun = stream.next != stream.start;
    if (begun && stream.next > first) sent |= static_cast<std::uint16_t>(1u << i);
  }
  if (sent == 0) return;
  // Two wishes before the first was sent: one replacement must serve both, so it takes the earlier
  // tick. If that is too late by now, it fails as a whole and is planned again.
  m.replace_at = m.replacing == 0 ? first : std::min(m.replace_at, first);
  m.replacing |= sent;
}

void Master::reconfigure(std::size_t mcu, McuSetup setup) {
  Mcu& m = mcus_[mcu];
  m.setup = std::move(setup);
  if (m.view.phase == McuPhase::kOffline) return;
  drop_streams(m);
  m.view.phase = McuPhase::kConnecting;
  m.view.detail = "being configured";
  m.scripted = false;
  m.script.clear();
  m.poll_now = true;
}

void Master::control(std::size_t mcu, std::uint8_t actions) {
  if (actions & BUSHD_CONTROL_ENABLE) mcus_[mcu].powered = true;
  if (actions & BUSHD_CONTROL_DISABLE) mcus_[mcu].powered = false;
  const bushd_control message = {actions};
  Request request{.type = BUSHD_MSG_CONTROL, .payload = std::vector<std::uint8_t>(1)};
  bushd_encode_control(&message, request.payload.data());
  mcus_[mcu].script.push_back(std::move(request));
}

void Master::set_position(std::size_t mcu, std::uint8_t motor, std::int32_t position_steps) {
  const bushd_set_position message = {motor, position_steps};
  Request request{.type = BUSHD_MSG_SET_POSITION, .payload = std::vector<std::uint8_t>(8)};
  request.payload.resize(bushd_encode_set_position(&message, request.payload.data()));
  mcus_[mcu].script.push_back(std::move(request));
}

std::vector<Event> Master::take_events() {
  return std::exchange(events_, {});
}

std::span<const std::uint8_t> Master::step(std::int64_t now_us) {
  out_.clear();
  stepped_us_ = now_us;
  if (!port_open_) return out_;
  if (outstanding_ && now_us >= outstanding_->timeout_us) handle_timeout(now_us);
  if (fail_late_replacements(now_us)) return out_;
  while (!outstanding_ && line_free_us_ - now_us < kMaxBacklogUs && send_next(now_us)) {
  }
  return out_;
}

std::int64_t Master::next_wake_us() const {
  if (!port_open_) return INT64_MAX;
  if (outstanding_) return outstanding_->timeout_us;
  std::int64_t wake = sync_due_us_;
  for (const Mcu& mcu : mcus_) {
    if (mcu.view.phase == McuPhase::kOffline) {
      wake = std::min(wake, mcu.retry_due_us);
      continue;
    }
    wake = std::min(wake, mcu.poll_due_us);
    const bool streaming = std::any_of(mcu.stream.begin(), mcu.stream.end(),
                                       [](const Stream& s) { return s.active && !s.finished; });
    if (streaming || !mcu.script.empty()) wake = std::min(wake, stepped_us_ + kStreamWakeUs);
    if (mcu.replacing != 0 || mcu.poll_now) wake = stepped_us_;
  }
  return std::max(wake, line_free_us_ - kMaxBacklogUs + 1);
}

bool Master::send_next(std::int64_t now_us) {
  return send_due_replacement(now_us) || send_stream(now_us, kQueueUrgentUs, true) ||
         send_wanted_poll(now_us) || send_stream(now_us, kQueueUrgentUs) || send_due_poll(now_us) ||
         send_due_sync(now_us) || send_script(now_us) || send_stream(now_us, kQueueTargetUs) ||
         send_due_identify(now_us);
}

void Master::send(std::int64_t now_us, std::uint8_t address, std::uint8_t type,
                  std::span<const std::uint8_t> payload) {
  // After silence a delimiter comes first: it ends whatever noise the receivers took for the
  // beginning of a frame.
  if (line_free_us_ < now_us) out_.push_back(0);
  const std::size_t before = out_.size();
  out_.resize(before + BUSHD_FRAME_MAX_WIRE);
  const std::size_t size = bushd_frame_encode(address, type, ++tag_, payload.data(), payload.size(),
                                              out_.data() + before);
  out_.resize(before + size);
  line_free_us_ = std::max(line_free_us_, now_us) + line_us(setup_.baud, size + 1);
}

void Master::ask(std::int64_t now_us, std::size_t mcu, std::uint8_t type,
                 std::span<const std::uint8_t> payload, std::size_t reply_payload) {
  send(now_us, mcus_[mcu].setup.address, type, payload);
  const std::size_t reply_size = reply_payload + BUSHD_FRAME_OVERHEAD + 1;
  const std::int64_t timeout = line_free_us_ + line_us(setup_.baud, reply_size) + patience_us_;
  outstanding_ = Outstanding{mcu, type, tag_, timeout, timeout - patience_us_};
}

// Until its source has planned anew, a motor whose replacement failed has no ticks that could be
// sent: so nothing is, in the step in which one fails.
bool Master::fail_late_replacements(std::int64_t now_us) {
  bool failed = false;
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    Mcu& mcu = mcus_[i];
    if (mcu.replacing == 0 || !too_late(mcu.replace_at, tick_at(now_us))) continue;
    const std::uint16_t motors = std::exchange(mcu.replacing, std::uint16_t{0});
    events_.push_back({.kind = Event::Kind::kReplaceFailed, .mcu = i, .motors = motors});
    failed = true;
  }
  return failed;
}

bool Master::send_due_replacement(std::int64_t now_us) {
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    Mcu& mcu = mcus_[i];
    if (mcu.replacing == 0 || mcu.replaced != 0) continue;
    const std::uint16_t mask = std::exchange(mcu.replacing, std::uint16_t{0});
    const auto motors = static_cast<std::uint8_t>(std::popcount(mask));
    const bool fine = setup_.format == BUSHD_FORMAT_FINE;
    const unsigned count =
        std::min<unsigned>(bushd_ticks_capacity(motors, fine, true), kMaxTicksPerFrame);
    // Another epoch at each try: frames of one that failed may still be on their way.
    if (static_cast<std::uint8_t>(mcu.newest_epoch - mcu.epoch) >= kMaxEpochsAhead) {
      mcu.newest_epoch = mcu.epoch;
    }
    mcu.epoch = ++mcu.newest_epoch;
    send_ticks(now_us, i, mask, mcu.replace_at, count, BUSHD_TICKS_REPLACE);
    mcu.replaced = mask;
    mcu.poll_now = true;
    return true;
  }
  return false;
}

bool Master::send_wanted_poll(std::int64_t now_us) {
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    Mcu& mcu = mcus_[i];
    if (!mcu.poll_now) continue;
    mcu.poll_now = false;
    mcu.poll_due_us = now_us + kPollPeriodUs;
    ask(now_us, i, BUSHD_MSG_POLL, {}, BUSHD_REPORT_SIZE(mcu.view.identity.motors));
    return true;
  }
  return false;
}

bool Master::send_due_poll(std::int64_t now_us) {
  Mcu* due = nullptr;
  for (Mcu& mcu : mcus_) {
    if (mcu.view.phase == McuPhase::kOffline || mcu.poll_due_us > now_us) continue;
    if (due == nullptr || mcu.poll_due_us < due->poll_due_us) due = &mcu;
  }
  if (due == nullptr) return false;
  due->poll_now = true;
  return send_wanted_poll(now_us);
}

// A replacement leaves an MCU with little more than one frame of ticks, far less than an answer may
// take. So more goes out before anybody knows whether it was taken: if it was not, its followers
// are of an epoch that the MCU does not have and change nothing.
bool Master::send_stream(std::int64_t now_us, std::int64_t lead_us, bool only_replaced) {
  if (!clock_.valid()) return false;
  const Tick now = tick_at(now_us);
  // The neediest first; one whose queue is full must not keep the others waiting.
  std::vector<std::pair<Tick, std::size_t>> needy;
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    const Mcu& mcu = mcus_[i];
    if (mcu.view.phase != McuPhase::kOnline || (only_replaced && mcu.replaced == 0)) continue;
    Tick next = INT64_MAX;
    for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      if (sendable(mcu, m)) next = std::min(next, mcu.stream[m].next);
    }
    if (next != INT64_MAX) needy.emplace_back(next, i);
  }
  std::sort(needy.begin(), needy.end());
  return std::any_of(needy.begin(), needy.end(), [&](const auto& entry) {
    // Its ticks run on meanwhile.
    const Tick depth = mcus_[entry.second].view.identity.queue_ticks - 4;
    return send_ticks_of(now_us, entry.second, now + std::min(ticks_in(lead_us), depth));
  });
}

// One frame for the motors of an MCU whose next tick is the oldest. Motors that start, start later
// or are ahead have frames of their own until the others have caught up.
bool Master::send_ticks_of(std::int64_t now_us, std::size_t index, Tick horizon) {
  Mcu& mcu = mcus_[index];
  Tick first = INT64_MAX;
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (sendable(mcu, m)) first = std::min(first, mcu.stream[m].next);
  }
  std::uint16_t starting = 0;
  std::uint16_t moving = 0;
  Tick join = INT64_MAX;
  for (unsigned i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    const Stream& stream = mcu.stream[i];
    if (!sendable(mcu, i)) continue;
    if (stream.next != first) {
      join = std::min(join, stream.next);
    } else {
      (stream.next == stream.start ? starting : moving) |= static_cast<std::uint16_t>(1u << i);
    }
  }
  const std::uint16_t mask = starting != 0 ? starting : moving;
  const auto motors = static_cast<std::uint8_t>(std::popcount(mask));
  const bool fine = setup_.format == BUSHD_FORMAT_FINE;
  const Tick capacity = std::min<Tick>(bushd_ticks_capacity(motors, fine, true), kMaxTicksPerFrame);
  const Tick count = std::min(capacity, join - first);
  // Only whole frames: a queue filled tick by tick would cost more in headers than in ticks.
  if (first + count > horizon) return false;
  send_ticks(now_us, index, mask, first, static_cast<unsigned>(count),
             starting != 0 ? BUSHD_TICKS_START : 0);
  return true;
}

void Master::send_ticks(std::int64_t now_us, std::size_t index, std::uint16_t mask, Tick first,
                        unsigned count, unsigned flags) {
  Mcu& mcu = mcus_[index];
  const auto motors = static_cast<std::size_t>(std::popcount(mask));
  std::array<std::int16_t, kMaxTicksPerFrame * BUSHD_MOTORS_PER_MCU> displacement;
  std::array<std::uint16_t, BUSHD_MOTORS_PER_MCU> delay;
  bool tell_delays = flags != 0;  // a start and a replacement begin a new story
  std::size_t column = 0;
  for (unsigned i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    if ((mask >> i & 1) == 0) continue;
    Stream& stream = mcu.stream[i];
    const auto motor = static_cast<std::uint8_t>(i);
    delay[column] = source_.render(index, motor, first, count, &displacement[column], motors);
    if (stream.delay_sent != delay[column]) tell_delays = true;
    stream.delay_sent = delay[column];
    stream.next = first + count;
    stream.finished = delay[column] == 0;
    ++column;
  }
  const bool fine = setup_.format == BUSHD_FORMAT_FINE;
  if (fine) flags |= BUSHD_TICKS_FINE;
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  std::size_t size = bushd_encode_ticks_head(
      mcu.epoch, static_cast<std::uint8_t>(flags), static_cast<std::uint32_t>(first),
      static_cast<std::uint8_t>(count), mask, tell_delays ? delay.data() : nullptr, payload.data());
  for (std::size_t i = 0; i < count * motors; ++i) {
    if (fine) {
      bushd_put_i16(&payload[size], displacement[i]);
      size += 2;
    } else {
      payload[size++] = static_cast<std::uint8_t>(displacement[i]);
    }
  }
  send(now_us, mcu.setup.address, BUSHD_MSG_TICKS, {payload.data(), size});
}

bool Master::send_script(std::int64_t now_us) {
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    Mcu& mcu = mcus_[i];
    if (mcu.view.phase == McuPhase::kOffline || mcu.script.empty()) continue;
    const Request& request = mcu.script.front();
    ask(now_us, i, request.type, request.payload, 1);
    return true;
  }
  return false;
}

bool Master::send_due_identify(std::int64_t now_us) {
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    Mcu& mcu = mcus_[i];
    if (mcu.view.phase != McuPhase::kOffline || mcu.retry_due_us > now_us) continue;
    ask(now_us, i, BUSHD_MSG_IDENTIFY, {}, 12);
    return true;
  }
  return false;
}

}  // namespace bushd::link
