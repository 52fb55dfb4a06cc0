// Bytes on the line for each step of a move, by the way it is sent: frames as they go out, with the
// delimiter that takes the line, the engine's own encoders and the shipped table bushd2-constant at
// ticks of 2.56 ms. Fails if a way costs more than its goal.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "engine/frame.h"
#include "engine/message.h"
#include "engine/run.h"
#include "engine/run_state.h"
#include "tables/table_file.h"

namespace {

constexpr std::uint32_t kTickNs = 2'560'000;
// A streamed queue is about 300 ms deep, and an MCU's 256 ticks: longer frames could not be queued
// well before their time.
constexpr std::uint16_t kTableTicksFrame = 190;

struct Sent {
  std::size_t frames = 0;
  std::size_t bytes = 0;
  std::size_t ticks = 0;
};

void send(Sent* sent, std::uint8_t type, const std::uint8_t* payload, std::size_t size) {
  std::uint8_t wire[BUSHD_FRAME_MAX_WIRE];
  ++sent->frames;
  sent->bytes += 1 + bushd_frame_encode(1, type, 0, payload, size, wire);
}

Sent as_table_run(const bushd_table&, std::uint32_t steps) {
  Sent sent;
  std::uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
  const bushd_table_run_entry entry{0, 0, 1, steps};
  send(&sent, BUSHD_MSG_TABLE_RUN, payload, bushd_encode_table_run(0, 1000, &entry, 1, payload));
  return sent;
}

Sent as_table_ticks(const bushd_table& table, std::uint32_t steps) {
  Sent sent;
  bushd_run run;
  bushd_run_start(&run, &table, steps, 1);
  while (!bushd_run_done(&run)) {
    const bushd_table_ticks_entry entry{0, bushd_run_save(&run, kTickNs, kTableTicksFrame)};
    std::uint8_t out[kTableTicksFrame];
    const auto ticks = static_cast<std::uint16_t>(
        bushd_run_expand_coarse(&run, kTickNs, kTableTicksFrame, out, 1));
    std::uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
    const std::uint8_t flags = sent.ticks == 0 ? BUSHD_TICKS_START : 0;
    send(&sent, BUSHD_MSG_TABLE_TICKS, payload,
         bushd_encode_table_ticks(0, flags, static_cast<std::uint32_t>(1000 + sent.ticks), ticks,
                                  &entry, 1, payload));
    sent.ticks += ticks;
  }
  return sent;
}

Sent as_ticks(const bushd_table& table, std::uint32_t steps, bool fine) {
  Sent sent;
  bushd_run run;
  bushd_run_start(&run, &table, steps, 1);
  const std::uint8_t most = bushd_ticks_capacity(1, fine);
  while (!bushd_run_done(&run)) {
    std::vector<std::uint8_t> coarse(most);
    std::vector<std::int16_t> exact(most);
    const auto ticks = static_cast<std::uint8_t>(
        fine ? bushd_run_expand_fine(&run, kTickNs, most, exact.data(), 1)
             : bushd_run_expand_coarse(&run, kTickNs, most, coarse.data(), 1));
    const std::uint16_t delay = bushd_run_delay(&run);
    const std::uint8_t flags = static_cast<std::uint8_t>((fine ? BUSHD_TICKS_FINE : 0) |
                                                         (sent.ticks == 0 ? BUSHD_TICKS_START : 0));
    std::uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
    std::size_t size = bushd_encode_ticks_head(
        0, flags, static_cast<std::uint32_t>(1000 + sent.ticks), ticks, 1, &delay, payload);
    for (std::uint8_t n = 0; n < ticks; ++n) {
      if (fine) bushd_put_i16(payload + size, exact[n]);
      if (!fine) payload[size] = coarse[n];
      size += fine ? 2 : 1;
    }
    send(&sent, BUSHD_MSG_TICKS, payload, size);
    sent.ticks += ticks;
  }
  return sent;
}

// Returns whether the goal is kept; 0: none.
bool row(const char* way, std::uint32_t steps, const Sent& sent, double goal) {
  const double cost = static_cast<double>(sent.bytes) / steps;
  std::printf("%-12s %8u %8zu %8zu %8zu %12.4f", way, static_cast<unsigned>(steps), sent.ticks,
              sent.frames, sent.bytes, cost);
  if (goal == 0) {
    std::printf("\n");
    return true;
  }
  std::printf(" %8.2f%s\n", goal, cost <= goal ? "" : "  MISSED");
  return cost <= goal;
}

}  // namespace

int main() {
  const auto loaded = bushd::tables::load(BUSHD_SOURCE_DIR "/tables/bushd2-constant.toml");
  if (!loaded) {
    std::fprintf(stderr, "bushd_bench_bytes: %s\n", loaded.error().message.c_str());
    return 1;
  }
  const bushd_table& table = (*loaded)->view();
  std::printf("%-12s %8s %8s %8s %8s %12s %8s\n", "way", "steps", "ticks", "frames", "bytes",
              "bytes/step", "goal");
  bool kept = row("TABLE_RUN", 200, as_table_run(table, 200), 0.2);
  kept = row("TABLE_TICKS", 200, as_table_ticks(table, 200), 0.25) && kept;
  kept = row("TICKS coarse", 200, as_ticks(table, 200, false), 0) && kept;
  kept = row("TICKS fine", 200, as_ticks(table, 200, true), 0) && kept;
  kept = row("TABLE_RUN", 20000, as_table_run(table, 20000), 0) && kept;
  kept = row("TABLE_TICKS", 20000, as_table_ticks(table, 20000), 0.03) && kept;
  kept = row("TICKS coarse", 20000, as_ticks(table, 20000, false), 0) && kept;
  kept = row("TICKS fine", 20000, as_ticks(table, 20000, true), 0) && kept;
  return kept ? 0 : 1;
}
