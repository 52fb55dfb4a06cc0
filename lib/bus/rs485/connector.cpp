#include "bus/rs485/connector.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "bus/bus_times.h"
#include "bus/rs485/faults.h"
#include "bus/rs485/mcu_fit.h"
#include "bus/rs485/unique_id.h"

namespace bushd::link {
namespace {

// Table runs go on without a word from here for as long: more than a busy PC needs to come back.
constexpr std::int64_t kCommTimeoutUs = 1'000'000;
constexpr unsigned kIdentifyWindows = 8;
constexpr std::int64_t kReplyUnitUs = BUSHD_REPLY_UNIT_NS / 1000;
// While one of these is latched the MCU refuses to raise EN.
constexpr unsigned kFaultsWithoutEnable =
    BUSHD_FAULT_SELF_TEST | BUSHD_FAULT_OVERCURRENT | BUSHD_FAULT_DISABLED;
constexpr std::int64_t kRetryUs = 500'000;           // between two IDENTIFYs to an MCU
constexpr std::int64_t kRefusedRetryUs = 2'000'000;  // that does not fit: no hurry

bool same_id(const bushd_identity& a, const bushd_identity& b) {
  return std::memcmp(a.unique_id, b.unique_id, BUSHD_UNIQUE_ID_SIZE) == 0;
}

bool is_part_of_table(std::uint8_t type) {
  return type == BUSHD_MSG_TABLE_BEGIN || type == BUSHD_MSG_TABLE_DATA ||
         type == BUSHD_MSG_TABLE_END;
}

}  // namespace

Connector::Connector(const BusSetup& setup, PerMcu<McuRecord>& mcus, Transactions& transactions,
                     FrameWriter& writer, Listener& listener)
    : setup_(setup),
      mcus_(mcus),
      transactions_(transactions),
      writer_(writer),
      listener_(listener),
      links_(mcus.size()) {}

void Connector::port_opened(std::int64_t now_us) {
  for (const McuIndex i : mcus_.indices()) {
    mcus_[i].view.detail = "no answer yet";
    links_[i].retry_due_us = now_us;
  }
  unanswered_due_us_ = now_us;
}

bool Connector::reconfigure(McuIndex mcu, McuSetup setup) {
  McuRecord& record = mcus_[mcu];
  record.setup = std::move(setup);
  if (record.view.phase == McuPhase::kOffline) return false;
  links_[mcu].was_online |= record.view.phase == McuPhase::kOnline;
  record.view.phase = McuPhase::kConnecting;
  record.view.detail = "being configured";
  record.poll_wanted = true;
  links_[mcu].setup_written = links_[mcu].adopts = links_[mcu].left_alone = false;
  links_[mcu].queue.discard_setup();
  links_[mcu].scratch.clear();
  return true;
}

Result<void> Connector::check_room(McuIndex mcu, const McuSetup& setup) const {
  const McuView& view = mcus_[mcu].view;
  if (!view.identified) return {};
  return link::check_room(setup, view.identity, setup_.tick_ns);
}

void Connector::control(McuIndex mcu, std::uint8_t actions) {
  if (actions & BUSHD_CONTROL_ENABLE) links_[mcu].powered = true;
  if (actions & BUSHD_CONTROL_DISABLE) links_[mcu].powered = false;
  if (actions & BUSHD_CONTROL_CLEAR_FAULTS) links_[mcu].clearing = true;
  add_control(mcu, actions);
}

// What has come up since the last report, or comes while this is on its way, nobody has seen: it
// is not cleared with the rest.
void Connector::add_control(McuIndex mcu, std::uint8_t actions) {
  const McuView& view = mcus_[mcu].view;
  bushd_control message{.actions = actions, .faults = 0};
  if ((actions & BUSHD_CONTROL_CLEAR_FAULTS) != 0 &&
      (view.identity.capabilities & BUSHD_CAN_CLEAR_NAMED) != 0) {
    message.faults = view.report.faults;
    if (view.bound_by_stop) message.faults |= BUSHD_FAULT_EMERGENCY;
    if (message.faults == 0) message.actions ^= BUSHD_CONTROL_CLEAR_FAULTS;
  }
  links_[mcu].queue.ask(message);
}

void Connector::emergency_stop(bushd_stop_mode mode) {
  for (const McuIndex i : mcus_.indices()) bind_to_stop(i, mode);
}

void Connector::bind_to_stop(McuIndex mcu, bushd_stop_mode mode) {
  Link& link = links_[mcu];
  mcus_[mcu].view.bound_by_stop = true;
  link.stop_mode = mode;
  link.clearing = false;
  link.queue.discard_clearing();
  link.program.discard_motion();
  link.stop_now = mcus_[mcu].view.phase == McuPhase::kConnecting;
}

void Connector::follow_stop(McuIndex mcu) {
  McuView& view = mcus_[mcu].view;
  Link& link = links_[mcu];
  if ((view.report.faults & BUSHD_FAULT_EMERGENCY) != 0) {
    // The emergency stop that took the MCU over is nobody's.
    view.bound_by_stop |= !link.taken_over;
  } else if (link.clearing) {
    view.bound_by_stop = link.clearing = false;
  }
}

void Connector::inhibit_local(McuIndex mcu, std::uint16_t motors) {
  links_[mcu].not_local = motors;
  if (mcus_[mcu].view.phase == McuPhase::kOnline) tell_local(mcu);
}

void Connector::tell_local(McuIndex mcu) {
  const McuRecord& record = mcus_[mcu];
  Link& link = links_[mcu];
  if ((record.view.identity.capabilities & BUSHD_CAN_LOCAL) == 0) return;
  bushd_local local = record.setup.local;
  local.motors &= static_cast<std::uint16_t>(~link.not_local);
  local.keypad &= static_cast<std::uint16_t>(~link.not_local);
  link.not_local_told = link.not_local;
  link.queue.ask(local);
}

// The others have their turns first. Only one that has not answered before costs the bus a
// time-out.
std::int64_t Connector::retry_due_us(McuIndex mcu) const {
  const Link& link = links_[mcu];
  const bool may_cost = link.identify_attempts > 0;
  return may_cost ? std::max(link.retry_due_us, unanswered_due_us_) : link.retry_due_us;
}

bool Connector::send_due_identify(std::int64_t now_us) {
  for (std::size_t n = 0; n < mcus_.size(); ++n) {
    const McuIndex i{(identify_turn_ + n) % mcus_.size()};
    if (mcus_[i].view.phase != McuPhase::kOffline || retry_due_us(i) > now_us) continue;
    identify_turn_ = i.value + 1;
    const unsigned windows = links_[i].identify_attempts++ % 2 == 0 ? 1 : kIdentifyWindows;
    const std::int64_t window_us =
        writer_.line_us(BUSHD_IDENTITY_SIZE + BUSHD_FRAME_OVERHEAD + 1) + writer_.window_guard_us();
    const bushd_identify identify = {
        .salt = ++salt_,
        .windows = static_cast<std::uint8_t>(windows),
        .window_units = static_cast<std::uint16_t>(window_us * 1000 / BUSHD_REPLY_UNIT_NS + 1)};
    std::array<std::uint8_t, 8> payload;
    const std::size_t size = bushd_encode_identify(&identify, payload.data());
    identities_.clear();
    // Windows are counted in whole units, so each may last one longer.
    transactions_.ask(now_us, {.mcu = i,
                               .address = mcus_[i].setup.address,
                               .type = BUSHD_MSG_IDENTIFY,
                               .payload = {payload.data(), size},
                               .reply_payload = BUSHD_IDENTITY_SIZE,
                               .reply_windows = windows,
                               .reply_windows_us = windows * (window_us + kReplyUnitUs)});
    return true;
  }
  return false;
}

void Connector::want_report(McuIndex mcu, bool wanted) {
  const bool connects = mcus_[mcu].view.phase == McuPhase::kConnecting;
  links_[mcu].report_wanted = wanted && connects;
  mcus_[mcu].poll_wanted = wanted && !connects;
}

void Connector::ask_for_reports() {
  for (const McuIndex i : mcus_.indices()) {
    const Link& link = links_[i];
    const bool connects = mcus_[i].view.phase == McuPhase::kConnecting;
    if (connects && (!link.queue.empty() || link.program.wants_state())) return;
  }
  for (const McuIndex i : mcus_.indices()) {
    mcus_[i].poll_wanted |= std::exchange(links_[i].report_wanted, false);
  }
}

bool Connector::send_stop(std::int64_t now_us) {
  for (const McuIndex i : mcus_.indices()) {
    const McuView& view = mcus_[i].view;
    if (view.phase != McuPhase::kConnecting || !links_[i].stop_now) continue;
    links_[i].stop_now = false;
    const bushd_stop_mode mode = view.bound_by_stop ? links_[i].stop_mode : BUSHD_STOP_RAMP;
    const std::array<std::uint8_t, 1> payload = {static_cast<std::uint8_t>(mode)};
    writer_.send(now_us, mcus_[i].setup.address, BUSHD_MSG_EMERGENCY, payload);
    return true;
  }
  return false;
}

const Request* Connector::next_request(std::int64_t now_us, McuIndex mcu) {
  Link& link = links_[mcu];
  if (!link.queue.empty()) return &link.queue.front();
  return link.program.has_request(now_us) ? &link.program.ask(now_us) : nullptr;
}

const Request* Connector::next_part(McuIndex mcu) {
  Link& link = links_[mcu];
  if (link.scratch.under_way()) return &link.scratch.ask();
  return link.program.has_part() ? &link.program.ask_part() : nullptr;
}

bool Connector::send_request(std::int64_t now_us) {
  return send_first(now_us, turn_, [&](McuIndex mcu) { return next_request(now_us, mcu); }) ||
         send_first(now_us, part_turn_, [this](McuIndex mcu) { return next_part(mcu); });
}

bool Connector::send_program_stop(std::int64_t now_us) {
  return send_first(now_us, program_turn_, [&](McuIndex mcu) -> const Request* {
    ProgramLink& program = links_[mcu].program;
    return program.is_urgent(now_us) ? &program.ask(now_us) : nullptr;
  });
}

template <class Next>
bool Connector::send_first(std::int64_t now_us, std::size_t& turn, Next next) {
  for (std::size_t n = 0; n < mcus_.size(); ++n) {
    const McuIndex i{(turn + n) % mcus_.size()};
    if (mcus_[i].view.phase == McuPhase::kOffline) continue;
    const Request* request = next(i);
    if (request == nullptr) continue;
    turn = i.value + 1;
    transactions_.ask(now_us, {.mcu = i,
                               .address = mcus_[i].setup.address,
                               .type = request->type,
                               .payload = request->payload,
                               .reply_payload = request->reply_size()});
    return true;
  }
  return false;
}

void Connector::identify_ended(std::int64_t now_us, McuIndex mcu) {
  if (identities_.empty()) return;
  const bushd_identity& first = identities_.front();
  const auto other = std::find_if(identities_.begin(), identities_.end(),
                                  [&first](const bushd_identity& i) { return !same_id(first, i); });
  if (other == identities_.end()) {
    take(now_us, mcu, first);
    return;
  }
  mcus_[mcu].view.detail =
      "shares its address " + std::to_string(mcus_[mcu].setup.address.value) +
      " with another: unique ids " + unique_id_text(first) + " and " + unique_id_text(*other) +
      "; unplug one, or stop bushd and give one another address: 'bushctl address PORT "
      "UNIQUE_ID NEW --baud B'";
  links_[mcu].retry_due_us = now_us + kRefusedRetryUs;
  links_[mcu].identify_attempts = 1;  // in windows again
}

// An IDENTIFY without an answer costs the bus a time-out: once in kRetryUs, however many MCUs are
// offline, as soon as somebody else needs the bus. One that answers is followed by the next at
// once, so that MCUs whose power has come, or whose first answer was lost, are found together.
void Connector::not_found(std::int64_t now_us, McuIndex mcu) {
  const bool needed = std::ranges::any_of(
      mcus_, [](const McuRecord& record) { return record.view.phase != McuPhase::kOffline; });
  links_[mcu].retry_due_us = now_us + kRetryUs;
  unanswered_due_us_ = needed ? now_us + kRetryUs : now_us;
}

void Connector::take(std::int64_t now_us, McuIndex mcu, const bushd_identity& identity) {
  McuRecord& record = mcus_[mcu];
  Link& link = links_[mcu];
  record.view.identity = identity;
  record.view.identified = true;
  if (const auto fit = check_fit(setup_, record.setup, identity); !fit) {
    record.view.detail = fit.error().text();
    link.retry_due_us = now_us + kRefusedRetryUs;
    return;
  }
  record.view.phase = McuPhase::kConnecting;
  record.view.detail = "being configured";
  record.view.reported = false;
  record.poll_wanted = true;
  link.setup_written = false;
  link.taken_over = link.clearing = false;
  link.stop_now = record.view.bound_by_stop;
  link.queue.clear();
  link.scratch.clear();
  link.adopts = link.left_alone = false;
  link.identify_attempts = 0;
  ask_for_program(mcu);
  listener_.found(now_us, mcu);
}

void Connector::write_configuration(McuIndex mcu) {
  const std::int64_t comm_timeout_ticks =
      (kCommTimeoutUs * 1000 + setup_.tick_ns - 1) / setup_.tick_ns;
  const McuRecord& record = mcus_[mcu];
  RequestQueue& queue = links_[mcu].queue;
  // What a master before this one has armed nobody here knows of.
  if (record.view.report.armed != 0) queue.ask(disarming());
  queue.ask(bushd_configure{.tick_ns = setup_.tick_ns,
                            .format = setup_.format,
                            .comm_timeout_ticks = static_cast<std::uint16_t>(
                                std::min<std::int64_t>(comm_timeout_ticks, UINT16_MAX))});
  // Neither is taken where STEP would rest high and windings be driven.
  const bool phases = record.setup.emission.settings.mode == BUSHD_EMISSION_PHASES;
  if (!phases) queue.ask(record.setup.emission.settings);
  if ((record.view.identity.capabilities & BUSHD_CAN_OUTPUTS) != 0) {
    queue.ask(record.setup.outputs);
  }
  if (phases) queue.ask(record.setup.emission.settings);
}

// What comes after depends on the tables that the MCU has already.
void Connector::write_setup(McuIndex mcu) {
  write_configuration(mcu);
  const McuRecord& record = mcus_[mcu];
  RequestQueue& queue = links_[mcu].queue;
  queue.ask(record.setup.inputs);
  for (const bushd_motor_inputs& one : record.setup.motor_inputs) queue.ask(one);
  // An MCU may have kept others.
  if ((record.view.identity.capabilities & BUSHD_CAN_CURRENTS) != 0) {
    for (const bushd_currents& one : record.setup.currents) queue.ask(one);
  }
  if ((record.view.identity.capabilities & BUSHD_CAN_VELOCITY) != 0) {
    for (const bushd_set_velocity& one : record.setup.velocities) queue.ask(one);
  }
  queue.ask_for_tables();
  links_[mcu].setup_written = true;
}

bool Connector::holds_its_tables(McuIndex mcu, const bushd_tables& held) const {
  const std::vector<TableRef>& wanted = mcus_[mcu].setup.tables;
  for (std::size_t bank = 0; bank < BUSHD_TABLE_BANKS; ++bank) {
    const bushd_table_held& there = held.bank[bank];
    if (there.valid != (bank < wanted.size())) return false;
    if (!there.valid) continue;
    const TableRef& ref = wanted[bank];
    if (there.crc != bushd_table_crc32(ref.table) || there.revision != ref.revision) return false;
  }
  return true;
}

// If the MCU has other tables than it should, it gets all of them anew: so none that nobody needs
// any more takes up its memory. Then it is told whose motor each one is.
void Connector::tables(McuIndex mcu, const bushd_tables& held, bool may_clear) {
  const McuRecord& record = mcus_[mcu];
  RequestQueue& queue = links_[mcu].queue;
  if (!queue.done(BUSHD_MSG_TABLES)) return;
  if (links_[mcu].adopts) return adopt_tables(mcu, held, may_clear);
  if (!holds_its_tables(mcu, held)) {
    queue.ask(bushd_control{.actions = BUSHD_CONTROL_FORGET_TABLES, .faults = 0});
    for (std::uint8_t bank = 0; bank < record.setup.tables.size(); ++bank) {
      queue.upload_table(bank, record.setup.tables[bank]);
    }
  }
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (const auto bank = record.setup.table_of_motor[m]) queue.ask(bushd_assign{m, *bank});
  }
  tell_local(mcu);
  add_control(mcu, first_actions(mcu, may_clear));
}

