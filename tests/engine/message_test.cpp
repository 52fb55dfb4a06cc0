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
  if (m.delays != nullptr) {
    for (size_t i = 0; i < m.motors; ++i) delays.push_back(bushd_get_u16(m.delays + 2 * i));
  }
  again->resize(BUSHD_FRAME_MAX_PAYLOAD);
  const size_t head = bushd_encode_ticks_head(m.epoch, m.flags, m.first_tick, m.count, m.mask,
                                              m.delays ? delays.data() : nullptr, again->data());
  again->resize(head);
  const size_t width = m.flags & BUSHD_TICKS_FINE ? 2 : 1;
  again->insert(again->end(), m.displacements, m.displacements + width * m.motors * m.count);
  return status;
}

Bytes any_ticks() {
  const auto flags = between<uint8_t>(0, 11);  // START and REPLACE never together
  const auto mask = static_cast<uint16_t>(between(1, 0xFFFF));
  const auto motors = static_cast<uint8_t>(bits_set(mask));
  const uint8_t most =
      bushd_ticks_capacity(motors, flags & BUSHD_TICKS_FINE, flags & BUSHD_TICKS_DELAYS);
  const auto count = between<uint8_t>(1, most);
  const size_t width = flags & BUSHD_TICKS_FINE ? 2 : 1;
  Bytes payload =
      random_bytes(BUSHD_TICKS_HEADER + (flags & BUSHD_TICKS_DELAYS ? 2u * motors : 0u) +
                   width * motors * count);
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
      {"identity",
       {bytes_with(12, [](Bytes* p) { (*p)[1] = between<uint8_t>(1, 16); }),
        codec(bushd_decode_identity, bushd_encode_identity),
        {{"no motor", set8(1, 0)}, {"17 motors", set8(1, 17)}}}},
      {"configure",
       {bytes_with(5,
                   [](Bytes* p) {
                     put_tick_ns(p);
                     (*p)[4] = between<uint8_t>(0, 1);
                   }),
        codec(bushd_decode_configure, bushd_encode_configure),
        {{"tick too short", set32(0, BUSHD_MIN_TICK_NS - 1)},
         {"tick too long", set32(0, BUSHD_MAX_TICK_NS + 1)},
         {"unknown format", set8(4, 2)}}}},
      {"table_begin",
       {bytes_with(11,
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
       {bytes_with(3, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 7); }),
        codec(bushd_decode_table_end, bushd_encode_table_end),
        {{"slot 8", set8(0, 8)}}}},
      {"assign",
       {bytes_with(2,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = between<uint8_t>(0, 7);
                   }),
        codec(bushd_decode_assign, bushd_encode_assign),
        {{"motor 16", set8(0, 16)}, {"slot 8", set8(1, 8)}}}},
      {"control",
       {bytes_with(1, [](Bytes* p) { (*p)[0] = *rc::gen::element<uint8_t>(0, 1, 2, 4, 5, 6); }),
        codec(bushd_decode_control, bushd_encode_control),
        {{"enable and disable", set8(0, 3)},
         {"both and clear", set8(0, 7)},
         {"unknown", set8(0, 8)}}}},
      {"set_position",
       {bytes_with(5, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 15); }),
        codec(bushd_decode_set_position, bushd_encode_set_position),
        {{"motor 16", set8(0, 16)}}}},
      {"sync",
       {bytes_with(10,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 1);
                     bushd_put_u32(p->data() + 6, between(0u, BUSHD_MAX_TICK_NS - 1));
                   }),
        codec(bushd_decode_sync, bushd_encode_sync),
        {{"follows 2", set8(0, 2)}, {"mark beyond any tick", set32(6, BUSHD_MAX_TICK_NS)}}}},
      {"ticks",
       {any_ticks,
        ticks_again,
        {{"unknown flag", [](Bytes* p) { (*p)[1] |= 16; }},
         {"start and replacement at once", [](Bytes* p) { (*p)[1] |= 12; }}}}},
      {"report",
       {[] {
          const auto motors = between<uint8_t>(0, 16);
          Bytes payload = random_bytes(BUSHD_REPORT_SIZE(motors));
          payload[0] = between<uint8_t>(0, 3);
          payload[32] = motors;
          return payload;
        },
        codec(bushd_decode_report, bushd_encode_report),
        {{"state 4", set8(0, 4)}, {"17 motors", set8(32, 17)}}}},
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
      RC_ASSERT(kind().decode_encode(
                    Bytes(payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(size)),
                    &again) == BUSHD_E_LENGTH);
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
  Bytes payload(BUSHD_TICKS_HEADER, 0);
  bushd_put_u16(payload.data() + 7, 1);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
  payload[6] = 1;
  bushd_put_u16(payload.data() + 7, 0);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
}

TEST(MessageTicks, RefusesTheFineDisplacementWithoutACounterpart) {
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  std::size_t size = bushd_encode_ticks_head(0, BUSHD_TICKS_FINE, 5, 2, 1, nullptr, payload.data());
  bushd_put_i16(&payload[size], 7);
  bushd_put_i16(&payload[size + 2], INT16_MIN + 1);
  bushd_ticks ticks{};
  EXPECT_EQ(bushd_decode_ticks(payload.data(), size + 4, &ticks), BUSHD_OK);
  bushd_put_i16(&payload[size + 2], INT16_MIN);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), size + 4, &ticks), BUSHD_E_FORMAT);
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
      for (const bool delays : {false, true}) {
        const size_t capacity = bushd_ticks_capacity(motors, fine, delays);
        const size_t head = BUSHD_TICKS_HEADER + (delays ? 2u * motors : 0u);
        const size_t row = (fine ? 2u : 1u) * motors;
        EXPECT_GE(capacity, 1u);
        EXPECT_LE(head + capacity * row, BUSHD_FRAME_MAX_PAYLOAD);
        EXPECT_GT(head + (capacity + 1) * row, BUSHD_FRAME_MAX_PAYLOAD);
      }
    }
  }
}

TEST(MessageReport, OfSixteenMotorsFitsAFrame) {
  EXPECT_LE(BUSHD_REPORT_SIZE(BUSHD_MOTORS_PER_MCU), BUSHD_FRAME_MAX_PAYLOAD);
}

TEST(Status, EveryCodeHasItsOwnText) {
  std::map<std::string, int> texts;
  for (int code = 0; code <= BUSHD_E_UNKNOWN_MESSAGE; ++code) {
    ++texts[bushd_status_text(static_cast<bushd_status>(code))];
  }
  EXPECT_EQ(texts.size(), BUSHD_E_UNKNOWN_MESSAGE + 1u);
  EXPECT_EQ(texts.count("unknown status"), 0u);
  const uint8_t from_the_wire = 200;
  EXPECT_STREQ(bushd_status_text(static_cast<bushd_status>(from_the_wire + texts.size())),
               "unknown status");
}

}  // namespace
}  // namespace bushd::test
