#include <algorithm>
#include <array>
#include <bit>

#include "engine/message_kinds.h"

namespace bushd::test {

bushd_run_state any_run_state() {
  bushd_run_state state{};
  state.direction = *rc::gen::element<int8_t>(1, -1);
  state.since = between<uint16_t>(0, 65535);
  state.since_ns = *rc::gen::element<uint32_t>(0, 1, 39999, UINT32_MAX);
  state.lead_delay = *rc::gen::element<uint16_t>(0, 0, 1, 250, 65535);
  state.cruise = *rc::gen::element<uint16_t>(0, 0, 1, 250, 65535);
  state.cruises = *rc::gen::arbitrary<bool>();
  if (state.cruises) return state;
  state.accel_at = between<uint16_t>(0, 65535);
  state.accel_end = between<uint16_t>(0, 65535);
  state.cruise_left = between<uint32_t>(0, UINT32_MAX);
  state.decel_left = between<uint16_t>(0, 65535);
  return state;
}

namespace {

size_t bits_set(uint16_t mask) {
  size_t bits = 0;
  for (int b = 0; b < 16; ++b) bits += (mask >> b) & 1;
  return bits;
}

size_t encode_ticks(const bushd_ticks* m, uint8_t* payload) {
  RC_ASSERT(m->motors == bits_set(m->mask));
  std::vector<uint16_t> delays;
  for (size_t i = 0; i < m->motors; ++i) delays.push_back(bushd_get_u16(m->delays + 2 * i));
  const size_t head = bushd_encode_ticks_head(m->epoch, m->flags, m->first_tick, m->count, m->mask,
                                              delays.data(), payload);
  const size_t width = m->flags & BUSHD_TICKS_FINE ? 2 : 1;
  const size_t size = width * m->motors * m->count;
  std::copy_n(m->displacements, size, payload + head);
  return head + size;
}

Bytes any_ticks() {
  const auto flags = between<uint8_t>(0, 5);  // START and REPLACE never together
  const auto mask = static_cast<uint16_t>(between(1, 0xFFFF));
  const auto motors = static_cast<uint8_t>(bits_set(mask));
  const auto count = between<uint8_t>(1, bushd_ticks_capacity(motors, flags & BUSHD_TICKS_FINE));
  const size_t width = flags & BUSHD_TICKS_FINE ? 2 : 1;
  Bytes payload = random_bytes(BUSHD_TICKS_HEADER + 2u * motors + width * motors * count);
  payload[1] = flags;
  payload[6] = count;
  bushd_put_u16(payload.data() + 7, mask);
  if (width == 2) {
    for (std::size_t at = payload.size() - width * motors * count; at < payload.size();
         at += width) {
      if (bushd_get_i16(&payload[at]) == INT16_MIN) bushd_put_i16(&payload[at], 1);
    }
  }
  return payload;
}

// As a report before has told.
bushd_report of_all_motors() {
  bushd_report report{};
  report.motor_count = BUSHD_MOTORS_PER_MCU;
  return report;
}

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

size_t encode_table_ticks(const bushd_table_ticks* m, uint8_t* payload) {
  std::vector<bushd_table_ticks_entry> entries;
  uint16_t at = 0;
  uint16_t mask = 0;
  for (bushd_table_ticks_entry entry; bushd_next_table_ticks_entry(m, &at, &entry);) {
    mask = static_cast<uint16_t>(mask | 1 << entry.motor);
    entries.push_back(entry);
  }
  RC_ASSERT(mask == m->mask);
  RC_ASSERT(entries.size() == bits_set(m->mask));
  return bushd_encode_table_ticks(m->epoch, m->flags, m->first_tick, m->count, entries.data(),
                                  static_cast<uint8_t>(entries.size()), payload);
}

std::vector<uint8_t> some_motors() {
  const auto mask = between<uint16_t>(1, 0xFFFF);
  std::vector<uint8_t> motors;
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) != 0) motors.push_back(m);
  }
  return motors;
}

