// What is due next on a line where only one may talk at a time. Order of urgency: an emergency,
// replacements, what follows them, and the polls that confirm them; queues about to run empty,
// reports, time marks, configuration, filling queues, looking for silent MCUs. While answers are
// awaited nothing is sent.
#include "link/master.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "link/master_limits.h"

namespace bushd::link {
namespace {

constexpr std::int64_t kQueueTargetUs = 300'000;  // queues are kept this full
constexpr std::int64_t kQueueUrgentUs = 120'000;  // below this, ticks go before everything routine
constexpr std::int64_t kStartLeadUs =
    100'000;  // two polls: one lost first frame can still be repaired
constexpr std::int64_t kReplaceLeadUs =
    12'000;  // a frame in flight, an answer awaited; adapter latency comes on top
constexpr std::int64_t kStreamWakeUs = 5'000;
// More than any adapter holds back. An answer that was read later still waited for this program,
// which had been stopped: moves and stops must not be put off by seconds for that.
constexpr std::int64_t kMaxHeldBackUs = 40'000;
constexpr std::int64_t kEmergencyRepeatUs = 20'000;
constexpr std::int64_t kEmergencyUs =
    2'000'000;  // after this an MCU that says nothing is left alone

std::int64_t held_back_us(const BusHealth& health) {
  return std::min(health.latency.recent_us, kMaxHeldBackUs);
}

}  // namespace

Master::Master(BusSetup setup, TickSource& source)
    : setup_(std::move(setup)),
      source_(source),
      clock_(setup_.tick_ns),
      writer_(setup_.baud),
      transactions_(writer_, *this) {
  for (const McuSetup& mcu : setup_.mcus) {
    Mcu entry;
    entry.setup = mcu;
    mcus_.push_back(std::move(entry));
  }
}

void Master::port_opened(std::int64_t now_us) {
  port_open_ = true;
  transactions_.reset();
  writer_.reset(now_us);
  sync_due_us_ = now_us;
  for (Mcu& mcu : mcus_) {
    mcu.view.detail = "no answer yet";
    mcu.retry_due_us = now_us;
  }
}

void Master::port_lost(std::int64_t now_us, const std::string& cause) {
  port_open_ = false;
  transactions_.abandon();
  for (const McuIndex i : mcus_.indices()) go_offline(i, cause, now_us);
  clock_.reset();
}

Tick Master::ticks_in(std::int64_t us) const {
  return (us * 1000 + setup_.tick_ns - 1) / setup_.tick_ns;
}

// What an adapter holds back is late on the line, and its answer is later still: queues are deeper
// by that, and changes are planned further ahead.
Tick Master::earliest_start(std::int64_t now_us, McuIndex mcu, std::uint8_t motor) const {
  const std::int64_t lead_us = kStartLeadUs + 4 * held_back_us(transactions_.health());
  return std::max(tick_at(now_us) + ticks_in(lead_us), mcus_[mcu].stream[motor].next);
}

Tick Master::earliest_replace(std::int64_t now_us) const {
  // An MCU can change its next tick but one; this clock lags by a part of a tick.
  constexpr Tick kMcuTicks = 3;
  const std::int64_t waits_us =
      transactions_.open() ? std::max<std::int64_t>(transactions_.quiet_us() - now_us, 0) : 0;
  const std::int64_t lead_us = kReplaceLeadUs + waits_us + 2 * held_back_us(transactions_.health());
  return tick_at(now_us) + ticks_in(lead_us) + kMcuTicks;
}

bool Master::can_run_tables(McuIndex mcu) const {
  return (mcus_[mcu].view.identity.capabilities & BUSHD_CAN_TABLE_RUN) != 0;
}

bool Master::two_masters(std::int64_t now_us) const {
  if (now_us < other_master_until_us_) return true;
  return std::any_of(mcus_.begin(), mcus_.end(), [](const Mcu& mcu) {
    return mcu.view.phase != McuPhase::kOffline && mcu.view.reported &&
           (mcu.view.report.flags & BUSHD_FLAG_TWO_MASTERS) != 0;
  });
}

void Master::reset_low_water() {
  for (Mcu& mcu : mcus_) mcu.health.low_water_ticks.reset();
}

void Master::reconfigure(McuIndex mcu, McuSetup setup) {
  Mcu& m = mcus_[mcu];
  m.setup = std::move(setup);
  if (m.view.phase == McuPhase::kOffline) return;
  drop_streams(m);
  m.view.phase = McuPhase::kConnecting;
  m.view.detail = "being configured";
  m.scripted = false;
  m.script.clear();
  m.poll_wanted = true;
}

void Master::control(McuIndex mcu, std::uint8_t actions) {
  if (actions & BUSHD_CONTROL_ENABLE) mcus_[mcu].powered = true;
  if (actions & BUSHD_CONTROL_DISABLE) mcus_[mcu].powered = false;
  add_control(mcus_[mcu], actions);
}

void Master::set_position(McuIndex mcu, std::uint8_t motor, std::int32_t position_steps) {
  const bushd_set_position message = {motor, position_steps};
  add_request(mcus_[mcu], BUSHD_MSG_SET_POSITION,
              [&](std::uint8_t* p) { return bushd_encode_set_position(&message, p); });
}

bool Master::can_trigger(McuIndex mcu) const {
  return (mcus_[mcu].view.identity.capabilities & BUSHD_CAN_TRIGGER) != 0;
}

bool Master::has_reference(McuIndex mcu) const {
  return (mcus_[mcu].view.identity.capabilities & BUSHD_CAN_REFERENCE) != 0;
}

std::uint8_t Master::arm(McuIndex index, bushd_edge edge, std::uint32_t delay_us,
                         std::span<const Armed> moves) {
  Mcu& mcu = mcus_[index];
  std::vector<bushd_table_run_entry> entries;
  for (const Armed& move : moves) {
    entries.push_back(
        {.motor = move.motor,
         .slot = mcu.setup.table_of_motor[move.motor].value_or(0),
         .direction = static_cast<std::int8_t>(move.steps < 0 ? -1 : 1),
         .steps = static_cast<std::uint32_t>(std::abs(static_cast<std::int64_t>(move.steps)))});
  }
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return a.motor < b.motor; });
  // The MCU takes the number that it has for the same frame again.
  const auto number = static_cast<std::uint8_t>(mcu.view.report.trigger_number % 255 + 1);
  add_request(mcu, BUSHD_MSG_TRIGGER, [&](std::uint8_t* p) {
    return bushd_encode_trigger(number, edge, delay_us, entries.data(),
                                static_cast<std::uint8_t>(entries.size()), p);
  });
  return number;
}

