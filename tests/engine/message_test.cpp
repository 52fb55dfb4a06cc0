#include "engine/message.h"

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/properties.h"

namespace bushd::test {
namespace {

using Bytes = std::vector<uint8_t>;

// A message seen from outside: how its payload looks, and what the engine makes of one. (Which byte
// is which field is pinned by the golden frames of tests/vectors.)
struct Kind {
  std::function<Bytes()> any;  // a valid payload
  std::function<bushd_status(const Bytes&, Bytes*)> decode_encode;
  struct Bad {
    std::string what;
    std::function<void(Bytes*)> spoil;
  };
  std::vector<Bad> out_of_range;
  // Its entries go on to the end of the frame, so what is cut between two is a message too.
  bool open_ended = false;
};

template <class Message>
auto codec(bushd_status (*decode)(const uint8_t*, size_t, Message*),
           size_t (*encode)(const Message*, uint8_t*)) {
  return [=](const Bytes& payload, Bytes* again) {
    Message message{};
    const bushd_status status = decode(payload.data(), payload.size(), &message);
    if (status == BUSHD_OK) {
      again->resize(BUSHD_FRAME_MAX_PAYLOAD);
      again->resize(encode(&message, again->data()));
    }
    return status;
  };
}

Bytes random_bytes(size_t size) {
  return *rc::gen::container<Bytes>(size, rc::gen::arbitrary<uint8_t>());
}

auto set8(size_t at, uint8_t value) {
  return [=](Bytes* payload) { (*payload)[at] = value; };
}
auto set16(size_t at, uint16_t value) {
  return [=](Bytes* payload) { bushd_put_u16(payload->data() + at, value); };
}
auto set32(size_t at, uint32_t value) {
  return [=](Bytes* payload) { bushd_put_u32(payload->data() + at, value); };
}

size_t bits_set(uint16_t mask) {
  size_t bits = 0;
  for (int b = 0; b < 16; ++b) bits += (mask >> b) & 1;
  return bits;
}

bushd_status ticks_again(const Bytes& payload, Bytes* again) {
  bushd_ticks m{};
  const bushd_status status = bushd_decode_ticks(payload.data(), payload.size(), &m);
  if (status != BUSHD_OK) return status;
  RC_ASSERT(m.motors == bits_set(m.mask));
  std::vector<uint16_t> delays;
  for (size_t i = 0; i < m.motors; ++i) delays.push_back(bushd_get_u16(m.delays + 2 * i));
  again->resize(BUSHD_FRAME_MAX_PAYLOAD);
  const size_t head = bushd_encode_ticks_head(m.epoch, m.flags, m.first_tick, m.count, m.mask,
                                              delays.data(), again->data());
  again->resize(head);
  const size_t width = m.flags & BUSHD_TICKS_FINE ? 2 : 1;
  again->insert(again->end(), m.displacements, m.displacements + width * m.motors * m.count);
  return status;
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

bushd_status poll_again(const Bytes& payload, Bytes* again) {
  bushd_poll m{};
  const bushd_status status = bushd_decode_poll(payload.data(), payload.size(), &m);
  if (status != BUSHD_OK) return status;
  std::vector<bushd_poll_entry> entries;
  for (size_t i = 0; i < m.count; ++i) {
    const uint8_t* const at = m.entries + 3 * i;
    entries.push_back({at[0], bushd_get_u16(at + 1)});
  }
  again->resize(BUSHD_FRAME_MAX_PAYLOAD);
  again->resize(bushd_encode_poll(entries.data(), m.count, again->data()));
  return status;
}

Bytes any_poll() {
  const auto count = between<uint8_t>(1, BUSHD_POLL_MAX_ENTRIES);
  Bytes payload = random_bytes(1u + 3u * count);
  payload[0] = count;
  return payload;
}

bushd_status table_ticks_again(const Bytes& payload, Bytes* again) {
  bushd_table_ticks m{};
  const bushd_status status = bushd_decode_table_ticks(payload.data(), payload.size(), &m);
  if (status != BUSHD_OK) return status;
  std::vector<bushd_table_ticks_entry> entries;
  uint16_t at = 0;
  uint16_t mask = 0;
  for (bushd_table_ticks_entry entry; bushd_next_table_ticks_entry(&m, &at, &entry);) {
    mask = static_cast<uint16_t>(mask | 1 << entry.motor);
    entries.push_back(entry);
  }
  RC_ASSERT(mask == m.mask);
  RC_ASSERT(entries.size() == bits_set(m.mask));
  again->resize(BUSHD_FRAME_MAX_PAYLOAD);
  again->resize(bushd_encode_table_ticks(m.epoch, m.flags, m.first_tick, m.count, entries.data(),
                                         static_cast<uint8_t>(entries.size()), again->data()));
  return status;
}

bushd_run_state any_state() {
  bushd_run_state state{};
  state.direction = *rc::gen::element<int8_t>(1, -1);
  state.since = between<uint16_t>(0, 65535);
  state.since_ns = *rc::gen::element<uint32_t>(0, 1, 39999, UINT32_MAX);
  state.lead_delay = *rc::gen::element<uint16_t>(0, 0, 1, 250, 65535);
  state.cruises = *rc::gen::arbitrary<bool>();
  if (state.cruises) return state;
  state.accel_at = between<uint16_t>(0, 65535);
  state.accel_end = between<uint16_t>(0, 65535);
  state.cruise_left = between<uint32_t>(0, UINT32_MAX);
  state.decel_left = between<uint16_t>(0, 65535);
  return state;
}

// As many of the motors as fit, from the lowest on.
Bytes any_table_ticks() {
  const auto mask = between<uint16_t>(1, 0xFFFF);
  const size_t most =
      (BUSHD_FRAME_MAX_PAYLOAD - BUSHD_TABLE_TICKS_HEADER) / BUSHD_TABLE_TICKS_MAX_ENTRY;
  std::vector<bushd_table_ticks_entry> entries;
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU && entries.size() < most; ++m) {
    if ((mask >> m & 1) != 0) entries.push_back({m, any_state()});
  }
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_table_ticks(
      between<uint8_t>(0, 255), *rc::gen::element<uint8_t>(0, 2, 4),
      between<uint32_t>(0, UINT32_MAX), between<uint16_t>(1, 65535), entries.data(),
      static_cast<uint8_t>(entries.size()), payload.data()));
  return payload;
}

bushd_status table_run_again(const Bytes& payload, Bytes* again) {
  bushd_table_run m{};
  const bushd_status status = bushd_decode_table_run(payload.data(), payload.size(), &m);
  if (status != BUSHD_OK) return status;
  std::vector<bushd_table_run_entry> entries;
  for (uint8_t i = 0; i < m.count; ++i) entries.push_back(bushd_get_table_run_entry(m.entries, i));
  again->resize(BUSHD_FRAME_MAX_PAYLOAD);
  again->resize(
      bushd_encode_table_run(m.epoch, m.first_tick, entries.data(), m.count, again->data()));
  return status;
}

Bytes any_table_run() {
  const auto mask = between<uint16_t>(1, 0xFFFF);
  Bytes payload = random_bytes(BUSHD_TABLE_RUN_HEADER);
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) == 0) continue;
    Bytes entry(BUSHD_TABLE_RUN_ENTRY);
    entry[0] = static_cast<uint8_t>(m | between<uint8_t>(0, 15) << 4);
    bushd_put_u32(&entry[1], between<uint32_t>(1, INT32_MAX));
    payload.insert(payload.end(), entry.begin(), entry.end());
  }
  return payload;
}