std::uint8_t Connector::first_actions(McuIndex mcu, bool may_clear) const {
  const Link& link = links_[mcu];
  unsigned faults = mcus_[mcu].view.report.faults;
  const bool bound = mcus_[mcu].view.bound_by_stop;
  if (link.taken_over && !bound) faults &= ~unsigned{BUSHD_FAULT_EMERGENCY};
  const bool clear = may_clear && (faults & kPeoplesFaults) == 0;
  std::uint8_t actions = clear ? BUSHD_CONTROL_CLEAR_FAULTS : 0;
  if (enables_ && link.powered.value_or(true) && (faults & kFaultsWithoutEnable) == 0) {
    actions |= BUSHD_CONTROL_ENABLE;
  }
  return actions;
}

void Connector::acknowledged(std::int64_t now_us, McuIndex mcu, std::uint8_t type,
                             std::uint8_t status) {
  McuRecord& record = mcus_[mcu];
  if (ProgramLink::is_about_programs(type)) return program_acknowledged(mcu, type, status);
  // Tables of motors are sent before it is online.
  if (record.view.phase == McuPhase::kOnline && is_part_of_table(type)) {
    return links_[mcu].scratch.acknowledged(type, status);
  }
  links_[mcu].queue.done(type);
  want_report(mcu, links_[mcu].queue.empty());
  record.answered = true;
  if (status == BUSHD_OK) return;
  if (record.view.phase == McuPhase::kOnline || !RequestQueue::may_be_setup(type)) {
    listener_.refused(mcu, type, status);
    return;
  }
  if (links_[mcu].adopts) return leave_alone(mcu);
  give_up(mcu,
          "refused its configuration: " +
              refusal_text(setup_, record.setup, record.view.identity, type, status),
          now_us + kRetryUs);
}

