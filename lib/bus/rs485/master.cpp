#include "bus/rs485/master.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <utility>

#include "bus/bus_budget.h"
#include "bus/bus_times.h"
#include "bus/rs485/mcu_fit.h"
#include "engine/run_plan.h"

namespace bushd::link {
namespace {

// A queue with less than this would be empty after some frames. However many stops are wanted, the
// motors that they leave alone go on.
constexpr std::int64_t kQueueCriticalUs = 40'000;
// So long after a replacement queues are filled for the case that the program is held up; then it
// is asked whether it was taken.
constexpr std::int64_t kFollowFirstUs = 20'000;
// A program begins where it is known so long before that its MCU has taken the order: enough to say
// it again, and to take it back.
constexpr std::int64_t kRunConfirmedUs = 50'000;
// Less than what replacements are planned ahead beyond the time that the bus takes for them: those
// that have theirs do not keep the others waiting.
constexpr std::int64_t kCriticalMarginUs = 5'000;

// Codes behind the end of a side are the cruise delay.
bool makes_the_same_runs(const bushd_table& a, const bushd_table& b) {
  if (a.cruise != b.cruise || a.time_unit_ns != b.time_unit_ns) return false;
  for (std::uint32_t i = 0; i < std::max(a.accel.count, b.accel.count); ++i) {
    if (bushd_table_accel(&a, i) != bushd_table_accel(&b, i)) return false;
  }
  for (std::uint32_t i = 0; i < std::max(a.decel.count, b.decel.count); ++i) {
    if (bushd_table_decel(&a, i) != bushd_table_decel(&b, i)) return false;
  }
  return true;
}

PerMcu<McuRecord> records_of(const BusSetup& setup) {
  PerMcu<McuRecord> records;
  for (const McuSetup& mcu : setup.mcus)
    records.push_back({.setup = mcu, .view = {}, .health = {}});
  return records;
}

// The MCU takes the last number that it was given for the same frame again, whether it has reported
// it or not.
std::uint8_t next_trigger_number(McuRecord& mcu) {
  std::uint8_t& number = mcu.trigger_number;
  do {
    number = static_cast<std::uint8_t>(number % 255 + 1);
  } while (number == mcu.view.report.trigger_number);
  return number;
}

}  // namespace

Rs485Master::Rs485Master(BusSetup setup, TickSource& source)
    : setup_(std::move(setup)),
      mcus_(records_of(setup_)),
      writer_(setup_.baud),
      transactions_(writer_, *this),
      connector_(setup_, mcus_, transactions_, writer_, *this),
      synchroniser_(setup_, mcus_, writer_),
      streams_({.setup = setup_,
                .mcus = mcus_,
                .clock = clock(),
                .source = source,
                .writer = writer_,
                .events = events_}),
      poller_(mcus_, transactions_, writer_),
      emergency_(mcus_, writer_),
      horizon_(clock(), transactions_.health().latency) {}

void Rs485Master::port_opened(std::int64_t now_us) {
  look_again();
  port_open_ = true;
  heard_ = false;
  transactions_.reset();
  writer_.reset(now_us);
  synchroniser_.port_opened(now_us);
  connector_.port_opened(now_us);
}

void Rs485Master::port_lost(std::int64_t now_us, const std::string& cause) {
  look_again();
  port_open_ = false;
  transactions_.abandon();
  for (const McuIndex i : mcus_.indices()) connector_.give_up(i, cause, now_us);
  synchroniser_.port_lost();
}

void Rs485Master::receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) {
  look_again();
  notice_standing_still(now_us);
  transactions_.count_bytes(bytes.size());
  transactions_.receive(now_us, bytes);
}

// While an MCU is not offline it is asked again and again, unless nobody calls step(). Another
// master may have taken the place of one that was silent for so long; answers that have waited
// meanwhile are of a time that is over.
void Rs485Master::notice_standing_still(std::int64_t now_us) {
  const std::int64_t still_us = now_us - stepped_us_;
  if (!port_open_ || still_us < Synchroniser::kOtherMasterUs) return;
  look_again();
  transactions_.abandon();
  for (McuRecord& mcu : mcus_) {
    if (mcu.view.phase != McuPhase::kOnline) continue;
    mcu.view.outdated_us = still_us;
    mcu.poll_wanted = true;
  }
}

