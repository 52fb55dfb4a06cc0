// From silence to a configured MCU in step with its tables in place, and back.
//
// An MCU that is looked for is asked once directly and once in reply slots, by turns: two MCUs that
// have the same address talk over each other, but rarely choose the same slot.
#include <algorithm>
#include <cstring>

#include "link/faults.h"
#include "link/master.h"
#include "link/master_limits.h"
#include "link/unique_id.h"

namespace bushd::link {
namespace {

constexpr unsigned kMinQueueTicks = 2 * kMaxTicksPerFrame;  // one runs while the next arrives
constexpr std::int64_t kMinQueueUs = 150'000;               // two lost answers and a frame
// Table runs go on without a word from here for as long: more than a busy PC needs to come back.
constexpr std::int64_t kSilenceUs = 1'000'000;
constexpr unsigned kIdentifySlots = 8;
constexpr std::int64_t kReplyUnitUs = BUSHD_REPLY_UNIT_NS / 1000;
// While one of these is latched the MCU refuses to raise EN.
constexpr unsigned kFaultsWithoutEnable = BUSHD_FAULT_SELF_TEST | BUSHD_FAULT_OVERCURRENT;

bool same_id(const bushd_identity& a, const bushd_identity& b) {
  return std::memcmp(a.unique_id, b.unique_id, BUSHD_UNIQUE_ID_SIZE) == 0;
}

// A motor's table makes more steps in a tick than the emission has room for.
std::string lacks_time(const McuSetup& setup, const bushd_identity& identity,
                       std::uint32_t tick_ns) {
  unsigned room = 0;
  const std::string why = fieldbus::emission_misfit(setup.emission, identity, tick_ns, &room);
  if (!why.empty()) return why;
  for (std::size_t output = 0; output < setup.table_of_motor.size(); ++output) {
    const auto slot = setup.table_of_motor[output];
    if (!slot) continue;
    const bushd_table* table = setup.tables[*slot].table;
    const std::uint32_t steps = bushd_table_max_steps_per_tick(table, tick_ns);
    if (steps <= room) continue;
    return "has room for " + std::to_string(room) +
           " steps of a motor in a tick, with its emission in " + std::to_string(identity.slots) +
           " slots, but the table of output " + std::to_string(output) + " makes up to " +
           std::to_string(steps) + ": use a slower table, or less step_us or dir_setup_us";
  }
  return {};
}

std::string lacks_room(const McuSetup& setup, const bushd_identity& identity,
                       std::uint32_t tick_ns) {
  std::size_t codes = 0;
  for (const TableRef& ref : setup.tables) {
    codes += ref.table->accel.count;
    if (ref.table->decel.code != ref.table->accel.code) codes += ref.table->decel.count;
  }
  if (codes <= identity.table_codes) return lacks_time(setup, identity, tick_ns);
  return "has memory for " + std::to_string(identity.table_codes) +
         " table codes, but its motors' tables need " + std::to_string(codes) +
         ": use shorter tables or fewer on this MCU";
}

// What an MCU refused of its configuration, and what can be done about it.
std::string refusal_text(std::uint8_t type, unsigned status) {
  struct Request {
    std::uint8_t type;
    const char* name;
    const char* if_too_much;  // remedy
  };
  constexpr const char* kTables = "use shorter or slower tables, or fewer on this MCU";
  static constexpr std::array<Request, 7> kRequests = {{
      {BUSHD_MSG_CONFIGURE, "CONFIGURE", "use a longer tick_us on its bus"},
      {BUSHD_MSG_TABLE_BEGIN, "TABLE_BEGIN", kTables},
      {BUSHD_MSG_TABLE_DATA, "TABLE_DATA", kTables},
      {BUSHD_MSG_TABLE_END, "TABLE_END", kTables},
      {BUSHD_MSG_ASSIGN, "ASSIGN", kTables},
      {BUSHD_MSG_INPUTS, "INPUTS", nullptr},
      {BUSHD_MSG_LOCAL, "LOCAL", nullptr},
  }};
  const auto* const request =
      std::find_if(kRequests.begin(), kRequests.end(),
                   [type](const Request& candidate) { return candidate.type == type; });
  const bool known = request != kRequests.end();
  const bool too_much = known && status == BUSHD_E_CAPACITY && request->if_too_much != nullptr;
  return (known ? std::string(request->name) + ": " : std::string()) + bushd_status_text(status) +
         "; " + (too_much ? request->if_too_much : fieldbus::remedy_of(status));
}

}  // namespace

bool Master::send_due_identify(std::int64_t now_us) {
  for (const McuIndex i : mcus_.indices()) {
    Mcu& mcu = mcus_[i];
    if (mcu.view.phase != McuPhase::kOffline || mcu.retry_due_us > now_us) continue;
    const unsigned slots = mcu.looks++ % 2 == 0 ? 1 : kIdentifySlots;
    const std::int64_t slot_us =
        writer_.line_us(BUSHD_IDENTITY_SIZE + BUSHD_FRAME_OVERHEAD + 1) + kSlotGuardUs;
    const bushd_identify identify = {
        .salt = ++salt_,
        .slots = static_cast<std::uint8_t>(slots),
        .slot_units = static_cast<std::uint16_t>(slot_us * 1000 / BUSHD_REPLY_UNIT_NS + 1)};
    std::array<std::uint8_t, 8> payload;
    const std::size_t size = bushd_encode_identify(&identify, payload.data());
    identities_.clear();
    // Slots are counted in whole units, so each may last one longer.
    transactions_.ask(now_us, {.mcu = i,
                               .address = mcu.setup.address,
                               .type = BUSHD_MSG_IDENTIFY,
                               .payload = {payload.data(), size},
                               .reply_payload = BUSHD_IDENTITY_SIZE,
                               .reply_slots = slots,
                               .reply_slots_us = slots * (slot_us + kReplyUnitUs)});
    return true;
  }
  return false;
}

void Master::finish_identify(std::int64_t now_us, McuIndex index) {
  if (identities_.empty()) return;
  Mcu& mcu = mcus_[index];
  const bushd_identity& first = identities_.front();
  const auto other = std::find_if(identities_.begin(), identities_.end(),
                                  [&first](const bushd_identity& i) { return !same_id(first, i); });
  if (other == identities_.end()) {
    handle_identity(now_us, index, first);
    return;
  }
  mcu.view.detail = "shares its address " + std::to_string(mcu.setup.address.value) +
                    " with another: unique ids " + unique_id_text(first) + " and " +
                    unique_id_text(*other) +
                    "; unplug one, or give one another address with 'bushctl address'";
  mcu.retry_due_us = now_us + kRefusedRetryUs;
  mcu.looks = 1;  // in slots again
}

std::string Master::unfit(const Mcu& mcu, const bushd_identity& identity) const {
  if (identity.protocol_version != BUSHD_PROTOCOL_VERSION) {
    return "speaks protocol version " + std::to_string(identity.protocol_version) +
           ", this program version " + std::to_string(BUSHD_PROTOCOL_VERSION) +
           ": update the older of the two";
  }
  const bool fine = setup_.format == BUSHD_FORMAT_FINE;
  if ((identity.capabilities & (fine ? BUSHD_CAN_FINE : BUSHD_CAN_COARSE)) == 0) {
    return std::string("does not know the ") + (fine ? "fine" : "coarse") +
           " format: choose the other one for this bus";
  }
  for (unsigned m = identity.motors; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (mcu.setup.table_of_motor[m]) {
      return "has only " + std::to_string(identity.motors) + " outputs, but output " +
             std::to_string(m) + " is configured";
    }
  }
  if (const std::string why = lacks_room(mcu.setup, identity, setup_.tick_ns); !why.empty()) {
    return why;
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

std::string Master::no_room(McuIndex index, const McuSetup& setup) const {
  const McuView& view = mcus_[index].view;
  return view.identified ? lacks_room(setup, view.identity, setup_.tick_ns) : std::string();
}

void Master::handle_identity(std::int64_t now_us, McuIndex index, const bushd_identity& identity) {
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
  mcu.taken_over = false;
  mcu.script.clear();
  mcu.looks = 0;
  mcu.poll_wanted = true;
  sync_due_us_ = std::min(sync_due_us_, now_us);
}

void Master::add_control(Mcu& mcu, std::uint8_t actions) {
  const bushd_control message = {actions};
  add_request(mcu, BUSHD_MSG_CONTROL,
              [&](std::uint8_t* p) { return bushd_encode_control(&message, p); });
}

// What comes after depends on the tables that the MCU has already.
void Master::write_script(Mcu& mcu) const {
  const bushd_configure configure = {.tick_ns = setup_.tick_ns,
                                     .format = setup_.format,
                                     .silence_ticks = static_cast<std::uint16_t>(
                                         std::min<Tick>(ticks_in(kSilenceUs), UINT16_MAX))};
  // What a master before this one has armed nobody here knows of.
  if (mcu.view.report.armed != 0) add_disarm(mcu);
  add_request(mcu, BUSHD_MSG_CONFIGURE,
              [&](std::uint8_t* p) { return bushd_encode_configure(&configure, p); });
  add_request(mcu, BUSHD_MSG_EMISSION, [&](std::uint8_t* p) {
    return bushd_encode_emission(&mcu.setup.emission.settings, p);
  });
  add_request(mcu, BUSHD_MSG_INPUTS,
              [&](std::uint8_t* p) { return bushd_encode_set_inputs(&mcu.setup.inputs, p); });
  mcu.script.push_back({.type = BUSHD_MSG_TABLES, .payload = {}});
}

void Master::add_table(Mcu& mcu, std::uint8_t slot) {
  const TableRef& ref = mcu.setup.tables[slot];
  const bushd_table& table = *ref.table;
  const bool symmetric = table.decel.code == table.accel.code;
  std::vector<std::uint16_t> codes(table.accel.code, table.accel.code + table.accel.count);
  if (!symmetric) {
    codes.insert(codes.end(), table.decel.code, table.decel.code + table.decel.count);
  }
  const bushd_table_begin begin = {
      .slot = slot,
      .accel_count = static_cast<std::uint16_t>(table.accel.count),
      .decel_count = static_cast<std::uint16_t>(symmetric ? 0 : table.decel.count),
      .cruise = table.cruise,
      .time_unit_ns = table.time_unit_ns,
      .revision = ref.revision};
  add_request(mcu, BUSHD_MSG_TABLE_BEGIN,
              [&](std::uint8_t* p) { return bushd_encode_table_begin(&begin, p); });
  for (std::size_t at = 0; at < codes.size(); at += BUSHD_TABLE_DATA_MAX_CODES) {
    const auto count = static_cast<std::uint8_t>(
        std::min<std::size_t>(codes.size() - at, BUSHD_TABLE_DATA_MAX_CODES));
    add_request(mcu, BUSHD_MSG_TABLE_DATA, [&](std::uint8_t* p) {
      return bushd_encode_table_data(slot, static_cast<std::uint16_t>(at), count, &codes[at], p);
    });
  }
  const bushd_table_end end = {.slot = slot, .crc = bushd_table_crc32(&table)};
  add_request(mcu, BUSHD_MSG_TABLE_END,
              [&](std::uint8_t* p) { return bushd_encode_table_end(&end, p); });
}

// If the MCU has other tables than it should, it gets all of them anew: so none that nobody needs
// any more takes up its memory. Then it is told whose motor each one is.
void Master::handle_tables(McuIndex index, const bushd_tables& held) {
  Mcu& mcu = mcus_[index];
  if (mcu.script.empty() || mcu.script.front().type != BUSHD_MSG_TABLES) return;
  mcu.script.pop_front();
  bool same = true;
  for (std::size_t slot = 0; slot < BUSHD_TABLE_SLOTS; ++slot) {
    const bushd_table_held& there = held.slot[slot];
    const bool wanted = slot < mcu.setup.tables.size();
    same &= there.valid == wanted;
    if (!there.valid || !wanted) continue;
    const TableRef& ref = mcu.setup.tables[slot];
    same &= there.crc == bushd_table_crc32(ref.table) && there.revision == ref.revision;
  }
  if (!same) {
    add_control(mcu, BUSHD_CONTROL_FORGET_TABLES);
    for (std::uint8_t slot = 0; slot < mcu.setup.tables.size(); ++slot) add_table(mcu, slot);
  }
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (!mcu.setup.table_of_motor[m]) continue;
    const bushd_assign assign = {m, *mcu.setup.table_of_motor[m]};
    add_request(mcu, BUSHD_MSG_ASSIGN,
                [&](std::uint8_t* p) { return bushd_encode_assign(&assign, p); });
  }
  if (mcu.view.identity.capabilities & BUSHD_CAN_LOCAL) {
    const bushd_local local = {mcu.setup.local_motors};
    add_request(mcu, BUSHD_MSG_LOCAL,
                [&](std::uint8_t* p) { return bushd_encode_local(&local, p); });
  }
  unsigned faults = mcu.view.report.faults;
  // The emergency stop that took the MCU over is nobody's.
  if (mcu.taken_over) faults &= ~unsigned{BUSHD_FAULT_EMERGENCY};
  const bool clear = !emergency_ && (faults & kPeoplesFaults) == 0;
  std::uint8_t actions = clear ? BUSHD_CONTROL_CLEAR_FAULTS : 0;
  if (mcu.powered.value_or(true) && (faults & kFaultsWithoutEnable) == 0) {
    actions |= BUSHD_CONTROL_ENABLE;
  }
  add_control(mcu, actions);
}

void Master::handle_acknowledgement(std::int64_t now_us, McuIndex index, std::uint8_t type,
                                    std::uint8_t status) {
  Mcu& mcu = mcus_[index];
  if (!mcu.script.empty() && mcu.script.front().type == type) mcu.script.pop_front();
  mcu.poll_wanted = mcu.script.empty();
  if (status == BUSHD_OK) return;
  if (mcu.view.phase == McuPhase::kOnline) {
    events_.push_back(RequestRefused{.mcu = index, .type = type, .status = status});
    return;
  }
  go_offline(index,
             "refused its configuration: " +
                 (type == BUSHD_MSG_EMISSION
                      ? fieldbus::emission_refusal(mcu.setup.emission, status,
                                                   mcu.view.identity.slots, setup_.tick_ns)
                      : refusal_text(type, status)),
             now_us + kRetryUs);
}

void Master::follow_connecting(std::int64_t now_us, McuIndex index, bool in_step) {
  Mcu& mcu = mcus_[index];
  const bushd_report& report = mcu.view.report;
  const bool configured = (report.flags & BUSHD_FLAG_CONFIGURED) != 0;
  if (!mcu.powered) {
    const bool switched_off = configured && (report.flags & BUSHD_FLAG_ENABLED) == 0;
    mcu.powered = !switched_off;
  }
  if (!configured && report.reset_cause == BUSHD_RESET_WATCHDOG && mcu.setup.off_after_watchdog) {
    mcu.powered = false;
  }
  // Tables are for motors at rest, and one may still be running down from before. But a table run
  // of an earlier master could go on for hours.
  if (!mcu.scripted && report.moving == 0) {
    write_script(mcu);
    mcu.scripted = true;
  } else if (!mcu.scripted && report.running != 0) {
    mcu.taken_over |= (report.faults & BUSHD_FAULT_EMERGENCY) == 0;
    mcu.ramp_down_now = true;
  } else if (!mcu.scripted || !mcu.script.empty() || !in_step) {
    return;
  } else if (report.state != BUSHD_STATE_BUSY || !*mcu.powered) {
    mcu.view.phase = McuPhase::kOnline;
    mcu.view.detail.clear();
    mcu.epoch = mcu.newest_epoch = report.epoch;
    events_.push_back(McuOnline{index});
  } else if (configured && (report.flags & BUSHD_FLAG_ENABLED) == 0) {
    // It had a fault with which it must not be enabled, and has it no longer.
    go_offline(index, "has not switched its drivers on", now_us + kRetryUs);
  }
}

void Master::go_offline(McuIndex index, const std::string& cause, std::int64_t retry_due_us) {
  Mcu& mcu = mcus_[index];
  const bool was_online = mcu.view.phase == McuPhase::kOnline;
  mcu.view.phase = McuPhase::kOffline;
  mcu.view.detail = cause;
  mcu.retry_due_us = retry_due_us;
  mcu.looks = 0;
  mcu.silent = 0;
  mcu.poll_wanted = false;
  mcu.script.clear();
  drop_streams(mcu);
  if (was_online) events_.push_back(McuOffline{index});
}

}  // namespace bushd::link
