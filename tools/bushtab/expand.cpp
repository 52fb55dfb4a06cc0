#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <cstdlib>

#include "base/units/coordinates.h"
#include "commands.h"
#include "engine/run.h"
#include "open_table.h"

namespace bushtab {
namespace {

// A move may take hours of ticks: they go out in blocks.
constexpr std::size_t kBlockTicks = 4096;

template <class Displacement>
using ExpandFunction = std::size_t (*)(bushd_run*, std::uint32_t, std::size_t, Displacement*,
                                       std::size_t);

bool flush(fmt::memory_buffer& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  text.clear();
  return written;
}

template <class Displacement>
bool print_ticks(bushd_run run, const Expansion& wanted,
                 ExpandFunction<Displacement> expand_block) {
  std::array<Displacement, kBlockTicks> block;
  std::uint64_t tick = 0;
  fmt::memory_buffer text;
  const auto out = fmt::appender(text);
  if (wanted.json) {
    fmt::format_to(out, "{{\"tick_us\": {}, \"format\": \"{}\", \"displacements\": [",
                   wanted.tick_us, wanted.format == BUSHD_FORMAT_COARSE ? "coarse" : "fine");
  } else {
    fmt::format_to(out, "tick,displacement\n");
  }
  bool written = true;
  do {
    const std::size_t active =
        expand_block(&run, wanted.tick_us * 1000, kBlockTicks, block.data(), 1);
    for (std::size_t i = 0; i < active; ++i, ++tick) {
      const int displacement = block[i];
      if (wanted.json) {
        fmt::format_to(out, "{}{}", tick == 0 ? "" : ", ", displacement);
      } else {
        fmt::format_to(out, "{},{}\n", tick, displacement);
      }
    }
    written = flush(text);
  } while (written && !bushd_run_done(&run));
  if (wanted.json) fmt::format_to(out, "]}}\n");
  return written && flush(text) && std::fflush(stdout) == 0;
}

}  // namespace

int expand(const Places& places, const Expansion& expansion) {
  const auto table = open_table(places, expansion.table);
  if (!table) return refuse(table.error());
  const bushd_table* view = &(*table)->view();
  const std::uint32_t tick_ns = expansion.tick_us * 1000;
  const std::uint32_t steps_per_tick = bushd_table_max_steps_per_tick(view, tick_ns);
  if (steps_per_tick > BUSHD_MAX_STEPS_PER_TICK) {
    return refuse(bushd::Error{
        .message = fmt::format(
            "makes up to {} steps in a tick of {} us; allowed: {}. Use a shorter tick or a "
            "slower table",
            steps_per_tick, expansion.tick_us, BUSHD_MAX_STEPS_PER_TICK),
        .file = (*table)->path()});
  }
  bushd_delay shortest_delay = 0;
  if (expansion.speed) {
    const auto delay = bushd::units::Coordinates().delay_at(*expansion.speed, view->time_unit_ns);
    if (!delay) return refuse(delay.error());
    shortest_delay = *delay;
  }
  bushd_run run;
  bushd_run_start(&run, view, static_cast<std::uint32_t>(std::llabs(expansion.steps)),
                  expansion.steps < 0 ? -1 : 1, shortest_delay);
  const bool written = expansion.format == BUSHD_FORMAT_COARSE
                           ? print_ticks<std::uint8_t>(run, expansion, bushd_run_expand_coarse)
                           : print_ticks<std::int16_t>(run, expansion, bushd_run_expand_fine);
  if (written) return kDone;
  return kRefused;  // main says why
}

}  // namespace bushtab
