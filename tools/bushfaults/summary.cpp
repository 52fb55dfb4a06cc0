#include "summary.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <numeric>

namespace bushfaults {
namespace {

double hours(const World& world) {
  return static_cast<double>(world.now_ns()) / 3.6e12;
}

std::uint64_t total(const Counts& faults) {
  return std::accumulate(faults.begin(), faults.end(), std::uint64_t{0});
}

}  // namespace

std::string summary_text(const World& world, double real_s) {
  std::string text = fmt::format("simulated  {:.3f} h, {:.0f} times real time\n", hours(world),
                                 hours(world) * 3600 / real_s);
  text += fmt::format("faults     {}\n", total(world.faults()));
  for (std::size_t i = 0; i < kFaultKinds; ++i) {
    const auto kind = static_cast<FaultKind>(i);
    text += fmt::format("           {:<17}{:>9}  {}\n", info(kind).name, world.faults()[i],
                        info(kind).what);
  }
  text += "moves      by result\n";
  for (const auto& [result, count] : world.witness().moves_by_result()) {
    text += fmt::format("           {:<17}{:>9}\n", result, count);
  }
  text += fmt::format("steps      {} commanded, {} made, {} unaccounted\n",
                      world.witness().steps_commanded(), world.plant().steps_made(),
                      world.witness().steps_unaccounted());
  text += fmt::format("violations {}\n", world.witness().violation() ? 1 : 0);
  return text;
}

std::string summary_json(const World& world) {
  nlohmann::json faults = nlohmann::json::object();
  for (std::size_t i = 0; i < kFaultKinds; ++i) {
    faults[std::string(info(static_cast<FaultKind>(i)).name)] = world.faults()[i];
  }
  const nlohmann::json all = {{"sim_hours", hours(world)},
                              {"faults", faults},
                              {"faults_total", total(world.faults())},
                              {"moves", world.witness().moves_by_result()},
                              {"steps_commanded", world.witness().steps_commanded()},
                              {"steps_made", world.plant().steps_made()},
                              {"steps_unaccounted", world.witness().steps_unaccounted()},
                              {"violations", world.witness().violation() ? 1 : 0}};
  return all.dump() + "\n";
}

std::string story(const World& world, const Options& options) {
  const Violation& violation = *world.witness().violation();
  return fmt::format(
      "VIOLATION at {} s of virtual time: {}\nWhat led to it:\n{}"
      "Again: bushfaults --seed {} --hours {} --motors {} --mcus {} --format {} and the same "
      "rates\n",
      in_seconds(violation.time_ns), violation.what, world.recent().text(), options.seed,
      options.hours, options.motors, options.mcus,
      options.format == BUSHD_FORMAT_FINE ? "fine" : "coarse");
}

}  // namespace bushfaults