bushd_status trigger_again(const Bytes& payload, Bytes* again) {
  bushd_trigger m{};
  const bushd_status status = bushd_decode_trigger(payload.data(), payload.size(), &m);
  if (status != BUSHD_OK) return status;
  std::vector<bushd_table_run_entry> entries;
  for (uint8_t i = 0; i < m.count; ++i) entries.push_back(bushd_get_table_run_entry(m.entries, i));
  again->resize(BUSHD_FRAME_MAX_PAYLOAD);
  again->resize(
      bushd_encode_trigger(m.number, m.edge, m.delay_us, entries.data(), m.count, again->data()));
  return status;
}

Bytes any_trigger() {
  const Bytes run = any_table_run();
  Bytes payload(6);
  payload[0] = between<uint8_t>(1, 255);
  payload[1] = between<uint8_t>(1, 2);
  bushd_put_u32(&payload[2], between<uint32_t>(50, 1'500'000));
  payload.insert(payload.end(), run.begin() + BUSHD_TABLE_RUN_HEADER, run.end());
  return payload;
}

bushd_status table_data_again(const Bytes& payload, Bytes* again) {
  bushd_table_data m{};
  const bushd_status status = bushd_decode_table_data(payload.data(), payload.size(), &m);
  if (status != BUSHD_OK) return status;
  std::vector<uint16_t> codes;
  for (size_t i = 0; i < m.count; ++i) codes.push_back(bushd_get_u16(m.codes + 2 * i));
  again->resize(BUSHD_FRAME_MAX_PAYLOAD);
  again->resize(bushd_encode_table_data(m.slot, m.offset, m.count, codes.data(), again->data()));
  return status;
}