// As many of the motors as fit, from the lowest on.
Bytes any_table_ticks() {
  const size_t most =
      (BUSHD_FRAME_MAX_PAYLOAD - BUSHD_TABLE_TICKS_HEADER) / BUSHD_TABLE_TICKS_MAX_ENTRY;
  std::vector<bushd_table_ticks_entry> entries;
  for (const uint8_t m : some_motors()) {
    if (entries.size() < most) entries.push_back({m, any_run_state()});
  }
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_table_ticks(
      between<uint8_t>(0, 255), *rc::gen::element<uint8_t>(0, 2, 4),
      between<uint32_t>(0, UINT32_MAX), between<uint16_t>(1, 65535), entries.data(),
      static_cast<uint8_t>(entries.size()), payload.data()));
  return payload;
}

template <class Entry>
std::vector<Entry> entries_of(const uint8_t* at, uint8_t count, Entry (*next)(const uint8_t**)) {
  std::vector<Entry> entries;
  for (uint8_t i = 0; i < count; ++i) entries.push_back(next(&at));
  return entries;
}

size_t encode_table_run(const bushd_table_run* m, uint8_t* payload) {
  const auto entries = entries_of(m->entries, m->count, bushd_next_table_run_entry);
  return bushd_encode_table_run(m->epoch, m->first_tick, entries.data(), m->count, payload);
}

Bytes any_table_run() {
  Bytes payload = random_bytes(BUSHD_TABLE_RUN_HEADER);
  for (const uint8_t m : some_motors()) {
    const bool has_shortest_delay = between(0, 2) != 0;
    const bool is_long = has_shortest_delay && between(0, 1) != 0;
    Bytes entry(is_long ? 13 : has_shortest_delay ? 7 : 5);
    entry[0] = static_cast<uint8_t>(m | between<uint8_t>(0, 15) << 4);
    bushd_put_u32(&entry[1],
                  between<uint32_t>(1, INT32_MAX) | (has_shortest_delay ? 0x80000000u : 0u));
    if (has_shortest_delay && !is_long) bushd_put_u16(&entry[5], between<uint16_t>(1, 65535));
    if (is_long) bushd_put_u16(&entry[7], between<uint16_t>(0, 65535));
    if (is_long) bushd_put_u32(&entry[9], between<uint32_t>(1, UINT32_MAX));
    payload.insert(payload.end(), entry.begin(), entry.end());
  }
  return payload;
}

size_t encode_line_run(const bushd_line_run* m, uint8_t* payload) {
  const auto entries = entries_of(m->line.entries, m->line.count, bushd_next_line_entry);
  return bushd_encode_line_run(m, entries.data(), m->line.count, payload);
}

void add_line_entry(Bytes* payload, uint8_t motor, uint32_t increment) {
  Bytes entry(BUSHD_LINE_RUN_ENTRY);
  entry[0] = static_cast<uint8_t>(motor | between<uint8_t>(0, 1) << 7);
  bushd_put_u32(&entry[1], increment);
  payload->insert(payload->end(), entry.begin(), entry.end());
}

// By the elementary law the increments are all of the line.
Bytes any_elementary_line_run() {
  Bytes payload = random_bytes(BUSHD_LINE_RUN_HEADER);
  uint32_t sum = 0;
  for (const uint8_t m : some_motors()) {
    const auto increment = between<uint32_t>(1, INT32_MAX / BUSHD_MOTORS_PER_MCU);
    sum += increment;
    add_line_entry(&payload, m, increment);
  }
  payload[5] = static_cast<uint8_t>(0x80 | between<uint8_t>(0, 8));
  bushd_put_u32(&payload[8], sum);
  bushd_put_u32(&payload[12], 0);
  bushd_put_u32(&payload[16], between<uint32_t>(1, sum));
  return payload;
}