void Connector::note_power(McuIndex mcu) {
  const bushd_report& report = mcus_[mcu].view.report;
  Link& link = links_[mcu];
  const bool configured = (report.flags & BUSHD_FLAG_CONFIGURED) != 0;
  if (!link.powered) {
    const bool switched_off = configured && (report.flags & BUSHD_FLAG_ENABLED) == 0;
    link.powered = !switched_off;
  }
  const bool after_watchdog = !configured && report.reset_cause == BUSHD_RESET_WATCHDOG;
  if (after_watchdog && mcus_[mcu].setup.off_after_watchdog) link.powered = false;
}

void Connector::follow_report(std::int64_t now_us, McuIndex mcu, bool in_step) {
  McuView& view = mcus_[mcu].view;
  Link& link = links_[mcu];
  const bushd_report& report = view.report;
  note_power(mcu);
  if (view.bound_by_stop && !has_obeyed(view, link.stop_mode)) {
    // Nobody answers that frame: it is said until a report shows it.
    link.stop_now = mcus_[mcu].poll_wanted = true;
    return;
  }
  if (!knows_program(mcu)) return;
  if (goes_on_with_program(mcu)) return follow_program(mcu, in_step);
  // Tables are for motors at rest, and one may still be ramping down from before. But a table run
  // of an earlier master could go on for hours.
  if (!link.setup_written && report.moving == 0) {
    write_setup(mcu);
  } else if (!link.setup_written && report.running != 0) {
    link.taken_over |= (report.faults & BUSHD_FAULT_EMERGENCY) == 0;
    link.stop_now = true;
  } else if (!link.setup_written || !link.queue.empty() || !in_step) {
    return;
  } else if (report.state != BUSHD_STATE_BUSY || !*link.powered || !enables_) {
    go_online(mcu);
  } else if ((report.flags & BUSHD_FLAG_CONFIGURED) != 0 &&
             (report.flags & BUSHD_FLAG_ENABLED) == 0) {
    // It had a fault with which it must not be enabled, and has it no longer.
    give_up(mcu, "has not enabled its drivers", now_us + kRetryUs);
  }
}

