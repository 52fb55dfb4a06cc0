// For tests of one machine of the master: the frames that it sent, and answers to them.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "bus/rs485/frame_writer.h"
#include "bus/rs485/mcu_record.h"

namespace bushd::test {

using Bytes = std::vector<std::uint8_t>;
using link::McuAddress;
using link::McuIndex;
using link::McuRecord;
using link::PerMcu;

constexpr std::uint32_t kBaud = 500'000;
constexpr std::uint32_t kTickNs = 2'560'000;
constexpr McuIndex kFirst{0};
constexpr McuIndex kSecond{1};

struct Sent {
  McuAddress address;
  std::uint8_t type;
  std::uint8_t sequence;
  Bytes payload;
};

// What the writer has sent, and nothing of it a second time.
inline std::vector<Sent> take_sent(link::FrameWriter& writer) {
  std::vector<Sent> sent;
  bushd_receiver receiver{};
  for (const std::uint8_t byte : writer.bytes()) {
    bushd_frame frame;
    const bushd_receive received = bushd_receive_byte(&receiver, byte, &frame);
    EXPECT_TRUE(received == BUSHD_RECEIVE_MORE || received == BUSHD_RECEIVE_FRAME);
    if (received != BUSHD_RECEIVE_FRAME) continue;
    sent.push_back({McuAddress{frame.address}, frame.type, frame.sequence,
                    Bytes(frame.payload, frame.payload + frame.payload_size)});
  }
  writer.clear();
  return sent;
}

inline Bytes frame_bytes(std::uint8_t address, std::uint8_t type, std::uint8_t sequence,
                         const Bytes& payload) {
  Bytes wire(1 + BUSHD_FRAME_MAX_WIRE);
  wire.resize(1 + bushd_frame_encode(address, type, sequence, payload.data(), payload.size(),
                                     wire.data() + 1));
  return wire;
}

// Slow enough for any MCU.
inline const bushd_table& small_table() {
  static const std::array<std::uint16_t, 3> codes = {300, 200, 150};
  static const bushd_table table = {.accel = {codes.data(), 3, nullptr, nullptr, 0},
                                    .decel = {codes.data(), 3, nullptr, nullptr, 0},
                                    .cruise = 100,
                                    .time_unit_ns = 40'000};
  return table;
}

// MCUs at the addresses 1, 2, ..., online, with four outputs and no report yet.
inline PerMcu<McuRecord> online_mcus(std::size_t count) {
  PerMcu<McuRecord> mcus;
  for (std::size_t i = 0; i < count; ++i) {
    McuRecord mcu;
    mcu.setup.address = McuAddress{static_cast<std::uint8_t>(i + 1)};
    mcu.setup.tables = {{&small_table(), 1}};
    for (std::size_t m = 0; m < 4; ++m) mcu.setup.table_of_motor[m] = std::uint8_t{0};
    mcu.view.phase = link::McuPhase::kOnline;
    mcu.view.identified = true;
    mcu.view.identity.motors = 4;
    mcu.view.identity.slots = 256;
    mcu.view.identity.queue_ticks = 256;
    mcu.view.identity.table_codes = 1000;
    mcu.view.identity.protocol_version = BUSHD_PROTOCOL_VERSION;
    mcu.view.identity.capabilities = BUSHD_CAN_FINE | BUSHD_CAN_COARSE | BUSHD_CAN_TABLE_RUN;
    mcus.push_back(mcu);
  }
  return mcus;
}

inline link::BusSetup bus_setup(const PerMcu<McuRecord>& mcus) {
  link::BusSetup setup{.baud = kBaud, .tick_ns = kTickNs, .mcus = {}};
  for (const McuRecord& mcu : mcus) setup.mcus.push_back(mcu.setup);
  return setup;
}

}  // namespace bushd::test
