#include "config/bus_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "config/board_section.h"
#include "config/checks.h"
#include "config/serial_pulse_section.h"
#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

// In the order of BusKind.
constexpr std::array<std::string_view, 3> kBusKinds = {"rs485", "serial-pulse", "commutator"};

Result<std::uint32_t> read_baud(const TomlReader& reader) {
  const auto rates = baud_rates();
  const auto baud = reader.integer("baud", rates.front(), rates.back(), "bit/s");
  if (!baud) return fail(baud.error());
  const auto rate = static_cast<std::uint32_t>(*baud);
  if (std::binary_search(rates.begin(), rates.end(), rate)) return rate;
  return fail(reader.error("baud", fmt::format("is {}; allowed: {}", rate,
                                               fmt::join(rates.begin(), rates.end(), ", "))));
}

// Reads the keys of a bus of kind "rs485".
Result<void> read_rs485(const TomlReader& reader, Bus* bus) {
  if (auto known = reader.only({"name", "kind", "port", "baud", "tick_us", "format", "moves",
                                "frames", "streams", "emergency_stop"});
      !known) {
    return known;
  }
  const auto baud = read_baud(reader);
  if (!baud) return fail(baud.error());
  bus->baud = *baud;
  const auto tick_us =
      reader.integer("tick_us", BUSHD_MIN_TICK_NS / 1000, BUSHD_MAX_TICK_NS / 1000, "us");
  if (!tick_us) return fail(tick_us.error());
  bus->tick_us = static_cast<std::uint32_t>(*tick_us);
  const auto format = read_word(reader, "format", {"fine", "coarse"});
  if (!format) return fail(format.error());
  bus->format = *format == 0 ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE;
  return {};
}

// Reads the keys of a bus of kind "commutator".
Result<void> read_commutator(const TomlReader& reader, Bus* bus) {
  if (auto known = reader.only(
          {"name", "kind", "port", "baud", "start_hz", "converter", "answer_ms", "emergency_stop"});
      !known) {
    return known;
  }
  const auto baud = read_baud(reader);
  if (!baud) return fail(baud.error());
  bus->baud = *baud;
  return read_board(reader, bus);
}

}  // namespace

Result<void> read_bus_kind(const TomlReader& reader, Bus* bus) {
  if (reader.has("kind")) {
    const auto kind = read_word(reader, "kind", kBusKinds);
    if (!kind) return fail(kind.error());
    bus->kind = static_cast<BusKind>(*kind);
  }
  switch (bus->kind) {
    case BusKind::kSerialPulse:
      return read_serial_pulse(reader, bus);
    case BusKind::kCommutator:
      return read_commutator(reader, bus);
    case BusKind::kRs485:
      break;
  }
  return read_rs485(reader, bus);
}

// The keys of a bus that may be left out.
Result<void> read_manners(const TomlReader& reader, Bus* bus) {
  if (reader.has("moves")) {
    const auto moves = read_word(reader, "moves", {"stream", "table"});
    if (!moves) return fail(moves.error());
    bus->table_runs = *moves == 1;
  }
  bus->streams = bus->table_runs ? Streams::kRefuse : Streams::kFit;
  if (reader.has("streams")) {
    const auto streams = read_word(reader, "streams", {"fit", "refuse", "queue"});
    if (!streams) return fail(streams.error());
    bus->streams = static_cast<Streams>(*streams);
  }
  if (reader.has("frames")) {
    const auto frames = read_word(reader, "frames", {"auto", "ticks"});
    if (!frames) return fail(frames.error());
    bus->table_ticks = *frames == 0;
  }
  if (reader.has("emergency_stop")) {
    const auto mode = read_word(reader, "emergency_stop", {"ramp", "immediate", "disable"});
    if (!mode) return fail(mode.error());
    static_assert(BUSHD_STOP_RAMP == 0 && BUSHD_STOP_IMMEDIATE == 1 && BUSHD_STOP_DISABLE == 2);
    bus->emergency_stop = static_cast<bushd_stop_mode>(*mode);
    if (bus->emergency_stop == BUSHD_STOP_DISABLE && bus->kind != BusKind::kRs485) {
      return fail(reader.error("emergency_stop",
                               "is \"disable\", but nothing on a bus of this kind can disable "
                               "drivers; allowed: \"ramp\" or \"immediate\". Use \"immediate\", "
                               "and cut the power of the motors by a relay"));
    }
  }
  return {};
}

}  // namespace bushd::config