Bytes any_table_data() {
  const auto count = between<uint8_t>(1, BUSHD_TABLE_DATA_MAX_CODES);
  Bytes payload = random_bytes(4u + 2u * count);
  payload[0] = between<uint8_t>(0, BUSHD_TABLE_SLOTS - 1);
  payload[3] = count;
  return payload;
}

// Random bytes with the ranged fields put into their range.
std::function<Bytes()> bytes_with(size_t size, std::function<void(Bytes*)> put) {
  return [=] {
    Bytes payload = random_bytes(size);
    put(&payload);
    return payload;
  };
}

void put_tick_ns(Bytes* payload) {
  bushd_put_u32(payload->data(), between(BUSHD_MIN_TICK_NS, BUSHD_MAX_TICK_NS));
}

const std::map<std::string, Kind>& kinds() {
  static const std::map<std::string, Kind> all{
      {"identify",
       {bytes_with(5, [](Bytes* p) { (*p)[2] |= 1; }),
        codec(bushd_decode_identify, bushd_encode_identify),
        {{"no slot", set8(2, 0)}}}},
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
                     (*p)[0] = between<uint8_t>(0, 7);
                     for (const size_t at : {1u, 5u, 7u}) (*p)[at] |= 1;
                   }),
        codec(bushd_decode_table_begin, bushd_encode_table_begin),
        {{"slot 8", set8(0, 8)},
         {"no codes", set16(1, 0)},
         {"cruise 0", set16(5, 0)},
         {"unit 0", set32(7, 0)}}}},
      {"table_data", {any_table_data, table_data_again, {{"slot 8", set8(0, 8)}}}},
      {"table_end",
       {bytes_with(5, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 7); }),
        codec(bushd_decode_table_end, bushd_encode_table_end),
        {{"slot 8", set8(0, 8)}}}},
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
        {{"motor 16", set8(0, 16)}, {"slot 8", set8(1, 8)}}}},
      {"control",
       {bytes_with(
            1, [](Bytes* p) { (*p)[0] = *rc::gen::element<uint8_t>(0, 1, 2, 4, 5, 6, 8, 9, 14); }),
        codec(bushd_decode_control, bushd_encode_control),
        {{"enable and disable", set8(0, 3)},
         {"both and clear", set8(0, 7)},
         {"unknown", set8(0, 16)}}}},
      {"set_position",
       {bytes_with(5, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 15); }),
        codec(bushd_decode_set_position, bushd_encode_set_position),
        {{"motor 16", set8(0, 16)}}}},
      {"set_inputs",
       {bytes_with(14,
                   [](Bytes* p) {
                     (*p)[8] = between<uint8_t>(0, BUSHD_MAX_DEBOUNCE_TICKS);
                     (*p)[9] = between<uint8_t>(0, BUSHD_SYSTEM_INPUTS);
                     (*p)[10] = between<uint8_t>(0, 2);
                     bushd_put_u16(p->data() + 11, between<uint16_t>(0, 1023));
                     (*p)[13] = between<uint8_t>(0, 1);
                   }),
        codec(bushd_decode_set_inputs, bushd_encode_set_inputs),
        {{"a debounce beyond the counters", set8(8, 16)},
         {"unknown input", set8(9, 16)},
         {"unknown action", set8(10, 3)},
         {"more than can be read", set16(11, 1024)},
         {"neither on nor off", set8(13, 2)}}}},
      {"home",
       {bytes_with(16,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = *rc::gen::element<uint8_t>(1, 0xFF);
                     (*p)[5] &= 0x7F;
                     (*p)[9] &= 0x7F;
                     (*p)[6] |= 1;
                     (*p)[10] |= 1;
                   }),
        codec(bushd_decode_home, bushd_encode_home),
        {{"motor 16", set8(0, 16)},
         {"no direction", set8(1, 0)},
         {"twice the direction", set8(1, 2)},
         {"too many steps", set32(2, 0x80000000)},
         {"no slow steps", set32(6, 0)},
         {"too many slow steps", set32(6, 0x80000000)},
         {"no delay", set16(10, 0)}}}},
      {"local",
       {[] { return random_bytes(2); }, codec(bushd_decode_local, bushd_encode_local), {}}},
      {"poll", {any_poll, poll_again, {}}},
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
        ticks_again,
        {{"unknown flag", [](Bytes* p) { (*p)[1] |= 8; }},
         {"start and replacement at once", [](Bytes* p) { (*p)[1] |= 6; }}}}},
      {"table_ticks",
       {any_table_ticks,
        table_ticks_again,
        {{"fine", [](Bytes* p) { (*p)[1] |= 1; }},
         {"unknown flag", [](Bytes* p) { (*p)[1] |= 8; }},
         {"start and replacement at once", [](Bytes* p) { (*p)[1] |= 6; }},
         {"no ticks", set16(6, 0)},
         {"no entry", [](Bytes* p) { p->resize(BUSHD_TABLE_TICKS_HEADER); }}},
        true}},
      {"table_run",
       {any_table_run,
        table_run_again,
        {{"no step", set32(BUSHD_TABLE_RUN_HEADER + 1, 0)},
         {"more steps than a position has", set32(BUSHD_TABLE_RUN_HEADER + 1, 0x80000000u)},
         {"no entry", [](Bytes* p) { p->resize(BUSHD_TABLE_RUN_HEADER); }},
         {"a motor twice",
          [](Bytes* p) {
            const Bytes entry(p->end() - BUSHD_TABLE_RUN_ENTRY, p->end());
            p->insert(p->end(), entry.begin(), entry.end());
          }}},
        true}},
      {"trigger",
       {any_trigger,
        trigger_again,
        {{"no number", set8(0, 0)},
         {"no such edge", set8(1, 3)},
         {"entries to disarm", set8(1, 0)},
         {"too short a delay", set32(2, 49)},
         {"too long a delay", set32(2, 1'500'001)},
         {"no step", set32(7, 0)},
         {"no entry", [](Bytes* p) { p->resize(6); }}},
        true}},
      {"reference",
       {bytes_with(14,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = between<uint8_t>(0, 3);
                     bushd_put_u32(p->data() + 6, between<uint32_t>(0, 1'500'000));
                     bushd_put_u32(p->data() + 10, between<uint32_t>(1, 1'000'000));
                   }),
        codec(bushd_decode_reference, bushd_encode_reference),
        {{"motor 16", set8(0, 16)},
         {"no such arrival", set8(1, 4)},
         {"too long a delay", set32(6, 1'500'001)},
         {"no width", set32(10, 0)},
         {"too wide", set32(10, 1'000'001)}}}},
      {"emergency",
       {bytes_with(1, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 1); }),
        codec(bushd_decode_emergency, bushd_encode_emergency),
        {{"no such way", set8(0, 2)}}}},
      {"emission",
       {bytes_with(11,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 4);
                     (*p)[1] = between<uint8_t>(0, 3);
                     (*p)[2] = between<uint8_t>(0, 1);
                     bushd_put_u16(p->data() + 3, between<uint16_t>(1, 65535));
                   }),
        codec(bushd_decode_emission, bushd_encode_emission),
        {{"mode 5", set8(0, 5)},
         {"sequence 4", set8(1, 4)},
         {"hold current 2", set8(2, 2)},
         {"no step period",
          [](Bytes* p) {
            (*p)[0] = BUSHD_EMISSION_BURST;
            bushd_put_u16(p->data() + 3, 0);
          }}}}},
      {"report",
       {[] {
          const auto motors = between<uint8_t>(0, 16);
          Bytes payload = random_bytes(BUSHD_REPORT_SIZE(motors));
          payload[0] = between<uint8_t>(0, 3);
          payload[68] = between<uint8_t>(0, 6);
          payload[77] = motors;
          return payload;
        },
        codec(bushd_decode_report, bushd_encode_report),
        {{"state 4", set8(0, 4)}, {"trigger state 7", set8(68, 7)}, {"17 motors", set8(77, 17)}}}},
      {"acknowledgement",
       {[] { return random_bytes(1); },
        codec(bushd_decode_acknowledgement, bushd_encode_acknowledgement),
        {}}},
  };
  return all;
}