std::span<const std::uint8_t> Rs485Master::step(std::int64_t now_us) {
  writer_.clear();
  notice_standing_still(now_us);
  stepped_us_ = now_us;
  begun_ = false;
  if (!port_open_ || now_us < due_us_) return {};
  synchroniser_.lines_run(streams_.runs_line() || connector_.runs_with_host());
  transactions_.expire(now_us);
  streams_.fail_late_replacements(now_us);
  withdraw_late_starts(now_us);
  streams_.fail_late_starts(now_us);
  if (clock().valid()) {
    connector_.end_late_runs(clock().tick_at(now_us), clock().ticks_in(kRunConfirmedUs));
  }
  connector_.ask_for_reports();
  // Nobody should be talking any more, and an answer that is late all the same may be lost.
  if (transactions_.open() && now_us >= transactions_.quiet_us()) {
    emergency_.send_due(now_us);
    if (streams_.withdraws()) transactions_.give_up(now_us);
  }
  const bool was_open = transactions_.open();
  while (!transactions_.open() && writer_.has_room(now_us) && send_next(now_us)) {
  }
  if (transactions_.open() && !was_open) listen_from_us_ = decided_from_us();
  transactions_.count_bytes(writer_.bytes().size());
  due_us_ = wake_us();
  return writer_.bytes();
}

void Rs485Master::withdraw_late_starts(std::int64_t now_us) {
  if (!clock().valid() || (transactions_.open() && now_us < answered_by_us())) return;
  const std::int64_t free_us = std::max(line_free_us(now_us), writer_.free_us());
  const bool late = streams_.withdraw_late_starts(free_us, withdrawal_margin_us());
  if (late) repair_time_.missed(now_us);
}

// How long nothing may be sent, and then all others have their turn first: a poll whose last answer
// is missing.
std::int64_t Rs485Master::silence_us() const {
  return poller_.longest_cycle_us() + transactions_.patience_us() + streams_.round_us();
}

// By urgency: an emergency, also one that binds an MCU that has just come; queues that are all but
// empty; replacements, stops of programs, what follows them, and the polls that confirm them;
// queues about to run empty; reports; SYNCs; configuration; filling queues.
bool Rs485Master::send_next(std::int64_t now_us) {
  const std::int64_t target_us = horizon_.queue_target_us();
  const auto below = [target_us](std::int64_t lead_us) {
    return StreamScheduler::Filling{.lead_us = lead_us, .target_us = target_us};
  };
  const std::int64_t urgent_us = horizon_.queue_urgent_us(silence_us());
  const StreamScheduler::Filling urgent = below(urgent_us);
  // On a line that has little room more than enough would put off the poll for long.
  const StreamScheduler::Filling follows = below(
      streams_.confirmation_is_due(now_us - kFollowFirstUs) ? horizon_.queue_enough_us(silence_us())
                                                            : urgent_us);
  return emergency_.send_due(now_us) || connector_.send_stop(now_us) ||
         streams_.send_critical(now_us, below(kQueueCriticalUs), kCriticalMarginUs) ||
         streams_.send_due_replacement(now_us) || connector_.send_program_stop(now_us) ||
         streams_.send_stream(now_us, follows) || poller_.send_wanted(now_us) ||
         streams_.send_stream(now_us, urgent) || poller_.send_due(now_us) ||
         synchroniser_.send_due(now_us) || connector_.send_due_identify(now_us) ||
         connector_.send_request(now_us) || streams_.send_stream(now_us, below(target_us));
}

std::vector<Event> Rs485Master::take_events() {
  return std::exchange(events_, {});
}

Tick Rs485Master::earliest_start(std::int64_t now_us, McuIndex mcu, std::uint8_t motor) const {
  return std::max(horizon_.earliest_start(now_us), streams_.next_tick(mcu, motor));
}

