#include "summary.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <numeric>

#include "bare_world.h"
#include "base/json_text.h"
#include "made_config.h"

namespace bushfaults {
namespace {

double hours(const World& world) {
  return static_cast<double>(world.now_ns()) / 3.6e12;
}

template <std::size_t kSize>
std::uint64_t total(const std::array<std::uint64_t, kSize>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

template <class Kind, std::size_t kSize>
std::string text_of(const std::array<std::uint64_t, kSize>& counts) {
  std::string text;
  for (std::size_t i = 0; i < kSize; ++i) {
    const KindInfo& kind = info(static_cast<Kind>(i));
    text += fmt::format("           {:<17}{:>9}  {}\n", kind.name, counts[i], kind.what);
  }
  return text;
}

template <class Kind, std::size_t kSize>
nlohmann::json json_of(const std::array<std::uint64_t, kSize>& counts) {
  nlohmann::json all = nlohmann::json::object();
  for (std::size_t i = 0; i < kSize; ++i) {
    all[std::string(info(static_cast<Kind>(i)).name)] = counts[i];
  }
  return all;
}

std::string bare_summary(const World& world) {
  if (world.bare() == nullptr) return {};
  const BareWorld& bare = *world.bare();
  std::string text = "without firmware\n";
  for (const auto& [what, count] : bare.faults()) {
    text += fmt::format("           {:<24}{:>9}\n", what, count);
  }
  for (const auto& [result, count] : bare.judge().results()) {
    text += fmt::format("           motions {:<16}{:>9}\n", result, count);
  }
  return text + fmt::format("           {} keys, {} steps in {} runs, {} states checked\n",
                            bare.keys(), bare.judge().steps(), bare.judge().runs(),
                            bare.judge().states_checked());
}

}  // namespace

std::string summary_text(const World& world, double processor_s) {
  std::string text = fmt::format("simulated  {:.3f} h, {:.0f} times real time on one core\n",
                                 hours(world), hours(world) * 3600 / processor_s);
  text += fmt::format("bus        {}\n", ways_text(world.config()));
  text += fmt::format("faults     {}\n", total(world.faults()));
  text += text_of<FaultKind>(world.faults());
  text += fmt::format("commands   {}\n", total(world.commands()));
  text += text_of<CommandKind>(world.commands());
  const Promise& promise = world.witness().promise();
  text += fmt::format("requests   {} carried out, {} answered again or refused by their session\n",
                      promise.carried_out(), promise.not_carried_out());
  const SecondDaemon::Counts& second = world.second_daemons();
  text += fmt::format(
      "second     daemons: {} found the first on their network, {} ran; {} of their moves "
      "accepted, {} refused\n",
      second.found_other, second.ran, second.moves_accepted, second.moves_refused);
  text += "moves      by result\n";
  for (const auto& [result, count] : world.witness().moves_by_result()) {
    text += fmt::format("           {:<17}{:>9}\n", result, count);
  }
  if (!world.witness().homings_by_result().empty()) text += "homings    by result\n";
  for (const auto& [result, count] : world.witness().homings_by_result()) {
    text += fmt::format("           {:<17}{:>9}\n", result, count);
  }
  if (!world.witness().jogs_by_result().empty()) text += "jogs       by result\n";
  for (const auto& [result, count] : world.witness().jogs_by_result()) {
    text += fmt::format("           {:<17}{:>9}\n", result, count);
  }
  if (!world.witness().programs_by_result().empty()) {
    text += fmt::format("programs   of MCUs by result; {} were judged by where they lead\n",
                        world.witness().programs_judged());
  }
  for (const auto& [result, count] : world.witness().programs_by_result()) {
    text += fmt::format("           {:<17}{:>9}\n", result, count);
  }
  text += fmt::format("legs       {} last approaches, {} rests in pauses\n",
                      world.witness().approaches(), world.witness().times_paused());
  if (!world.config().crates.empty()) {
    const Crates& crates = world.witness().crates();
    text += fmt::format("crate      {} starts, {} ended by a LAM, {} of these after all steps\n",
                        crates.starts(), crates.ended_by_lam(), crates.ended_all_steps());
  }
  if (!world.mornings().empty()) text += "mornings   motors by trust\n";
  for (const auto& [trust, count] : world.mornings()) {
    text += fmt::format("           {:<17}{:>9}\n", trust, count);
  }
  text += fmt::format("steps      {} commanded, {} made, {} unaccounted\n",
                      world.witness().steps_commanded(), world.plant().steps_made(),
                      world.witness().steps_unaccounted());
  if (world.witness().ways() > 0) {
    const Witness& witness = world.witness();
    text += fmt::format(
        "ways       {} lines and paths reached, {:.1f} steps off them at most; {} of them changed "
        "at different ticks, {} apart at most\n",
        witness.ways(), witness.worst_off_way(), witness.ways_apart(), witness.most_ticks_apart());
  }
  text += fmt::format("skew       {:.1f} us between MCUs in step, at most\n",
                      static_cast<double>(world.skew().worst_ns()) / 1000);
  text += fmt::format("age        {:.0f} ms of the report behind a state, at most\n",
                      static_cast<double>(world.witness().positions().worst_age_ns()) / 1e6);
  text += bare_summary(world);
  text += fmt::format("violations {}\n", world.witness().violation() ? 1 : 0);
  return text;
}

std::string summary_json(const World& world) {
  const nlohmann::json all = {
      {"sim_hours", hours(world)},
      {"bus", ways_text(world.config())},
      {"faults", json_of<FaultKind>(world.faults())},
      {"faults_total", total(world.faults())},
      {"commands", json_of<CommandKind>(world.commands())},
      {"carried_out", world.witness().promise().carried_out()},
      {"not_carried_out", world.witness().promise().not_carried_out()},
      {"moves", world.witness().moves_by_result()},
      {"homings", world.witness().homings_by_result()},
      {"jogs", world.witness().jogs_by_result()},
      {"programs", world.witness().programs_by_result()},
      {"programs_judged", world.witness().programs_judged()},
      {"approaches", world.witness().approaches()},
      {"camac_starts", world.witness().crates().starts()},
      {"camac_lams", world.witness().crates().ended_by_lam()},
      {"shutter_starts", world.witness().shutter().starts()},
      {"shutter_steps", world.witness().shutter().steps_done()},
      {"shutter_travels", world.witness().shutter().travels()},
      {"shutter_openings", world.witness().shutter().openings()},
      {"times_paused", world.witness().times_paused()},
      {"second_daemons_refused", world.second_daemons().found_other},
      {"second_daemons_ran", world.second_daemons().ran},
      {"second_daemons_moves", world.second_daemons().moves_accepted},
      {"mornings", world.mornings()},
      {"steps_commanded", world.witness().steps_commanded()},
      {"steps_made", world.plant().steps_made()},
      {"steps_unaccounted", world.witness().steps_unaccounted()},
      {"skew_us", static_cast<double>(world.skew().worst_ns()) / 1000},
      {"report_age_ms", static_cast<double>(world.witness().positions().worst_age_ns()) / 1e6},
      {"violations", world.witness().violation() ? 1 : 0}};
  return bushd::json_text(all) + "\n";
}

std::string story(const World& world, const Options& options) {
  const Violation& violation = *world.witness().violation();
  return fmt::format(
      "VIOLATION at {} s of virtual time: {}\nWhat led to it:\n{}"
      "Again: bushfaults --seed {} --hours {} --motors {} --mcus {} {}{}{} and the same rates\n",
      in_seconds(violation.time_ns), violation.what, world.recent().text(), options.seed,
      options.hours, options.motors, options.mcus, options.all_kinds ? "--all-kinds " : "",
      bare_text(options.bare), ways_text(world.config()));
}

}  // namespace bushfaults
