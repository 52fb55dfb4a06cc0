// TABLE_RUN, LINE_RUN, TRIGGER, LINE_TRIGGER.
#include "engine/message_kinds.h"

namespace bushd::test {
namespace {

void tell_entries(const uint8_t* at, uint8_t count, Fields& f) {
  f.promise(count <= BUSHD_MOTORS_PER_MCU, "count");
  std::string text;
  int last = -1;
  for (const auto& entry : entries_of(at, count, bushd_next_table_run_entry)) {
    f.promise(entry.motor > last && entry.motor <= kLastMotor, "motor of an entry");
    f.promise(entry.bank < BUSHD_TABLE_BANKS, "bank of an entry");
    f.promise(entry.steps >= 1 && entry.steps <= INT32_MAX, "steps of an entry");
    last = entry.motor;
    append(&text, parts({entry.motor, entry.bank, entry.direction, entry.steps,
                         static_cast<int64_t>(entry.shortest_delay)}));
  }
  f.add_text("entries", text);
}

void tell_line(const bushd_line_part& line, Fields& f) {
  f.add("bank", line.bank | (line.elementary ? 0x80 : 0))
      .add("shortest_delay", line.shortest_delay)
      .add("longest", line.longest, 1, INT32_MAX);
  f.add("from", line.from, 0, line.longest).add("steps", line.steps, 1, line.longest - line.from);
  f.promise(line.bank <= BUSHD_SCRATCH_BANK, "bank");
  f.promise(line.count >= 1 && line.count <= BUSHD_MOTORS_PER_MCU, "count");
  std::string text;
  uint64_t sum = 0;
  int last = -1;
  for (const auto& entry : entries_of(line.entries, line.count, bushd_next_line_entry)) {
    f.promise(entry.motor > last && entry.motor <= kLastMotor, "motor of an entry");
    f.promise(entry.increment >= 1 && entry.increment <= line.longest, "increment");
    last = entry.motor;
    sum += entry.increment;
    append(&text, parts({entry.motor, entry.direction, entry.increment}));
  }
  f.promise(!line.elementary || (line.from == 0 && sum == line.longest), "elementary");
  f.add_text("entries", text);
}

void tell(const bushd_table_run& m, Fields& f) {
  f.add("epoch", m.epoch).add("first_tick", m.first_tick).promise(m.count >= 1, "count");
  tell_entries(m.entries, m.count, f);
}

void tell(const bushd_line_run& m, Fields& f) {
  f.add("epoch", m.epoch).add("first_tick", m.first_tick);
  tell_line(m.line, f);
}

void tell(const bushd_line_trigger& m, Fields& f) {
  f.add("number", m.number, 1, UINT8_MAX).add("edge", m.edge, 1, BUSHD_EDGE_FALLING);
  f.add("delay_us", m.delay_us, BUSHD_TRIGGER_MIN_DELAY_US, BUSHD_TRIGGER_MAX_DELAY_US);
  tell_line(m.line, f);
}

void tell(const bushd_trigger& m, Fields& f) {
  const bool disarms = m.edge == BUSHD_EDGE_NONE;
  f.add("number", m.number, disarms ? 0 : 1, disarms ? 0 : UINT8_MAX);
  f.add("edge", m.edge, 0, BUSHD_EDGE_FALLING);
  f.add("delay_us", m.delay_us, disarms ? 0 : BUSHD_TRIGGER_MIN_DELAY_US,
        disarms ? 0 : BUSHD_TRIGGER_MAX_DELAY_US);
  f.promise((m.count == 0) == disarms, "count");
  tell_entries(m.entries, m.count, f);
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

std::function<void(Bytes*)> followed_twice_by(Bytes entry) {
  return [entry = std::move(entry)](Bytes* p) {
    for (int n = 0; n < 2; ++n) p->insert(p->end(), entry.begin(), entry.end());
  };
}

}  // namespace

Kinds run_kinds() {
  return {
      {"table_run",
       {any_table_run,
        codec(bushd_decode_table_run, encode_table_run, tell),
        {{"no step", entry_alone(BUSHD_TABLE_RUN_HEADER, {0, 0, 0, 0, 0})},
         {"no step, with a shortest delay",
          entry_alone(BUSHD_TABLE_RUN_HEADER, {0, 0, 0, 0, 0x80, 9, 0})},
         {"a shortest delay of no time",
          entry_alone(BUSHD_TABLE_RUN_HEADER, {0, 5, 0, 0, 0x80, 0, 0})},
         {"no entry", cut_to(BUSHD_TABLE_RUN_HEADER)},
         {"a motor twice", followed_twice_by({15, 5, 0, 0, 0})}},
        true}},
      {"line_run",
       {any_line_run,
        codec(bushd_decode_line_run, encode_line_run, tell),
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
         {"no entry", cut_to(BUSHD_LINE_RUN_HEADER)},
         {"a motor twice", followed_twice_by({15, 1, 0, 0, 0})}},
        true}},
      {"line_trigger",
       {any_line_trigger,
        codec(bushd_decode_line_trigger, encode_line_trigger, tell),
        {{"no number", set8(0, 0)},
         {"no edge", set8(1, 0)},
         {"no such edge", set8(1, 3)},
         {"too short a delay", set32(2, 49)},
         {"too long a delay", set32(2, 1'650'001)},
         {"no such bank", set8(6, 9)},
         {"no way", set32(9, 0)},
         {"no step of the run", set32(17, 0)},
         {"longer than the longest", entry_alone(BUSHD_LINE_TRIGGER_HEADER, {0, 0, 0, 0, 0x80})},
         {"no entry", cut_to(BUSHD_LINE_TRIGGER_HEADER)}},
        true}},
      {"trigger",
       {any_trigger,
        codec(bushd_decode_trigger, encode_trigger, tell),
        {{"no number", set8(0, 0)},
         {"no such edge", set8(1, 3)},
         {"entries to disarm", set8(1, 0)},
         {"too short a delay", set32(2, 49)},
         {"too long a delay", set32(2, 1'650'001)},
         {"no step", entry_alone(6, {0, 0, 0, 0, 0})},
         {"no entry", cut_to(6)}},
        true}},
  };
}

}  // namespace bushd::test