// One frame tells all of table runs, and of one stream as much as the MCU can hold, if it takes
// states of runs. Several are followed by the question whether they have come, and by what keeps
// motors from beginning where they have not. Until a replacement is confirmed no start goes out.
CommonStart Rs485Master::earliest_common_start(std::int64_t now_us,
                                               std::span<const ToBegin> together) const {
  const CommonStart later = BusMaster::earliest_common_start(now_us, together);
  const std::int64_t free_us = std::max(line_free_us(now_us), writer_.free_us());
  Tick after = 0;  // what these motors have been told
  std::int64_t carried_us = free_us;
  for (const ToBegin& begin : together) {
    if (streams_.replacement_open(begin.mcu) || streams_.has_replacement_to_send(begin.mcu) ||
        !streams_.tells_at_once(begin)) {
      return later;
    }
    for (std::uint8_t m = 0; begin.motors >> m != 0; ++m) {
      if ((begin.motors >> m & 1) != 0) after = std::max(after, streams_.next_tick(begin.mcu, m));
    }
    carried_us += streams_.first_frames_us(begin);
  }
  const std::int64_t margin_us = start_margin_.margin_us(now_us);
  if (in_one_frame(together)) {
    return {.at = std::max(horizon_.earliest_at_once(carried_us, margin_us), after)};
  }
  const std::int64_t frames_us = carried_us - free_us;
  carried_us += poller_.expected_cycle_us(together) + horizon_.held_back_us() +
                streams_.withdrawal_us(together) + setup_.tick_ns / 1000;
  const CommonStart confirmed = {
      .at = std::max(horizon_.earliest_at_once(carried_us, margin_us), after), .to_confirm = true};
  if (confirmed.at > later.at) return later;
  const std::int64_t repair_us = repair_time_.margin_us(now_us) - StartMargin::kLeastUs;
  const std::int64_t again_us = frames_us + poller_.longest_cycle_us();
  const std::int64_t more_us = repair_us > 0 ? std::max(repair_us, again_us) : 0;
  return {.at = confirmed.at + clock().ticks_in(more_us), .to_confirm = true};
}

LineLoad Rs485Master::line_load(std::span<const ToBegin> more) const {
  std::vector<std::uint8_t> motors;
  for (const McuRecord& mcu : mcus_) {
    const auto with_table = std::ranges::count_if(
        mcu.setup.table_of_motor, [](const auto& table) { return table.has_value(); });
    motors.push_back(static_cast<std::uint8_t>(with_table));
  }
  const double streams = streams_.load_with({});
  return {.polls = fieldbus::poll_load(setup_.baud, motors),
          .streams = streams,
          .more = streams_.load_with(more) - streams,
          .most = fieldbus::kMaxBusLoad};
}

bool Rs485Master::in_one_frame(std::span<const ToBegin> together) const {
  if (together.size() != 1) return false;
  const ToBegin& begin = together.front();
  return begin.messages != StartMessages::kStates || std::has_single_bit(begin.motors);
}

// When what is sent next would begin, if the MCUs that are asked answer in their time or never.
std::int64_t Rs485Master::line_free_us(std::int64_t now_us) const {
  return transactions_.open() ? std::max(now_us, transactions_.quiet_us()) : now_us;
}

// An exchange, the program, and what the adapter may hold back of a frame.
std::int64_t Rs485Master::withdrawal_margin_us() const {
  return poller_.expected_cycle_us({}) + StartMargin::kLeastUs + 2 * horizon_.held_back_us();
}

Tick Rs485Master::earliest_replace(std::int64_t now_us, std::span<const ToReplace> together) const {
  const StreamScheduler::LineUse use = {
      .free_us = transactions_.open() ? transactions_.quiet_us() : now_us,
      .margin_us = kCriticalMarginUs,
      .confirm_us = kFollowFirstUs + streams_.round_us() + poller_.longest_cycle_us()};
  return horizon_.earliest_replace(now_us, streams_.carried_us(now_us, use, together));
}