class Message : public testing::TestWithParam<std::string> {
 protected:
  const Kind& kind() const { return kinds().at(GetParam()); }
};

TEST_P(Message, EveryBitComesThrough) {
  holds(GetParam() + ": encode(decode(payload)) == payload", [this] {
    const Bytes payload = kind().any();
    Bytes again;
    RC_ASSERT(kind().decode_encode(payload, &again) == BUSHD_OK);
    RC_ASSERT(again == payload);
  });
}

TEST_P(Message, RefusesEveryTruncationAndEveryByteTooMany) {
  holds(GetParam() + ": only the exact length is taken", [this] {
    Bytes payload = kind().any();
    Bytes again;
    for (size_t size = 0; size < payload.size(); ++size) {
      const Bytes part(payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(size));
      const bushd_status status = kind().decode_encode(part, &again);
      if (kind().open_ended && status == BUSHD_OK) {
        RC_ASSERT(again == part);
      } else if (!kind().open_ended || status != BUSHD_E_FORMAT) {
        RC_ASSERT(status == BUSHD_E_LENGTH);
      }
    }
    payload.push_back(*rc::gen::arbitrary<uint8_t>());
    RC_ASSERT(kind().decode_encode(payload, &again) == BUSHD_E_LENGTH);
  });
}