Bytes any_line_run() {
  if (between(0, 2) == 0) return any_elementary_line_run();
  const auto longest = between<uint32_t>(1, INT32_MAX);
  const auto from = between<uint32_t>(0, longest - 1);
  Bytes payload = random_bytes(BUSHD_LINE_RUN_HEADER);
  payload[5] = between<uint8_t>(0, 7);
  bushd_put_u32(&payload[8], longest);
  bushd_put_u32(&payload[12], from);
  bushd_put_u32(&payload[16], between<uint32_t>(1, longest - from));
  for (const uint8_t m : some_motors()) {
    add_line_entry(&payload, m, between<uint32_t>(1, longest));
  }
  return payload;
}

size_t encode_line_trigger(const bushd_line_trigger* m, uint8_t* payload) {
  const auto entries = entries_of(m->line.entries, m->line.count, bushd_next_line_entry);
  return bushd_encode_line_trigger(m, entries.data(), m->line.count, payload);
}

// A number, an edge and a delay, and of this run what is behind its first bytes.
Bytes triggered(const Bytes& run, std::ptrdiff_t first) {
  Bytes payload(6);
  payload[0] = between<uint8_t>(1, 255);
  payload[1] = between<uint8_t>(1, 2);
  bushd_put_u32(&payload[2], between<uint32_t>(50, 1'650'000));
  payload.insert(payload.end(), run.begin() + first, run.end());
  return payload;
}

Bytes any_line_trigger() {
  return triggered(any_line_run(), 5);
}

size_t encode_trigger(const bushd_trigger* m, uint8_t* payload) {
  const auto entries = entries_of(m->entries, m->count, bushd_next_table_run_entry);
  return bushd_encode_trigger(m->number, m->edge, m->delay_us, entries.data(), m->count, payload);
}

Bytes any_trigger() {
  return triggered(any_table_run(), BUSHD_TABLE_RUN_HEADER);
}

Bytes any_travel() {
  const uint8_t edge = between<uint8_t>(0, 2);
  const bool steps = edge == 0 && *rc::gen::arbitrary<bool>();
  bushd_travel m{};
  m.number = between<uint8_t>(1, 255);
  m.kind = steps ? BUSHD_TRAVEL_STEP : BUSHD_TRAVEL_LIMITS;
  m.motor = between<uint8_t>(0, 15);
  m.direction = *rc::gen::element<int8_t>(1, -1);
  m.edge = static_cast<bushd_edge>(edge);
  m.sensor = steps ? between<uint8_t>(0, 15) : uint8_t{0};
  m.steps = steps ? 1 : between<uint32_t>(1, INT32_MAX);
  m.delay_us = edge != 0 ? between<uint32_t>(50, 1'650'000) : 0;
  m.wait_us = between<uint32_t>(50, 1'650'000);
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_travel(&m, payload.data()));
  return payload;
}

// With this one behind a header of that size.
std::function<void(Bytes*)> entry_alone(std::size_t header, Bytes entry) {
  return [header, entry = std::move(entry)](Bytes* p) {
    p->resize(header);
    p->insert(p->end(), entry.begin(), entry.end());
  };
}

}  // namespace