Tick Rs485Master::earliest_retarget(std::int64_t now_us, std::span<const ToReplace> together,
                                    Tick start) const {
  return std::max(earliest_replace(now_us, together), start);
}

bool Rs485Master::has_time_to_retarget(std::int64_t now_us, McuIndex mcu) const {
  return !streams_.replacement_open(mcu) &&
         !streams_.behind(now_us, horizon_.queue_urgent_us(silence_us()));
}

// What begins is to be sent, and its end to be asked for.
void Rs485Master::note_begun(McuIndex mcu) {
  look_again();
  begun_ = true;
  ask_at_end(stepped_us_, mcu);
}

void Rs485Master::begin(McuIndex mcu, std::uint8_t motor, Tick start) {
  streams_.begin(mcu, motor, start);
  note_begun(mcu);
}

void Rs485Master::begin_table_run(McuIndex mcu, std::uint8_t motor, Tick start, TableRun run) {
  streams_.begin_run(mcu, motor, start, run);
  note_begun(mcu);
}

void Rs485Master::begin_line_run(McuIndex mcu, std::uint8_t motor, Tick start, const LineRun& run) {
  streams_.begin_run(mcu, motor, start, run);
  note_begun(mcu);
  synchroniser_.lines_run(true);
}

bool Rs485Master::can_run_line(McuIndex mcu, const bushd_table& table, bushd_delay shortest_delay,
                               bool alone) const {
  return makes_lines(mcu) && bank_of(mcu, table) &&
         keeps_up_with(mcu, table, shortest_delay, alone);
}

bool Rs485Master::keeps_up_with(McuIndex mcu, const bushd_table& table, bushd_delay shortest_delay,
                                bool alone) const {
  if (!bushd_delay_is_code(shortest_delay)) return false;  // LINE_RUN cannot tell it
  if (can(mcu, BUSHD_CAN_TABLE_TICKS)) return true;
  return bushd_run_is_slow(&table, shortest_delay, setup_.tick_ns,
                           alone ? BUSHD_SLOW_LINE_DELAY_NS : BUSHD_SHARED_LINE_DELAY_NS);
}

std::optional<std::uint8_t> Rs485Master::bank_of(McuIndex mcu, const bushd_table& table) const {
  const std::vector<TableRef>& tables = mcus_[mcu].setup.tables;
  for (std::size_t bank = 0; bank < tables.size(); ++bank) {
    if (makes_the_same_runs(*tables[bank].table, table)) return static_cast<std::uint8_t>(bank);
  }
  const bushd_table* scratch = connector_.scratch(mcu).table();
  if (scratch == nullptr || !makes_the_same_runs(*scratch, table)) return std::nullopt;
  return BUSHD_SCRATCH_BANK;
}

bool Rs485Master::can_upload(McuIndex mcu, const bushd_table& table) const {
  const McuRecord& record = mcus_[mcu];
  std::size_t codes = codes_of(table);
  for (const TableRef& ref : record.setup.tables) codes += codes_of(*ref.table);
  return can(mcu, BUSHD_CAN_SCRATCH) && codes <= record.view.identity.table_codes;
}

void Rs485Master::end_upload(McuIndex mcu) {
  look_again();
  if (uploads(mcu)) connector_.scratch(mcu).clear();
}

void Rs485Master::follow_run(McuIndex mcu, std::uint8_t motor, Tick start, const McuRun& run) {
  look_again();
  streams_.follow_run(mcu, motor, start, run);
  if (std::holds_alternative<LineRun>(run)) synchroniser_.lines_run(true);
}

void Rs485Master::replace(McuIndex mcu, std::uint16_t motors, Tick first) {
  look_again();
  streams_.replace(mcu, motors, first, stepped_us_);
}

BusSnapshot Rs485Master::snapshot(std::int64_t now_us) const {
  return BusSnapshot{.setup = &setup_,
                     .mcus = mcus_,
                     .clock = clock(),
                     .queue_us = horizon_.queue_target_us(),
                     .now_us = now_us};
}