TEST_P(Message, RefusesFieldsOutOfRange) {
  for (const auto& bad : kind().out_of_range) {
    holds(GetParam() + ": " + bad.what, [&] {
      Bytes payload = kind().any();
      bad.spoil(&payload);
      Bytes again;
      RC_ASSERT(kind().decode_encode(payload, &again) == BUSHD_E_FORMAT);
    });
  }
}

TEST_P(Message, SurvivesAnyPayload) {
  holds(GetParam() + ": any bytes decode or are refused", [this] {
    const Bytes payload = random_bytes(between<size_t>(1, BUSHD_FRAME_MAX_PAYLOAD));
    Bytes again;
    const bushd_status status = kind().decode_encode(payload, &again);
    RC_ASSERT(status == BUSHD_OK || status == BUSHD_E_LENGTH || status == BUSHD_E_FORMAT);
  });
}

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for (const auto& [name, kind] : kinds()) names.push_back(name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Every, Message, testing::ValuesIn(kind_names()),
                         [](const auto& kind) { return kind.param; });

// Payloads that are as long as these fields say, so that only the range speaks against them.
TEST(MessageTicks, RefusesNoTicksAndNoMotors) {
  bushd_ticks message;
  Bytes payload(BUSHD_TICKS_HEADER + 2, 0);
  bushd_put_u16(payload.data() + 7, 1);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
  payload.resize(BUSHD_TICKS_HEADER);
  payload[6] = 1;
  bushd_put_u16(payload.data() + 7, 0);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
}

TEST(MessageTicks, RefusesTheFineDisplacementWithoutACounterpart) {
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  const uint16_t delay = 10;
  std::size_t size = bushd_encode_ticks_head(0, BUSHD_TICKS_FINE, 5, 2, 1, &delay, payload.data());
  bushd_put_i16(&payload[size], 7);
  bushd_put_i16(&payload[size + 2], INT16_MIN + 1);
  bushd_ticks ticks{};
  EXPECT_EQ(bushd_decode_ticks(payload.data(), size + 4, &ticks), BUSHD_OK);
  bushd_put_i16(&payload[size + 2], INT16_MIN);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), size + 4, &ticks), BUSHD_E_FORMAT);
}

