// All decoders of messages, those of the MCU and those of the master, on one payload: what is
// accepted keeps the ranges that engine/message.h promises, and is what the encoder makes of it.
#include <array>
#include <bit>
#include <cstring>

#include "engine/message.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Payload = std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD>;

bool same(Bytes payload, const Payload& again, std::size_t size) {
  return size == payload.size() && std::memcmp(payload.data(), again.data(), size) == 0;
}

// The decoded message, having gone through the encoder as well; false: refused.
template <class Message, class Decode, class Encode>
bool decoded(Bytes payload, Message* message, Decode decode, Encode encode) {
  // Nothing must be left as it was in a message that is accepted.
  std::memset(static_cast<void*>(message), 0xA5, sizeof *message);
  const bushd_status status = decode(payload.data(), payload.size(), message);
  BUSHD_REQUIRE(status == BUSHD_OK || status == BUSHD_E_LENGTH || status == BUSHD_E_FORMAT);
  if (status != BUSHD_OK) return false;
  Payload again;
  BUSHD_REQUIRE(same(payload, again, encode(message, again.data())));
  return true;
}

bool inside(Bytes payload, const std::uint8_t* at, std::size_t size) {
  return at >= payload.data() && at + size <= payload.data() + payload.size();
}

void decode_for_mcu(Bytes payload) {
  bushd_configure configure;
  if (decoded(payload, &configure, bushd_decode_configure, bushd_encode_configure)) {
    BUSHD_REQUIRE(configure.tick_ns >= BUSHD_MIN_TICK_NS && configure.tick_ns <= BUSHD_MAX_TICK_NS);
    BUSHD_REQUIRE(configure.format == BUSHD_FORMAT_COARSE || configure.format == BUSHD_FORMAT_FINE);
  }
  bushd_table_begin begin;
  if (decoded(payload, &begin, bushd_decode_table_begin, bushd_encode_table_begin)) {
    BUSHD_REQUIRE(begin.slot < BUSHD_TABLE_SLOTS && begin.accel_count >= 1);
    BUSHD_REQUIRE(begin.cruise >= 1 && begin.time_unit_ns >= 1);
  }
  bushd_table_data data;
  const auto encode_data = [](const bushd_table_data* message, std::uint8_t* out) {
    std::array<std::uint16_t, BUSHD_TABLE_DATA_MAX_CODES> codes;
    for (std::size_t i = 0; i < message->count; ++i) {
      codes[i] = bushd_get_u16(message->codes + 2 * i);
    }
    return bushd_encode_table_data(message->slot, message->offset, message->count, codes.data(),
                                   out);
  };
  if (decoded(payload, &data, bushd_decode_table_data, encode_data)) {
    BUSHD_REQUIRE(data.slot < BUSHD_TABLE_SLOTS && data.count >= 1);
    BUSHD_REQUIRE(data.count <= BUSHD_TABLE_DATA_MAX_CODES);
    BUSHD_REQUIRE(inside(payload, data.codes, 2u * data.count));
  }
  bushd_table_end end;
  if (decoded(payload, &end, bushd_decode_table_end, bushd_encode_table_end)) {
    BUSHD_REQUIRE(end.slot < BUSHD_TABLE_SLOTS);
  }
  bushd_assign assign;
  if (decoded(payload, &assign, bushd_decode_assign, bushd_encode_assign)) {
    BUSHD_REQUIRE(assign.motor < BUSHD_MOTORS_PER_MCU && assign.slot < BUSHD_TABLE_SLOTS);
  }
  bushd_control control;
  if (decoded(payload, &control, bushd_decode_control, bushd_encode_control)) {
    BUSHD_REQUIRE(control.actions < 8 && (control.actions & 3) != 3);
  }
  bushd_set_position position;
  if (decoded(payload, &position, bushd_decode_set_position, bushd_encode_set_position)) {
    BUSHD_REQUIRE(position.motor < BUSHD_MOTORS_PER_MCU);
  }
  bushd_sync sync;
  if (decoded(payload, &sync, bushd_decode_sync, bushd_encode_sync)) {
    BUSHD_REQUIRE(sync.mark_ns < BUSHD_MAX_TICK_NS);
  }
}

void decode_ticks(Bytes payload) {
  const auto width = [](const bushd_ticks* message) -> std::size_t {
    return (message->flags & BUSHD_TICKS_FINE) != 0 ? 2 : 1;
  };
  const auto encode = [&](const bushd_ticks* message, std::uint8_t* out) {
    std::array<std::uint16_t, BUSHD_MOTORS_PER_MCU> delays;
    for (std::size_t i = 0; message->delays != nullptr && i < message->motors; ++i) {
      delays[i] = bushd_get_u16(message->delays + 2 * i);
    }
    const std::size_t head = bushd_encode_ticks_head(
        message->epoch, message->flags, message->first_tick, message->count, message->mask,
        message->delays != nullptr ? delays.data() : nullptr, out);
    const std::size_t size = width(message) * message->count * message->motors;
    BUSHD_REQUIRE(inside(payload, message->displacements, size));
    std::memcpy(out + head, message->displacements, size);
    return head + size;
  };
  bushd_ticks ticks;
  if (!decoded(payload, &ticks, bushd_decode_ticks, encode)) return;
  BUSHD_REQUIRE(ticks.count >= 1 && ticks.mask != 0);
  BUSHD_REQUIRE(ticks.motors == std::popcount(ticks.mask));
  const bool delays = (ticks.flags & BUSHD_TICKS_DELAYS) != 0;
  BUSHD_REQUIRE(delays == (ticks.delays != nullptr));
  BUSHD_REQUIRE((ticks.flags & 12) != 12 && ticks.flags < 16);
  BUSHD_REQUIRE(ticks.count <= bushd_ticks_capacity(ticks.motors, width(&ticks) == 2, delays));
}

void decode_for_master(Bytes payload) {
  bushd_identity identity;
  if (decoded(payload, &identity, bushd_decode_identity, bushd_encode_identity)) {
    BUSHD_REQUIRE(identity.motors >= 1 && identity.motors <= BUSHD_MOTORS_PER_MCU);
  }
  bushd_report report;
  if (decoded(payload, &report, bushd_decode_report, bushd_encode_report)) {
    BUSHD_REQUIRE(report.state <= BUSHD_STATE_FAULT);
    BUSHD_REQUIRE(report.motor_count <= BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(payload.size() == BUSHD_REPORT_SIZE(report.motor_count));
  }
  bushd_acknowledgement acknowledgement;
  decoded(payload, &acknowledgement, bushd_decode_acknowledgement, bushd_encode_acknowledgement);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > BUSHD_FRAME_MAX_PAYLOAD) return 0;
  const std::span payload(data, size);
  bushd::fuzz::decode_for_mcu(payload);
  bushd::fuzz::decode_ticks(payload);
  bushd::fuzz::decode_for_master(payload);
  return 0;
}