void Connector::go_online(McuIndex mcu) {
  Link& link = links_[mcu];
  mcus_[mcu].view.phase = McuPhase::kOnline;
  mcus_[mcu].view.detail.clear();
  link.was_online = link.taken_over = false;
  // Told while it connected, its ticks may have been others.
  if (link.adopts) link.program.want_state();
  if (link.not_local != link.not_local_told) tell_local(mcu);
  listener_.came_online(mcu);
}

void Connector::give_up(McuIndex mcu, const std::string& cause, std::int64_t retry_due_us) {
  McuView& view = mcus_[mcu].view;
  const bool was_online =
      std::exchange(links_[mcu].was_online, false) || view.phase == McuPhase::kOnline;
  view.phase = McuPhase::kOffline;
  view.detail = cause;
  links_[mcu].retry_due_us = retry_due_us;
  links_[mcu].identify_attempts = 0;
  links_[mcu].report_wanted = false;
  links_[mcu].queue.clear();
  links_[mcu].scratch.clear();
  links_[mcu].program.clear();
  listener_.went_offline(mcu, was_online);
}

void Connector::give_up_unanswering(std::int64_t now_us, McuIndex mcu) {
  give_up(mcu, "does not answer", now_us + kRetryUs);
}

}  // namespace bushd::link