TEST(MessageTableTicks, RefusesMotorsThatDoNotRise) {
  holds("an order of motors is taken if it rises", [] {
    const std::vector<bushd_table_ticks_entry> entries{{between<uint8_t>(0, 15), any_state()},
                                                       {between<uint8_t>(0, 15), any_state()}};
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(bushd_encode_table_ticks(0, 0, 1, 1, entries.data(), 2, payload.data()));
    bushd_table_ticks message{};
    RC_ASSERT(bushd_decode_table_ticks(payload.data(), payload.size(), &message) ==
              (entries[0].motor < entries[1].motor ? BUSHD_OK : BUSHD_E_FORMAT));
  });
}

TEST(MessageTableTicks, RefusesAFieldOf0ThatNeedNotBeThere) {
  bushd_table_ticks_entry entry{5, {}};
  entry.state.direction = 1;
  entry.state.since_ns = 7;
  entry.state.lead_delay = 9;
  entry.state.decel_left = 1;
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_table_ticks(1, 0, 1000, 190, &entry, 1, payload.data()));
  bushd_table_ticks message{};
  EXPECT_EQ(bushd_decode_table_ticks(payload.data(), payload.size(), &message), BUSHD_OK);
  Bytes no_ns = payload;
  bushd_put_u32(&no_ns[BUSHD_TABLE_TICKS_HEADER + 3], 0);
  EXPECT_EQ(bushd_decode_table_ticks(no_ns.data(), no_ns.size(), &message), BUSHD_E_FORMAT);
  Bytes no_lead = payload;
  bushd_put_u16(&no_lead[BUSHD_TABLE_TICKS_HEADER + 7], 0);
  EXPECT_EQ(bushd_decode_table_ticks(no_lead.data(), no_lead.size(), &message), BUSHD_E_FORMAT);
}

TEST(MessageTableTicks, AMotorInCruiseTakesThreeBytes) {
  bushd_table_ticks_entry entry{5, {}};
  entry.state.direction = -1;
  entry.state.cruises = true;
  entry.state.since = 9;
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  EXPECT_EQ(bushd_encode_table_ticks(1, 0, 1000, 190, &entry, 1, payload.data()),
            BUSHD_TABLE_TICKS_HEADER + 3);
}

TEST(MessageTableTicks, NoEntryIsLongerThanTheLongest) {
  const bushd_table_ticks_entry entry{15, {1, false, 9, 9, 9, 9, 9, 9, 9}};
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  EXPECT_EQ(bushd_encode_table_ticks(1, 0, 1000, 190, &entry, 1, payload.data()),
            BUSHD_TABLE_TICKS_HEADER + BUSHD_TABLE_TICKS_MAX_ENTRY);
}

TEST(MessageTableRun, OfAllMotorsFitsAFrame) {
  EXPECT_LE(BUSHD_TABLE_RUN_HEADER + BUSHD_TABLE_RUN_ENTRY * BUSHD_MOTORS_PER_MCU,
            BUSHD_FRAME_MAX_PAYLOAD);
}

TEST(MessagePoll, RefusesToAskNobody) {
  bushd_poll message;
  const uint8_t nobody = 0;
  EXPECT_EQ(bushd_decode_poll(&nobody, 1, &message), BUSHD_E_FORMAT);
}

TEST(MessagePoll, TellsEachAddressItsSlot) {
  const std::vector<bushd_poll_entry> entries{{7, 50}, {1, 700}, {255, 65535}};
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_poll(entries.data(), 3, payload.data()));
  bushd_poll poll{};
  ASSERT_EQ(bushd_decode_poll(payload.data(), payload.size(), &poll), BUSHD_OK);
  for (const auto& expected : entries) {
    bushd_poll_entry entry{};
    ASSERT_TRUE(bushd_poll_find(&poll, expected.address, &entry));
    EXPECT_EQ(entry.address, expected.address);
    EXPECT_EQ(entry.begin_units, expected.begin_units);
  }
  bushd_poll_entry entry{};
  EXPECT_FALSE(bushd_poll_find(&poll, 2, &entry));
}

TEST(MessagePoll, TheMostEntriesFillAFrame) {
  EXPECT_LE(1 + 3 * BUSHD_POLL_MAX_ENTRIES, BUSHD_FRAME_MAX_PAYLOAD);
  EXPECT_GT(1 + 3 * (BUSHD_POLL_MAX_ENTRIES + 1), BUSHD_FRAME_MAX_PAYLOAD);
}

