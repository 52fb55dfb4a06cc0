#include "engine/message_kinds.h"
#include "engine/velocity.h"

namespace bushd::test {
namespace {

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
        codec(bushd_decode_identify, bushd_encode_identify),
        {{"no window", set8(2, 0)}}}},
      {"identity",
       {bytes_with(BUSHD_IDENTITY_SIZE,
                   [](Bytes* p) {
                     (*p)[0] = BUSHD_PROTOCOL_VERSION;
                     (*p)[1] = between<uint8_t>(1, 16);
                   }),
        codec(bushd_decode_identity, bushd_encode_identity),
        {{"no motor", set8(1, 0)}, {"17 motors", set8(1, 17)}}}},
      {"set_address",
       {bytes_with(9, [](Bytes* p) { (*p)[8] = between<uint8_t>(1, 255); }),
        codec(bushd_decode_set_address, bushd_encode_set_address),
        {{"the broadcast address", set8(8, 0)}}}},
      {"configure",
       {bytes_with(7,
                   [](Bytes* p) {
                     put_tick_ns(p);
                     (*p)[4] = between<uint8_t>(0, 1);
                     (*p)[5] |= 1;
                   }),
        codec(bushd_decode_configure, bushd_encode_configure),
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
        codec(bushd_decode_table_begin, bushd_encode_table_begin),
        {{"bank 9", set8(0, 9)},
         {"no codes", set16(1, 0)},
         {"cruise 0", set16(5, 0)},
         {"unit 0", set32(7, 0)}}}},
      {"table_data",
       {any_table_data,
        codec(bushd_decode_table_data, encode_table_data),
        {{"bank 9", set8(0, 9)}}}},
      {"table_end",
       {bytes_with(5, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 8); }),
        codec(bushd_decode_table_end, bushd_encode_table_end),
        {{"bank 9", set8(0, 9)}}}},
      {"tables",
       {[] { return random_bytes(BUSHD_TABLES_SIZE); },
        codec(bushd_decode_tables, bushd_encode_tables),
        {}}},
      {"assign",
       {bytes_with(2,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = between<uint8_t>(0, 7);
                   }),
        codec(bushd_decode_assign, bushd_encode_assign),
        {{"motor 16", set8(0, 16)}, {"bank 8", set8(1, 8)}}}},
      {"control",
       {bytes_with(2,
                   [](Bytes* p) {
                     (*p)[0] = *rc::gen::element<uint8_t>(4, 5, 6, 12, 14);
                     (*p)[1] = between<uint8_t>(1, 255);
                   }),
        codec(bushd_decode_control, bushd_encode_control),
        {{"enable and disable", set8(0, 3)},
         {"both and clear", set8(0, 7)},
         {"unknown", set8(0, 20)},
         {"no fault", set8(1, 0)},
         {"faults that are not cleared", set8(0, 1)}},
        true}},
      {"set_position",
       {bytes_with(5, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 15); }),
        codec(bushd_decode_set_position, bushd_encode_set_position),
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
        codec(bushd_decode_set_inputs, bushd_encode_set_inputs),
        {{"a debounce beyond the counters", set8(8, 16)},
         {"unknown input", set8(9, 16)},
         {"unknown action", set8(10, 4)},
         {"more than can be read", set16(11, 1024)},
         {"neither on nor off", set8(13, 2)}}}},
      {"set_outputs",
       {bytes_with(5, [](Bytes* p) { (*p)[4] = between<uint8_t>(1, 2); }),
        codec(bushd_decode_set_outputs, bushd_encode_set_outputs),
        {{"no level of EN", set8(4, 0)}, {"a third level", set8(4, 3)}}}},
      {"motor_inputs",
       {bytes_with(4,
                   [](Bytes* p) {
                     for (uint8_t& byte : *p) byte = between<uint8_t>(0, 15);
                   }),
        codec(bushd_decode_motor_inputs, bushd_encode_motor_inputs),
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
        codec(bushd_decode_emission, bushd_encode_emission),
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
        codec(bushd_decode_currents, bushd_encode_currents),
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
        codec(bushd_decode_set_velocity, bushd_encode_set_velocity),
        {{"motor 16", set8(0, 16)},
         {"T of more than 16 bits", velocity_of(39, 100, 1)},
         {"slower than its least speed", velocity_of(100, 99, 1)},
         {"more than 24 bits", velocity_of(100, 0x800000, 1)},
         {"negative", velocity_of(0xFFFFFF00, 100, 1)},
         {"no acceleration", velocity_of(100, 100, 0)},
         {"more acceleration than speed", velocity_of(100, 100, 0x800000)}}}},
      {"acknowledgement",
       {[] { return random_bytes(1); },
        codec(bushd_decode_acknowledgement, bushd_encode_acknowledgement),
        {}}},
  };
}

}  // namespace bushd::test