void Master::add_disarm(Mcu& mcu) {
  add_request(mcu, BUSHD_MSG_TRIGGER, [](std::uint8_t* p) {
    return bushd_encode_trigger(0, BUSHD_EDGE_NONE, 0, nullptr, 0, p);
  });
}

void Master::disarm(McuIndex mcu) {
  add_disarm(mcus_[mcu]);
}

void Master::reference(McuIndex mcu, const bushd_reference& message) {
  add_request(mcus_[mcu], BUSHD_MSG_REFERENCE,
              [&](std::uint8_t* p) { return bushd_encode_reference(&message, p); });
}

void Master::home(McuIndex mcu, const bushd_home& message) {
  add_request(mcus_[mcu], BUSHD_MSG_HOME,
              [&](std::uint8_t* p) { return bushd_encode_home(&message, p); });
}

void Master::emergency_stop(bushd_how how) {
  emergency_ = Emergency{.how = how};
  for (Mcu& mcu : mcus_) {
    drop_streams(mcu);
    // One that was latched before says nothing of this one, and nothing that was wished before may
    // clear it.
    mcu.view.report.faults &= static_cast<std::uint8_t>(~BUSHD_FAULT_EMERGENCY);
    mcu.taken_over = false;
    for (Request& request : mcu.script) {
      if (request.type != BUSHD_MSG_CONTROL) continue;
      request.payload[0] &= static_cast<std::uint8_t>(~BUSHD_CONTROL_CLEAR_FAULTS);
    }
  }
}

std::vector<Event> Master::take_events() {
  return std::exchange(events_, {});
}

void Master::receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) {
  transactions_.receive(now_us, bytes);
}

std::span<const std::uint8_t> Master::step(std::int64_t now_us) {
  writer_.clear();
  stepped_us_ = now_us;
  if (!port_open_) return {};
  transactions_.expire(now_us);
  if (fail_late_replacements(now_us)) return {};
  // Nobody should be talking any more, and an answer that is late all the same may be lost.
  if (transactions_.open() && now_us >= transactions_.quiet_us()) send_emergency(now_us);
  while (!transactions_.open() && writer_.has_room(now_us) && send_next(now_us)) {
  }
  return writer_.bytes();
}

std::optional<Master::Traffic> Master::rehearse(std::int64_t now_us, TickSource& source,
                                                std::span<const Motion> motions,
                                                std::uint64_t max_frames) const {
  Master other(setup_, source);
  other.clock_ = clock_;
  other.writer_.reset(now_us);
  for (const McuIndex i : mcus_.indices()) other.mcus_[i].view = mcus_[i].view;
  for (const Motion& motion : motions) {
    other.begin(motion.mcu, motion.motor, motion.start);
    other.mcus_[motion.mcu].stream[motion.motor].run_steps = motion.run_steps;
  }
  const auto open = [&other] {
    return std::any_of(other.mcus_.begin(), other.mcus_.end(), [](const Mcu& mcu) {
      return std::any_of(mcu.stream.begin(), mcu.stream.end(),
                         [](const Stream& s) { return s.active && !s.finished; });
    });
  };
  const std::int64_t target_us = kQueueTargetUs + 4 * held_back_us(transactions_.health());
  Tick end = 0;
  for (const Motion& motion : motions) {
    end = std::max(end, source.end_tick(motion.mcu, motion.motor));
  }
  Traffic traffic;
  for (; open(); now_us += kStreamWakeUs) {
    // Queues are filled ahead of the time: what has not gone out by its end never will.
    if (!clock_.valid() || clock_.tick_at(now_us) > end) return std::nullopt;
    while (other.writer_.has_room(now_us) && other.send_stream(now_us, target_us)) {
      if (++traffic.frames > max_frames) return std::nullopt;
    }
    traffic.bytes += other.writer_.bytes().size();
    other.writer_.clear();
  }
  return traffic;
}

