// SYNC, TICKS, TABLE_TICKS.
#include <algorithm>
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

std::vector<uint8_t> some_motors() {
  const auto mask = between<uint16_t>(1, 0xFFFF);
  std::vector<uint8_t> motors;
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) != 0) motors.push_back(m);
  }
  return motors;
}

namespace {

void tell(const bushd_sync& m, Fields& f) {
  f.add("master", m.master).add("sync_id", m.sync_id).add("follows", m.follows);
  f.add("follow_up_id", m.follow_up_id);
  f.add("sync_tick", m.sync_tick).add("sync_ns", m.sync_ns, 0, BUSHD_MAX_TICK_NS - 1);
}

size_t width_of(const bushd_ticks& m) {
  return (m.flags & BUSHD_TICKS_FINE) != 0 ? 2 : 1;
}

void tell(const bushd_ticks& m, Fields& f) {
  f.add("epoch", m.epoch).add("flags", m.flags).add("first_tick", m.first_tick);
  f.add("count", m.count).add("mask", m.mask, 1, UINT16_MAX);
  f.promise(m.flags < 8 && (m.flags & 6) != 6, "flags");
  f.promise(m.motors == std::popcount(m.mask), "motors");
  f.promise(m.count >= 1 && m.count <= bushd_ticks_capacity(m.motors, m.flags & BUSHD_TICKS_FINE),
            "count");
  f.add_part("delays", m.delays, m.motors, 2);
  f.add_part("displacements", m.displacements, width_of(m) * m.motors * m.count, 1);
}

void tell(const bushd_table_ticks& m, Fields& f) {
  f.add("epoch", m.epoch).add("flags", m.flags).add("first_tick", m.first_tick);
  f.add("count", m.count, 1, UINT16_MAX);
  f.promise((m.flags & ~14) == 0 && (m.flags & 6) != 6, "flags").promise(m.mask != 0, "mask");
  f.promise_inside(m.entries, m.entries_size, "entries");
  if (!f.in_range()) return;
  std::string entries;
  uint16_t at = 0;
  uint16_t mask = 0;
  for (bushd_table_ticks_entry entry; bushd_next_table_ticks_entry(&m, &at, &entry);) {
    const bushd_run_state& s = entry.state;
    f.promise(entry.motor <= kLastMotor && mask < 1 << entry.motor, "motor of an entry");
    mask = static_cast<uint16_t>(mask | 1 << entry.motor);
    append(&entries, parts({entry.motor, s.direction, s.cruises, s.since, s.since_ns, s.lead_delay,
                            s.accel_at, s.accel_end, s.cruise_left, s.decel_left, s.cruise}));
  }
  f.add_text("entries", entries).promise(at == m.entries_size && mask == m.mask, "mask");
}

size_t encode_ticks(const bushd_ticks* m, uint8_t* payload) {
  std::vector<uint16_t> delays;
  for (size_t i = 0; i < m->motors; ++i) delays.push_back(bushd_get_u16(m->delays + 2 * i));
  const size_t head = bushd_encode_ticks_head(m->epoch, m->flags, m->first_tick, m->count, m->mask,
                                              delays.data(), payload);
  const size_t size = width_of(*m) * m->motors * m->count;
  std::copy_n(m->displacements, size, payload + head);
  return head + size;
}

Bytes any_ticks() {
  const auto flags = between<uint8_t>(0, 5);  // START and REPLACE never together
  const auto mask = static_cast<uint16_t>(between(1, 0xFFFF));
  const auto motors = static_cast<uint8_t>(std::popcount(mask));
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

size_t encode_table_ticks(const bushd_table_ticks* m, uint8_t* payload) {
  std::vector<bushd_table_ticks_entry> entries;
  uint16_t at = 0;
  for (bushd_table_ticks_entry entry; bushd_next_table_ticks_entry(m, &at, &entry);) {
    entries.push_back(entry);
  }
  return bushd_encode_table_ticks(m->epoch, m->flags, m->first_tick, m->count, entries.data(),
                                  static_cast<uint8_t>(entries.size()), payload);
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

}  // namespace

Kinds stream_kinds() {
  return {
      {"sync",
       {bytes_with(19,
                   [](Bytes* p) {
                     (*p)[6] = between<uint8_t>(0, 1);
                     bushd_put_u32(p->data() + 15, between(0u, BUSHD_MAX_TICK_NS - 1));
                   }),
        codec(bushd_decode_sync, bushd_encode_sync, tell),
        {{"follows 2", set8(6, 2)}, {"sync_ns beyond any tick", set32(15, BUSHD_MAX_TICK_NS)}}}},
      {"ticks",
       {any_ticks,
        codec(bushd_decode_ticks, encode_ticks, tell),
        {{"unknown flag", [](Bytes* p) { (*p)[1] |= 8; }},
         {"start and replacement at once", [](Bytes* p) { (*p)[1] |= 6; }}}}},
      {"table_ticks",
       {any_table_ticks,
        codec(bushd_decode_table_ticks, encode_table_ticks, tell),
        {{"fine", [](Bytes* p) { (*p)[1] |= 1; }},
         {"unknown flag", [](Bytes* p) { (*p)[1] |= 16; }},
         {"start and replacement at once", [](Bytes* p) { (*p)[1] |= 6; }},
         {"no ticks", set16(6, 0)},
         {"no entry", cut_to(BUSHD_TABLE_TICKS_HEADER)}},
        true}},
  };
}

}  // namespace bushd::test
