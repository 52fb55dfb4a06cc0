#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <cstdlib>

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

template <class Displacement>
bool print_ticks(bushd_run run, std::uint32_t tick_ns, ExpandFunction<Displacement> expand_block) {
  std::array<Displacement, kBlockTicks> block;
  std::uint64_t tick = 0;
  fmt::memory_buffer text;
  fmt::format_to(fmt::appender(text), "tick,displacement\n");
  bool written = true;
  do {
    const std::size_t active = expand_block(&run, tick_ns, kBlockTicks, block.data(), 1);
    for (std::size_t i = 0; i < active; ++i) {
      fmt::format_to(fmt::appender(text), "{},{}\n", tick++, static_cast<int>(block[i]));
    }
    written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
    text.clear();
  } while (written && !bushd_run_done(&run));
  return written && std::fflush(stdout) == 0;
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
  bushd_run run;
  bushd_run_start(&run, view, static_cast<std::uint32_t>(std::llabs(expansion.steps)),
                  expansion.steps < 0 ? -1 : 1);
  const bool written = expansion.format == BUSHD_FORMAT_COARSE
                           ? print_ticks<std::uint8_t>(run, tick_ns, bushd_run_expand_coarse)
                           : print_ticks<std::int16_t>(run, tick_ns, bushd_run_expand_fine);
  if (written) return kDone;
  return refuse(bushd::Error{.message = "cannot write to standard output: is the disk full?"});
}

}  // namespace bushtab
