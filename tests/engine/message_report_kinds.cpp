// POLL, and REPORT, which answers it.
#include <array>
#include <bit>

#include "engine/message_kinds.h"

namespace bushd::test {
namespace {

void tell_sections(const bushd_report& m, Fields& f) {
  if (m.sections & BUSHD_TELLS_BOOT) {
    f.add("reset_cause", m.reset_cause).add("failed_tests", m.failed_tests);
    f.add("motor_count", m.motor_count, 0, BUSHD_MOTORS_PER_MCU);
  }
  if (m.sections & BUSHD_TELLS_SYNC) {
    f.add("sync_id", m.sync_id).add("sync_tick", m.sync_tick).add("sync_ns", m.sync_ns);
    f.add("rate_ppb", m.rate_ppb);
  }
  if (m.sections & BUSHD_TELLS_INPUTS) {
    f.add("inputs", m.inputs).add("forbidden_positive", m.forbidden_positive);
    f.add("forbidden_negative", m.forbidden_negative).add("system_inputs", m.system_inputs);
  }
  if (m.sections & BUSHD_TELLS_COUNTERS) {
    f.add("bad_frames", m.bad_frames).add("rejected_frames", m.rejected_frames);
    f.add("last_rejection", m.last_rejection).add("ramp_downs", m.ramp_downs);
  }
  if (m.sections & BUSHD_TELLS_MOTION) {
    f.add("running", m.running).add("autonomous", m.autonomous);
    f.add("low_water_ticks", m.low_water_ticks).add("out_of_order", m.out_of_order);
    f.add("out_of_order_from", m.out_of_order_from).add("out_of_order_until", m.out_of_order_until);
  }
  if (m.sections & BUSHD_TELLS_AUTONOMOUS) {
    f.add("homed", m.homed).add("homing", m.homing).add("armed", m.armed);
    f.add("trigger_number", m.trigger_number)
        .add("trigger_state", m.trigger_state, 0, BUSHD_TRIGGER_FORBIDDEN);
    f.add("start_tick", m.start_tick).add("start_ns", m.start_ns);
  }
}

void tell(const bushd_poll& m, Fields& f) {
  f.add("count", m.count, 1, BUSHD_POLL_MAX_ENTRIES);
  f.promise_inside(m.entries, BUSHD_POLL_ENTRY * m.count, "entries");
  if (!f.in_range()) return;
  std::string entries;
  for (size_t i = 0; i < m.count; ++i) {
    const uint8_t* const at = m.entries + BUSHD_POLL_ENTRY * i;
    append(&entries, parts({at[0], bushd_get_u16(at + 1), at[3], at[4]}));
  }
  f.add_text("entries", entries);
}

void tell(const bushd_report& m, Fields& f) {
  f.add("state", m.state, 0, BUSHD_STATE_FAULT)
      .add("faults", m.faults)
      .add("flags", m.flags)
      .add("epoch", m.epoch);
  f.add("boot_number", m.boot_number)
      .add("number", m.number)
      .add("sections", m.sections, 0, BUSHD_TELLS_ALL);
  f.add("motors", m.motors).add("moving", m.moving).add("current", m.current);
  f.add("tick", m.tick).add("tick_ns", m.tick_ns);
  tell_sections(m, f);
  std::string motors;
  for (size_t i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    if ((m.motors >> i & 1) == 0) continue;
    append(&motors, parts({m.motor[i].position_steps, m.motor[i].known_until}));
  }
  if (m.motors != 0) f.add_text("motor", motors);
}

// As a report before has told.
constexpr bushd_report kAllMotors = [] {
  bushd_report report{};
  report.motor_count = BUSHD_MOTORS_PER_MCU;
  return report;
}();

// With a section at least, so that a number of 0 is wrong. Sizes as in docs/protocol.md.
Bytes any_report() {
  constexpr std::array<size_t, 6> kSectionBytes = {3, 16, 7, 7, 12, 15};
  const auto sections = between<uint8_t>(1, 63);
  const auto motors = *rc::gen::arbitrary<uint16_t>();
  size_t size = 22;
  size_t motor_count_at = 0;
  size_t trigger_state_at = 0;
  for (size_t i = 0; i < kSectionBytes.size(); ++i) {
    if ((sections >> i & 1) == 0) continue;
    if (i == 0) motor_count_at = size + 2;
    if (i == 5) trigger_state_at = size + 6;
    size += kSectionBytes[i];
  }
  Bytes payload = random_bytes(size + 6u * static_cast<size_t>(std::popcount(motors)));
  payload[0] = between<uint8_t>(0, 3);
  payload[6] = between<uint8_t>(1, 255);
  payload[7] = sections;
  bushd_put_u16(&payload[8], motors);
  if (motor_count_at != 0) payload[motor_count_at] = BUSHD_MOTORS_PER_MCU;
  if (trigger_state_at != 0) payload[trigger_state_at] = between<uint8_t>(0, 6);
  return payload;
}

size_t encode_poll(const bushd_poll* m, uint8_t* payload) {
  std::vector<bushd_poll_entry> entries;
  for (size_t i = 0; i < m->count; ++i) {
    const uint8_t* const at = m->entries + BUSHD_POLL_ENTRY * i;
    entries.push_back({at[0], bushd_get_u16(at + 1), at[3], at[4]});
  }
  return bushd_encode_poll(entries.data(), m->count, payload);
}

Bytes any_poll() {
  const auto count = between<uint8_t>(1, BUSHD_POLL_MAX_ENTRIES);
  Bytes payload = random_bytes(1u + BUSHD_POLL_ENTRY * count);
  payload[0] = count;
  return payload;
}

}  // namespace

Kinds report_kinds() {
  return {
      {"poll", {any_poll, codec(bushd_decode_poll, encode_poll, tell), {}}},
      {"report",
       {any_report,
        codec(bushd_decode_report, bushd_encode_report, tell, &kAllMotors),
        {{"state 4", set8(0, 4)},
         {"a section that is none", set8(7, 0x40)},
         {"no number, but sections", set8(6, 0)}}}},
  };
}

}  // namespace bushd::test