TEST(MessageIdentity, OfAnotherVersionTellsThatVersionAndNothingElse) {
  holds("any payload that begins with another version", [] {
    Bytes payload = random_bytes(between<size_t>(1, BUSHD_FRAME_MAX_PAYLOAD));
    RC_PRE(payload[0] != BUSHD_PROTOCOL_VERSION);
    bushd_identity identity{};
    RC_ASSERT(bushd_decode_identity(payload.data(), payload.size(), &identity) == BUSHD_OK);
    RC_ASSERT(identity.protocol_version == payload[0]);
    RC_ASSERT(identity.motors == 0 && identity.boot_number == 0 && identity.capabilities == 0);
  });
}

// MCUs that chose the same slot must be able to get apart: another salt, other slots.
TEST(IdentifySlot, AnySaltSpreadsTheMcusOverTheSlots) {
  constexpr uint8_t kSlots = 16;
  for (uint16_t salt = 0; salt < 50; ++salt) {
    std::vector<int> in_slot(kSlots);
    for (int mcu = 0; mcu < 16 * kSlots; ++mcu) {
      const uint8_t id[BUSHD_UNIQUE_ID_SIZE] = {'b', 'u', 's', 'h',
                                                0,   0,   1,   static_cast<uint8_t>(mcu)};
      const uint8_t slot = bushd_identify_slot(id, salt, kSlots);
      ASSERT_LT(slot, kSlots);
      ++in_slot[slot];
    }
    for (const int mcus : in_slot) EXPECT_LT(mcus, 3 * 16) << "salt " << salt;
  }
}

TEST(IdentifySlot, TwoMcusAreApartAfterFewSalts) {
  holds("some of 20 salts parts two ids", [] {
    const Bytes one = random_bytes(BUSHD_UNIQUE_ID_SIZE);
    const Bytes other = random_bytes(BUSHD_UNIQUE_ID_SIZE);
    RC_PRE(one != other);
    bool apart = false;
    for (uint16_t salt = 0; salt < 20; ++salt) {
      apart = apart || bushd_identify_slot(one.data(), salt, 8) !=
                           bushd_identify_slot(other.data(), salt, 8);
    }
    RC_ASSERT(apart);
  });
}

TEST(MessageTableData, RefusesNoCodesAndTooMany) {
  bushd_table_data message;
  EXPECT_EQ(bushd_decode_table_data(Bytes(4, 0).data(), 4, &message), BUSHD_E_FORMAT);
  Bytes payload(4 + 2 * 121, 1);
  payload[3] = 121;
  EXPECT_EQ(bushd_decode_table_data(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
}

TEST(MessageTicks, CapacityIsTheMostThatFitsAFrame) {
  for (uint8_t motors = 1; motors <= BUSHD_MOTORS_PER_MCU; ++motors) {
    for (const bool fine : {false, true}) {
      const size_t capacity = bushd_ticks_capacity(motors, fine);
      const size_t head = BUSHD_TICKS_HEADER + 2u * motors;
      const size_t row = (fine ? 2u : 1u) * motors;
      EXPECT_GE(capacity, 1u);
      EXPECT_LE(head + capacity * row, BUSHD_FRAME_MAX_PAYLOAD);
      EXPECT_GT(head + (capacity + 1) * row, BUSHD_FRAME_MAX_PAYLOAD);
    }
  }
}

TEST(MessageReport, OfSixteenMotorsFitsAFrame) {
  EXPECT_LE(BUSHD_REPORT_SIZE(BUSHD_MOTORS_PER_MCU), BUSHD_FRAME_MAX_PAYLOAD);
}

TEST(Status, EveryCodeHasItsOwnText) {
  std::map<std::string, int> texts;
  for (int code = 0; code <= BUSHD_E_STEP_PERIOD; ++code) {
    ++texts[bushd_status_text(static_cast<bushd_status>(code))];
  }
  EXPECT_EQ(texts.size(), BUSHD_E_STEP_PERIOD + 1u);
  EXPECT_EQ(texts.count("unknown status"), 0u);
  const uint8_t from_the_wire = 200;
  EXPECT_STREQ(bushd_status_text(static_cast<bushd_status>(from_the_wire + texts.size())),
               "unknown status");
}

}  // namespace
}  // namespace bushd::test