Kinds motion_kinds() {
  return {
      {"home",
       {bytes_with(18,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = *rc::gen::element<uint8_t>(1, 0xFF);
                     (*p)[5] &= 0x7F;
                     (*p)[11] &= 0x7F;
                     (*p)[8] |= 1;
                     (*p)[12] |= 1;
                   }),
        codec(bushd_decode_home, bushd_encode_home),
        {{"motor 16", set8(0, 16)},
         {"no direction", set8(1, 0)},
         {"twice the direction", set8(1, 2)},
         {"too many steps", set32(2, 0x80000000)},
         {"no slow steps", set32(8, 0)},
         {"too many slow steps", set32(8, 0x80000000)},
         {"no delay", set16(12, 0)},
         {"longer delays that are none", [](Bytes* p) { p->resize(26); }}}}},
      {"travel",
       {any_travel,
        codec(bushd_decode_travel, bushd_encode_travel),
        {{"no number", set8(0, 0)},
         {"kind 3", set8(1, 3)},
         {"something to give up", set8(1, 0)},
         {"motor 16", set8(2, 16)},
         {"no direction", set8(3, 0)},
         {"no such edge", set8(4, 3)},
         {"sensor 16", set8(5, 16)},
         {"no step", set32(6, 0)},
         {"too many steps", set32(6, 0x80000000)},
         {"too long a delay", set32(10, 1'650'001)},
         {"too short a wait", set32(14, 49)},
         {"too long a wait", set32(14, 1'650'001)}}}},
      {"local",
       {[] { return random_bytes(6); }, codec(bushd_decode_local, bushd_encode_local), {}}},
      {"poll", {any_poll, codec(bushd_decode_poll, encode_poll), {}}},
      {"sync",
       {bytes_with(19,
                   [](Bytes* p) {
                     (*p)[6] = between<uint8_t>(0, 1);
                     bushd_put_u32(p->data() + 15, between(0u, BUSHD_MAX_TICK_NS - 1));
                   }),
        codec(bushd_decode_sync, bushd_encode_sync),
        {{"follows 2", set8(6, 2)}, {"mark beyond any tick", set32(15, BUSHD_MAX_TICK_NS)}}}},
      {"ticks",
       {any_ticks,
        codec(bushd_decode_ticks, encode_ticks),
        {{"unknown flag", [](Bytes* p) { (*p)[1] |= 8; }},
         {"start and replacement at once", [](Bytes* p) { (*p)[1] |= 6; }}}}},
      {"table_ticks",
       {any_table_ticks,
        codec(bushd_decode_table_ticks, encode_table_ticks),
        {{"fine", [](Bytes* p) { (*p)[1] |= 1; }},
         {"unknown flag", [](Bytes* p) { (*p)[1] |= 16; }},
         {"start and replacement at once", [](Bytes* p) { (*p)[1] |= 6; }},
         {"no ticks", set16(6, 0)},
         {"no entry", [](Bytes* p) { p->resize(BUSHD_TABLE_TICKS_HEADER); }}},
        true}},
      {"table_run",
       {any_table_run,
        codec(bushd_decode_table_run, encode_table_run),
        {{"no step", entry_alone(BUSHD_TABLE_RUN_HEADER, {0, 0, 0, 0, 0})},
         {"no step, with a shortest delay",
          entry_alone(BUSHD_TABLE_RUN_HEADER, {0, 0, 0, 0, 0x80, 9, 0})},
         {"a shortest delay of no time",
          entry_alone(BUSHD_TABLE_RUN_HEADER, {0, 5, 0, 0, 0x80, 0, 0})},
         {"no entry", [](Bytes* p) { p->resize(BUSHD_TABLE_RUN_HEADER); }},
         {"a motor twice",
          [](Bytes* p) {
            const Bytes entry{15, 5, 0, 0, 0};
            p->insert(p->end(), entry.begin(), entry.end());
            p->insert(p->end(), entry.begin(), entry.end());
          }}},
        true}},
      {"line_run",
       {any_line_run,
        codec(bushd_decode_line_run, encode_line_run),
        {{"no such bank", set8(5, 9)},
         {"no such bank of the elementary law", set8(5, 0x89)},
         {"an elementary line with another motor elsewhere",
          [](Bytes* p) {
            (*p)[5] |= 0x80;
            bushd_put_u32(&(*p)[12], 0);
            bushd_put_u32(&(*p)[16], 1);
            uint32_t sum = 1;
            for (size_t at = BUSHD_LINE_RUN_HEADER; at < p->size(); at += BUSHD_LINE_RUN_ENTRY) {
              bushd_put_u32(&(*p)[at + 1], 100);
              sum += 100;
            }
            bushd_put_u32(&(*p)[8], sum);
          }},
         {"a rest of an elementary line",
          [](Bytes* p) {
            p->resize(BUSHD_LINE_RUN_HEADER);
            (*p)[5] = 0x80;
            bushd_put_u32(&(*p)[8], 9);
            bushd_put_u32(&(*p)[12], 1);
            bushd_put_u32(&(*p)[16], 8);
            const Bytes entry{3, 9, 0, 0, 0};
            p->insert(p->end(), entry.begin(), entry.end());
          }},
         {"no way", set32(8, 0)},
         {"too long a way", set32(8, 0x80000000)},
         {"a beginning at the end",
          [](Bytes* p) { bushd_put_u32(&(*p)[12], bushd_get_u32(&(*p)[8])); }},
         {"no step of the run", set32(16, 0)},
         {"beyond the end",
          [](Bytes* p) {
            bushd_put_u32(&(*p)[16], bushd_get_u32(&(*p)[8]) - bushd_get_u32(&(*p)[12]) + 1);
          }},
         {"no step", entry_alone(BUSHD_LINE_RUN_HEADER, {0, 0, 0, 0, 0})},
         {"longer than the longest", entry_alone(BUSHD_LINE_RUN_HEADER, {0, 0, 0, 0, 0x80})},
         {"unknown bits", [](Bytes* p) { (*p)[BUSHD_LINE_RUN_HEADER] |= 0x10; }},
         {"no entry", [](Bytes* p) { p->resize(BUSHD_LINE_RUN_HEADER); }},
         {"a motor twice",
          [](Bytes* p) {
            const Bytes entry{15, 1, 0, 0, 0};
            p->insert(p->end(), entry.begin(), entry.end());
            p->insert(p->end(), entry.begin(), entry.end());
          }}},
        true}},
      {"line_trigger",
       {any_line_trigger,
        codec(bushd_decode_line_trigger, encode_line_trigger),
        {{"no number", set8(0, 0)},
         {"no edge", set8(1, 0)},
         {"no such edge", set8(1, 3)},
         {"too short a delay", set32(2, 49)},
         {"too long a delay", set32(2, 1'650'001)},
         {"no such bank", set8(6, 9)},
         {"no way", set32(9, 0)},
         {"no step of the run", set32(17, 0)},
         {"longer than the longest", entry_alone(BUSHD_LINE_TRIGGER_HEADER, {0, 0, 0, 0, 0x80})},
         {"no entry", [](Bytes* p) { p->resize(BUSHD_LINE_TRIGGER_HEADER); }}},
        true}},
      {"trigger",
       {any_trigger,
        codec(bushd_decode_trigger, encode_trigger),
        {{"no number", set8(0, 0)},
         {"no such edge", set8(1, 3)},
         {"entries to disarm", set8(1, 0)},
         {"too short a delay", set32(2, 49)},
         {"too long a delay", set32(2, 1'650'001)},
         {"no step", entry_alone(6, {0, 0, 0, 0, 0})},
         {"no entry", [](Bytes* p) { p->resize(6); }}},
        true}},
      {"position_compare",
       {bytes_with(14,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = between<uint8_t>(0, 3);
                     bushd_put_u32(p->data() + 6, between<uint32_t>(0, 1'500'000));
                     bushd_put_u32(p->data() + 10, between<uint32_t>(1, 1'000'000));
                   }),
        codec(bushd_decode_position_compare, bushd_encode_position_compare),
        {{"motor 16", set8(0, 16)},
         {"no such arrival", set8(1, 4)},
         {"too long a delay", set32(6, 1'500'001)},
         {"no width", set32(10, 0)},
         {"too wide", set32(10, 1'000'001)}}}},
      {"emergency",
       {bytes_with(1, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 2); }),
        codec(bushd_decode_emergency, bushd_encode_emergency),
        {{"no such way", set8(0, 3)}}}},
      {"report",
       {any_report,
        codec(bushd_decode_report, bushd_encode_report, of_all_motors()),
        {{"state 4", set8(0, 4)},
         {"a section that is none", set8(7, 0x40)},
         {"no number, but sections", set8(6, 0)}}}},
  };
}

}  // namespace bushd::test