std::int64_t Master::next_wake_us() const {
  if (!port_open_) return INT64_MAX;
  if (transactions_.open()) {
    const std::int64_t timeout_us = transactions_.timeout_us();
    if (!emergency_) return timeout_us;
    return std::min(timeout_us, std::max(emergency_->due_us, transactions_.quiet_us()));
  }
  std::int64_t wake = sync_due_us_;
  if (emergency_) wake = std::min(wake, emergency_->due_us);
  for (const Mcu& mcu : mcus_) {
    if (mcu.view.phase == McuPhase::kOffline) {
      wake = std::min(wake, mcu.retry_due_us);
      continue;
    }
    wake = std::min(wake, mcu.poll_due_us);
    const bool streaming = std::any_of(mcu.stream.begin(), mcu.stream.end(),
                                       [](const Stream& s) { return s.active && !s.finished; });
    if (streaming || !mcu.script.empty()) wake = std::min(wake, stepped_us_ + kStreamWakeUs);
    if (mcu.replacing != 0 || mcu.poll_wanted) wake = stepped_us_;
  }
  return std::max(wake, writer_.room_from_us());
}

bool Master::send_next(std::int64_t now_us) {
  const std::int64_t deeper_us = 4 * held_back_us(transactions_.health());
  const std::int64_t urgent_us = kQueueUrgentUs + deeper_us;
  return send_emergency(now_us) || send_due_replacement(now_us) ||
         send_stream(now_us, urgent_us, true) || send_wanted_poll(now_us) ||
         send_stream(now_us, urgent_us) || send_due_poll(now_us) || send_due_sync(now_us) ||
         send_ramp_down(now_us) || send_due_identify(now_us) || send_script(now_us) ||
         send_stream(now_us, kQueueTargetUs + deeper_us);
}

// Said three times in a row, as nobody answers, and again until every report shows it.
bool Master::send_emergency(std::int64_t now_us) {
  if (!emergency_) return false;
  const bool open = std::any_of(mcus_.begin(), mcus_.end(), [](const Mcu& mcu) {
    return mcu.view.phase != McuPhase::kOffline &&
           (mcu.view.report.faults & BUSHD_FAULT_EMERGENCY) == 0;
  });
  const bool said = emergency_->until_us != 0;
  if (said && (!open || now_us >= emergency_->until_us)) {
    emergency_.reset();
    return false;
  }
  if (now_us < emergency_->due_us) return false;
  if (!said) emergency_->until_us = now_us + kEmergencyUs;
  emergency_->due_us = now_us + kEmergencyRepeatUs;
  const std::array<std::uint8_t, 1> payload = {static_cast<std::uint8_t>(emergency_->how)};
  for (int i = 0; i < 3; ++i) writer_.send(now_us, kBroadcast, BUSHD_MSG_EMERGENCY, payload);
  for (Mcu& mcu : mcus_) mcu.poll_wanted |= mcu.view.phase != McuPhase::kOffline;
  return true;
}

bool Master::send_ramp_down(std::int64_t now_us) {
  for (Mcu& mcu : mcus_) {
    if (mcu.view.phase != McuPhase::kConnecting || !mcu.ramp_down_now) continue;
    mcu.ramp_down_now = false;
    const std::array<std::uint8_t, 1> payload = {BUSHD_RAMP_DOWN};
    writer_.send(now_us, mcu.setup.address, BUSHD_MSG_EMERGENCY, payload);
    return true;
  }
  return false;
}

// By turns: one that does not answer its request keeps nobody else waiting.
bool Master::send_script(std::int64_t now_us) {
  for (std::size_t n = 0; n < mcus_.size(); ++n) {
    const McuIndex i{(script_turn_ + n) % mcus_.size()};
    const Mcu& mcu = mcus_[i];
    if (mcu.view.phase == McuPhase::kOffline || mcu.script.empty()) continue;
    script_turn_ = i.value + 1;
    const Request& request = mcu.script.front();
    transactions_.ask(now_us,
                      {.mcu = i,
                       .address = mcu.setup.address,
                       .type = request.type,
                       .payload = request.payload,
                       .reply_payload = request.type == BUSHD_MSG_TABLES ? BUSHD_TABLES_SIZE : 1u});
    return true;
  }
  return false;
}

}  // namespace bushd::link