std::uint8_t Rs485Master::arm(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                              std::span<const Armed> moves) {
  McuRecord& record = mcus_[mcu];
  std::vector<bushd_table_run_entry> entries;
  for (const Armed& move : moves) {
    entries.push_back(
        entry_of(move.motor, record.setup.table_of_motor[move.motor].value_or(0), move.run));
  }
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return a.motor < b.motor; });
  const std::uint8_t number = next_trigger_number(record);
  ask(mcu, request_of(BUSHD_MSG_TRIGGER, [&](std::uint8_t* to) {
        return bushd_encode_trigger(number, edge, delay_us, entries.data(),
                                    static_cast<std::uint8_t>(entries.size()), to);
      }));
  return number;
}

std::uint8_t Rs485Master::arm_line(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                                   std::span<const ArmedOnLine> parts) {
  std::vector<bushd_line_entry> entries;
  for (const auto& [motor, run] : parts) {
    entries.push_back({motor, static_cast<std::int8_t>(run.direction), run.increment});
  }
  std::ranges::sort(entries, {}, &bushd_line_entry::motor);
  const std::uint8_t number = next_trigger_number(mcus_[mcu]);
  const bushd_line_trigger message = {.number = number,
                                      .edge = edge,
                                      .delay_us = delay_us,
                                      .line = line_part_of(parts.front().run)};
  ask(mcu, request_of(BUSHD_MSG_LINE_TRIGGER, [&](std::uint8_t* to) {
        return bushd_encode_line_trigger(&message, entries.data(),
                                         static_cast<std::uint8_t>(entries.size()), to);
      }));
  return number;
}

std::uint8_t Rs485Master::travel(McuIndex mcu, bushd_travel message) {
  message.number = next_trigger_number(mcus_[mcu]);
  ask(mcu, request_of(message));
  return message.number;
}

void Rs485Master::end_travel(McuIndex mcu, std::uint8_t motor) {
  bushd_travel message{};
  message.kind = BUSHD_TRAVEL_NONE;
  message.motor = motor;
  ask(mcu, request_of(message));
}

// Time for each order, one of them said again, and its motors' rest.
Tick Rs485Master::earliest_program_start(std::int64_t now_us,
                                         std::span<const McuIndex> mcus) const {
  const std::int64_t order_us =
      writer_.line_us(BUSHD_PROGRAM_CONTROL_SIZE + 1 + 2 * (BUSHD_FRAME_OVERHEAD + 1)) +
      fieldbus::kFirstWindowUs;
  const std::int64_t orders_us = static_cast<std::int64_t>(mcus.size()) * order_us;
  Tick earliest = horizon_.earliest_start(now_us) + clock().ticks_in(kRunConfirmedUs + orders_us);
  for (const McuIndex mcu : mcus) {
    const std::uint16_t motors = connector_.program(mcu).view().state.motors;
    for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      if ((motors >> m & 1) != 0) earliest = std::max(earliest, streams_.next_tick(mcu, m));
    }
  }
  return earliest;
}

void Rs485Master::stop_program(McuIndex mcu, bushd_stop_mode mode) {
  look_again();
  if (mcus_[mcu].view.phase != McuPhase::kOffline) connector_.program(mcu).stop(mode);
}

void Rs485Master::emergency_stop(bushd_stop_mode mode) {
  look_again();
  emergency_.begin(mode);
  for (const McuIndex i : mcus_.indices()) streams_.drop_all(i);
  connector_.emergency_stop(mode);
}

void Rs485Master::bind_to_stop(McuIndex mcu, bushd_stop_mode mode) {
  look_again();
  connector_.bind_to_stop(mcu, mode);
}

void Rs485Master::reconfigure(McuIndex mcu, McuSetup setup) {
  look_again();
  if (connector_.reconfigure(mcu, std::move(setup))) streams_.drop_all(mcu);
}

Result<void> Rs485Master::check_room(McuIndex mcu, const McuSetup& setup) const {
  return connector_.check_room(mcu, setup);
}

void Rs485Master::reset_low_water() {
  for (McuRecord& mcu : mcus_) mcu.health.low_water_ticks.reset();
}

}  // namespace bushd::link
