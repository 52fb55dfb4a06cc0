// Messages that set an MCU up and tell what it is.
#include "engine/message_kinds.h"
#include "engine/velocity.h"

namespace bushd::test {
namespace {

void tell(const bushd_identify& m, Fields& f) {
  f.add("salt", m.salt).add("windows", m.windows, 1, UINT8_MAX).add("window_units", m.window_units);
}

void tell(const bushd_identity& m, Fields& f) {
  f.add("protocol_version", m.protocol_version).add("motors", m.motors);
  f.add("firmware_version", m.firmware_version).add("boot_number", m.boot_number);
  f.add("slots", m.slots).add("queue_ticks", m.queue_ticks).add("table_codes", m.table_codes);
  f.add("capabilities", m.capabilities);
  f.add_list("unique_id", m.unique_id, BUSHD_UNIQUE_ID_SIZE, 1);
  // No more than the version is told of another one.
  const bool known = m.protocol_version == BUSHD_PROTOCOL_VERSION;
  f.promise(known ? m.motors >= 1 && m.motors <= BUSHD_MOTORS_PER_MCU : m.motors == 0, "motors");
}

void tell(const bushd_set_address& m, Fields& f) {
  f.add_list("unique_id", m.unique_id, BUSHD_UNIQUE_ID_SIZE, 1)
      .add("address", m.address, 1, UINT8_MAX);
}

void tell(const bushd_configure& m, Fields& f) {
  f.add("tick_ns", m.tick_ns, BUSHD_MIN_TICK_NS, BUSHD_MAX_TICK_NS)
      .add("format", m.format, BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE)
      .add("comm_timeout_ticks", m.comm_timeout_ticks, 1, UINT16_MAX);
}

void tell(const bushd_table_begin& m, Fields& f) {
  f.add("bank", m.bank, 0, BUSHD_SCRATCH_BANK)
      .add("accel_count", m.accel_count, 1, UINT16_MAX)
      .add("decel_count", m.decel_count);
  f.add("cruise", m.cruise, 1, UINT16_MAX)
      .add("time_unit_ns", m.time_unit_ns, 1, UINT32_MAX)
      .add("revision", m.revision);
}

void tell(const bushd_table_data& m, Fields& f) {
  f.add("bank", m.bank, 0, BUSHD_SCRATCH_BANK)
      .add("offset", m.offset)
      .add("count", m.count, 1, BUSHD_TABLE_DATA_MAX_CODES);
  f.add_part("codes", m.codes, m.count, 2);
}

void tell(const bushd_table_end& m, Fields& f) {
  f.add("bank", m.bank, 0, BUSHD_SCRATCH_BANK).add("crc", m.crc);
}

void tell(const bushd_tables& m, Fields& f) {
  unsigned valid = 0;
  std::string held;
  for (size_t i = 0; i < BUSHD_TABLE_BANKS; ++i) {
    if (m.bank[i].valid) valid |= 1u << i;
    append(&held, parts({m.bank[i].crc, m.bank[i].revision}));
  }
  f.add("valid", valid).add_text("held", held);
}

void tell(const bushd_assign& m, Fields& f) {
  f.add("motor", m.motor, 0, kLastMotor).add("bank", m.bank, 0, BUSHD_TABLE_BANKS - 1);
}

void tell(const bushd_control& m, Fields& f) {
  f.add("actions", m.actions, 0, 15);
  if (m.faults != 0) f.add("faults", m.faults);
  f.promise((m.actions & 3) != 3, "actions");
}

void tell(const bushd_set_position& m, Fields& f) {
  f.add("motor", m.motor, 0, kLastMotor).add("position_steps", m.position_steps);
}

void tell(const bushd_set_inputs& m, Fields& f) {
  f.add("limit_positive", m.limit_positive).add("limit_negative", m.limit_negative);
  f.add("limit_immediate", m.limit_immediate).add("inverted", m.inverted);
  f.add("debounce_ticks", m.debounce_ticks, 0, BUSHD_MAX_DEBOUNCE_TICKS);
  f.add("system_inverted", m.system_inverted, 0, BUSHD_SYSTEM_INPUTS);
  f.add("emergency", m.emergency, 0, BUSHD_EMERGENCY_INPUT_DISABLE);
  f.add("overcurrent", m.overcurrent, 0, BUSHD_MAX_CURRENT);
  f.add("enable_after_watchdog", m.enable_after_watchdog, 0, 1);
}

void tell(const bushd_set_outputs& m, Fields& f) {
  f.add("step_low", m.step_low)
      .add("direction_low", m.direction_low)
      .add("enabled", m.enabled, BUSHD_ENABLED_HIGH, BUSHD_ENABLED_LOW);
}

void tell(const bushd_motor_inputs& m, Fields& f) {
  f.add("motor", m.motor, 0, kLastMotor)
      .add("positive", m.positive, 0, kLastMotor)
      .add("negative", m.negative, 0, kLastMotor);
  f.add("home", m.home, 0, kLastMotor);
}

void tell(const bushd_emission& m, Fields& f) {
  f.add("mode", m.mode, 0, BUSHD_EMISSION_COMMON_STAGGERED)
      .add("sequence", m.sequence, 0, BUSHD_PHASES_THREE)
      .add("hold_current", m.hold_current);
  f.add("step_us", m.step_us).add("settle_us", m.settle_us);
  f.add("dir_setup_us", m.dir_setup_us).add("pulse_us", m.pulse_us);
}

void tell(const bushd_currents& m, Fields& f) {
  f.add("motor", m.motor, 0, kLastMotor).add("decay", m.decay, 0, BUSHD_DECAY_FAST);
  f.add("ramp_ma", m.ramp_ma, 0, BUSHD_MAX_CURRENT_MA);
  f.add("cruise_ma", m.cruise_ma, 0, BUSHD_MAX_CURRENT_MA);
  f.add("hold_ma", m.hold_ma, 0, BUSHD_MAX_CURRENT_MA);
  f.promise((m.cruise_ma == 0) == (m.hold_ma == 0) && (m.cruise_ma == 0) == (m.ramp_ma == 0),
            "some of the currents are 0");
}

void tell(const bushd_set_velocity& m, Fields& f) {
  f.add("motor", m.motor, 0, kLastMotor).add("least", m.least, 0, m.most);
  f.add("most", m.most, 0, BUSHD_VELOCITY_MOST);
  f.add("acceleration", m.acceleration, 0, BUSHD_VELOCITY_MOST);
  const bool none = m.most == 0;
  f.promise(none == (m.least == 0) && none == (m.acceleration == 0), "some of the three are 0");
  f.promise(none || m.least >= BUSHD_VELOCITY_LEAST, "least");
}

void tell(const bushd_acknowledgement& m, Fields& f) {
  f.add("status", m.status);
}

size_t encode_table_data(const bushd_table_data* m, uint8_t* payload) {
  std::vector<uint16_t> codes;
  for (size_t i = 0; i < m->count; ++i) codes.push_back(bushd_get_u16(m->codes + 2 * i));
  return bushd_encode_table_data(m->bank, m->offset, m->count, codes.data(), payload);
}

Bytes any_table_data() {
  const auto count = between<uint8_t>(1, BUSHD_TABLE_DATA_MAX_CODES);
  Bytes payload = random_bytes(4u + 2u * count);
  payload[0] = between<uint8_t>(0, BUSHD_SCRATCH_BANK);
  payload[3] = count;
  return payload;
}

void put_tick_ns(Bytes* payload) {
  bushd_put_u32(payload->data(), between(BUSHD_MIN_TICK_NS, BUSHD_MAX_TICK_NS));
}

auto velocity_of(uint32_t least, uint32_t most, uint32_t change) {
  return [=](Bytes* p) {
    bushd_put_u32(p->data() + 1, least);
    bushd_put_u32(p->data() + 5, most);
    bushd_put_u32(p->data() + 9, change);
  };
}

}  // namespace

Kinds setup_kinds() {
  return {
      {"identify",
       {bytes_with(5, [](Bytes* p) { (*p)[2] |= 1; }),
        codec(bushd_decode_identify, bushd_encode_identify, tell),
        {{"no window", set8(2, 0)}}}},
      {"identity",
       {bytes_with(BUSHD_IDENTITY_SIZE,
                   [](Bytes* p) {
                     (*p)[0] = BUSHD_PROTOCOL_VERSION;
                     (*p)[1] = between<uint8_t>(1, 16);
                   }),
        codec(bushd_decode_identity, bushd_encode_identity, tell),
        {{"no motor", set8(1, 0)}, {"17 motors", set8(1, 17)}}}},
      {"set_address",
       {bytes_with(9, [](Bytes* p) { (*p)[8] = between<uint8_t>(1, 255); }),
        codec(bushd_decode_set_address, bushd_encode_set_address, tell),
        {{"the broadcast address", set8(8, 0)}}}},
      {"configure",
       {bytes_with(7,
                   [](Bytes* p) {
                     put_tick_ns(p);
                     (*p)[4] = between<uint8_t>(0, 1);
                     (*p)[5] |= 1;
                   }),
        codec(bushd_decode_configure, bushd_encode_configure, tell),
        {{"tick too short", set32(0, BUSHD_MIN_TICK_NS - 1)},
         {"tick too long", set32(0, BUSHD_MAX_TICK_NS + 1)},
         {"unknown format", set8(4, 2)},
         {"no silence at all", set16(5, 0)}}}},
      {"table_begin",
       {bytes_with(15,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 8);
                     for (const size_t at : {1u, 5u, 7u}) (*p)[at] |= 1;
                   }),
        codec(bushd_decode_table_begin, bushd_encode_table_begin, tell),
        {{"bank 9", set8(0, 9)},
         {"no codes", set16(1, 0)},
         {"cruise 0", set16(5, 0)},
         {"unit 0", set32(7, 0)}}}},
      {"table_data",
       {any_table_data,
        codec(bushd_decode_table_data, encode_table_data, tell),
        {{"bank 9", set8(0, 9)}}}},
      {"table_end",
       {bytes_with(5, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 8); }),
        codec(bushd_decode_table_end, bushd_encode_table_end, tell),
        {{"bank 9", set8(0, 9)}}}},
      {"tables",
       {[] { return random_bytes(BUSHD_TABLES_SIZE); },
        codec(bushd_decode_tables, bushd_encode_tables, tell),
        {}}},
      {"assign",
       {bytes_with(2,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = between<uint8_t>(0, 7);
                   }),
        codec(bushd_decode_assign, bushd_encode_assign, tell),
        {{"motor 16", set8(0, 16)}, {"bank 8", set8(1, 8)}}}},
      {"control",
       {bytes_with(2,
                   [](Bytes* p) {
                     (*p)[0] = *rc::gen::element<uint8_t>(4, 5, 6, 12, 14);
                     (*p)[1] = between<uint8_t>(1, 255);
                   }),
        codec(bushd_decode_control, bushd_encode_control, tell),
        {{"enable and disable", set8(0, 3)},
         {"both and clear", set8(0, 7)},
         {"unknown", set8(0, 20)},
         {"no fault", set8(1, 0)},
         {"faults that are not cleared", set8(0, 1)}},
        true}},
      {"set_position",
       {bytes_with(5, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 15); }),
        codec(bushd_decode_set_position, bushd_encode_set_position, tell),
        {{"motor 16", set8(0, 16)}}}},
      {"set_inputs",
       {bytes_with(14,
                   [](Bytes* p) {
                     (*p)[8] = between<uint8_t>(0, BUSHD_MAX_DEBOUNCE_TICKS);
                     (*p)[9] = between<uint8_t>(0, BUSHD_SYSTEM_INPUTS);
                     (*p)[10] = between<uint8_t>(0, 3);
                     bushd_put_u16(p->data() + 11, between<uint16_t>(0, 1023));
                     (*p)[13] = between<uint8_t>(0, 1);
                   }),
        codec(bushd_decode_set_inputs, bushd_encode_set_inputs, tell),
        {{"a debounce beyond the counters", set8(8, 16)},
         {"unknown input", set8(9, 16)},
         {"unknown action", set8(10, 4)},
         {"more than can be read", set16(11, 1024)},
         {"neither on nor off", set8(13, 2)}}}},
      {"set_outputs",
       {bytes_with(5, [](Bytes* p) { (*p)[4] = between<uint8_t>(1, 2); }),
        codec(bushd_decode_set_outputs, bushd_encode_set_outputs, tell),
        {{"no level of EN", set8(4, 0)}, {"a third level", set8(4, 3)}}}},
      {"motor_inputs",
       {bytes_with(4,
                   [](Bytes* p) {
                     for (uint8_t& byte : *p) byte = between<uint8_t>(0, 15);
                   }),
        codec(bushd_decode_motor_inputs, bushd_encode_motor_inputs, tell),
        {{"motor 16", set8(0, 16)},
         {"input 16 at the positive end", set8(1, 16)},
         {"input 16 at the negative end", set8(2, 16)},
         {"input 16 as home switch", set8(3, 16)}}}},
      {"emission",
       {bytes_with(11,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 5);
                     (*p)[1] = between<uint8_t>(0, 3);
                     (*p)[2] = between<uint8_t>(0, 1);
                     bushd_put_u16(p->data() + 3, between<uint16_t>(1, 65535));
                   }),
        codec(bushd_decode_emission, bushd_encode_emission, tell),
        {{"mode 6", set8(0, 6)},
         {"sequence 4", set8(1, 4)},
         {"hold current 2", set8(2, 2)},
         {"no step period",
          [](Bytes* p) {
            (*p)[0] = BUSHD_EMISSION_BURST;
            bushd_put_u16(p->data() + 3, 0);
          }},
         {"no step period of staggered steps with a common DIR",
          [](Bytes* p) {
            (*p)[0] = BUSHD_EMISSION_COMMON_STAGGERED;
            bushd_put_u16(p->data() + 3, 0);
          }}}}},
      {"currents",
       {bytes_with(8,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = between<uint8_t>(0, 1);
                     const uint16_t least = between<uint8_t>(0, 3) == 0 ? 0 : 1;
                     const uint16_t most = least == 0 ? 0 : BUSHD_MAX_CURRENT_MA;
                     for (size_t at : {2, 4, 6}) {
                       bushd_put_u16(p->data() + at, between<uint16_t>(least, most));
                     }
                   }),
        codec(bushd_decode_currents, bushd_encode_currents, tell),
        {{"motor 16", set8(0, 16)},
         {"decay 2", set8(1, 2)},
         {"more than 5.11 A", set16(4, 5111)},
         {"one of them without current",
          [](Bytes* p) {
            bushd_put_u16(p->data() + 2, 100);
            bushd_put_u16(p->data() + 6, 0);
          }}}}},
      {"set_velocity",
       {bytes_with(13,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     const bool none = between<uint8_t>(0, 3) == 0;
                     const auto least =
                         between<uint32_t>(BUSHD_VELOCITY_LEAST, BUSHD_VELOCITY_MOST);
                     const auto most = between<uint32_t>(least, BUSHD_VELOCITY_MOST);
                     bushd_put_u32(p->data() + 1, none ? 0 : least);
                     bushd_put_u32(p->data() + 5, none ? 0 : most);
                     bushd_put_u32(p->data() + 9,
                                   none ? 0 : between<uint32_t>(1, BUSHD_VELOCITY_MOST));
                   }),
        codec(bushd_decode_set_velocity, bushd_encode_set_velocity, tell),
        {{"motor 16", set8(0, 16)},
         {"T of more than 16 bits", velocity_of(39, 100, 1)},
         {"slower than its least speed", velocity_of(100, 99, 1)},
         {"more than 24 bits", velocity_of(100, 0x800000, 1)},
         {"negative", velocity_of(0xFFFFFF00, 100, 1)},
         {"no acceleration", velocity_of(100, 100, 0)},
         {"more acceleration than speed", velocity_of(100, 100, 0x800000)}}}},
      {"acknowledgement",
       {[] { return random_bytes(1); },
        codec(bushd_decode_acknowledgement, bushd_encode_acknowledgement, tell),
        {}}},
  };
}

}  // namespace bushd::test
