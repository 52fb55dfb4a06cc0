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
  bool coarse = false;
  const Keys keys = Keys(reader)
                        .needed_whole("tick_us", &bus->tick_us, BUSHD_MIN_TICK_NS / 1000,
                                      BUSHD_MAX_TICK_NS / 1000, "us")
                        .needed_word("format", &coarse, {"fine", "coarse"});
  bus->format = coarse ? BUSHD_FORMAT_COARSE : BUSHD_FORMAT_FINE;
  return keys.result();
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
  const Keys kind = Keys(reader).word("kind", &bus->kind, kBusKinds);
  if (!kind.result()) return kind.result();
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
  static_assert(BUSHD_STOP_RAMP == 0 && BUSHD_STOP_IMMEDIATE == 1 && BUSHD_STOP_DISABLE == 2);
  bool ticks_alone = false;
  std::optional<Streams> streams;
  const Keys keys =
      Keys(reader)
          .word("moves", &bus->table_runs, {"stream", "table"})
          .word("streams", &streams, {"fit", "refuse", "queue"})
          .word("frames", &ticks_alone, {"auto", "ticks"})
          .word("emergency_stop", &bus->emergency_stop, {"ramp", "immediate", "disable"});
  if (!keys.result()) return keys.result();
  bus->streams = streams.value_or(bus->table_runs ? Streams::kRefuse : Streams::kFit);
  bus->table_ticks = !ticks_alone;
  if (bus->emergency_stop == BUSHD_STOP_DISABLE && bus->kind != BusKind::kRs485) {
    return fail(reader.error("emergency_stop",
                             "is \"disable\", but nothing on a bus of this kind can disable "
                             "drivers; allowed: \"ramp\" or \"immediate\". Use \"immediate\", "
                             "and cut the power of the motors by a relay"));
  }
  return {};
}

}  // namespace bushd::config
