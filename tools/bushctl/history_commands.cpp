// The subcommand that shows what has moved a motor.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <variant>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "commands.h"
#include "grid.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;
using nlohmann::ordered_json;

void print_json(const std::string& motor, const api::MotionHistory& history) {
  ordered_json json = bushd::json_of(history);
  json["motor"] = motor;
  fmt::print("{}\n", bushd::json_text(json));
}

// In its unit, as it was then; of a motor without one there are steps only.
std::string position(const std::string& text, std::int64_t steps) {
  return text.empty() ? fmt::format("{} steps", steps) : bushd::printable(text);
}

void print_history(const api::MotionHistory& history) {
  using enum Align;
  Grid grid({kLeft, kLeft, kRight, kRight, kRight, kLeft, kLeft, kLeft});
  grid.row({"TIME", "WHAT", "FROM", "TO", "STEPS", "RESULT", "BY", ""});
  for (const api::PastMotion& motion : history.motions) {
    const auto seconds = static_cast<std::time_t>(motion.utime_us / 1'000'000);
    grid.row({fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::localtime(seconds)),
              bushd::printable(motion.what), position(motion.from_text, motion.from_steps),
              position(motion.to_text, motion.to_steps), fmt::to_string(motion.to_steps),
              bushd::printable(motion.outcome), bushd::printable(motion.who),
              bushd::printable(motion.reason)});
  }
  print_lines(grid.lines());
}

struct HistoryOptions {
  std::string motor;
  std::uint32_t most = 20;
  bool json = false;
};

int show_history(Client& client, const HistoryOptions& options) {
  const auto history = ask<api::MotionHistory>(
      client,
      api::GetHistory{.motor = options.motor, .most = static_cast<std::int32_t>(options.most)});
  if (!history) return history.error();
  if (options.json) {
    print_json(options.motor, *history);
  } else {
    print_history(*history);
  }
  return kDone;
}

}  // namespace

void add_history_commands(CommandLine& commands) {
  const auto options = std::make_shared<HistoryOptions>();
  commands.add("history", "Show what has moved a motor, the newest first")
      .footer(
          "Positions are in the motor's unit, as it was then; STEPS is where it stood in the end. "
          "Needs a state store ([state] in bushd.toml).")
      .option("NAME", &options->motor, "Motor")
      .number("--most", &options->most, api::GetHistory::kMost, "How many lines")
      .flag("--json", &options->json, "Print JSON")
      .run_with_client([options](Client& client) { return show_history(client, *options); });
}

}  // namespace bushctl
