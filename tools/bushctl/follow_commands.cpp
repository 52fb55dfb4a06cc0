// bushctl follow: a trajectory out of a file, told in parts and run.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <random>

#include "base/csv/number_csv.h"
#include "base/printable.h"
#include "commands.h"
#include "render.h"
#include "tables/text_file.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;
using Part = api::Follow::Part;

// A message holds 60 KB.
constexpr std::size_t kNumbersPerPart = 6000;

bushd::Result<bushd::csv::NumberTable> read_rows(const std::string& path) {
  const auto text = bushd::tables::read_text(path, bushd::tables::kNumbersLimit);
  if (!text) return bushd::fail(text.error());
  auto rows = bushd::csv::parse_numbers(*text, path, api::Follow::kMostRows);
  if (!rows) return rows;
  if (rows->columns.front().name != "time_s" || rows->columns.size() < 2) {
    return bushd::fail(fmt::format(
        "{}: its first line should be time_s and then the names of motors, as in: time_s, theta, "
        "phi",
        path));
  }
  return rows;
}

bushd::Result<double> parse_stretch(const std::string& word) {
  if (word.empty()) return 1.0;
  double factor = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), factor);
  if (error == std::errc() && end == word.data() + word.size() && factor > 0) return factor;
  return bushd::fail(fmt::format("--stretch: \"{}\" is not a number above 0", word));
}

api::Follow part_of(const bushd::csv::NumberTable& rows, std::size_t from, std::size_t until) {
  api::Follow part;
  for (std::size_t row = from; row < until; ++row) {
    part.time_s.push_back(rows.columns.front().numbers[row]);
    for (std::size_t m = 1; m < rows.columns.size(); ++m) {
      part.positions.push_back(rows.columns[m].numbers[row]);
    }
  }
  part.part = until == rows.rows() ? Part::kLastRows : Part::kRows;
  return part;
}

// "row 12 ..." of a reason is a line of the file.
void say_line(const bushd::csv::NumberTable& rows, const std::string& reason) {
  std::size_t row = 0;
  if (!reason.starts_with("row ")) return;
  const char* begin = reason.data() + 4;
  if (std::from_chars(begin, reason.data() + reason.size(), row).ec != std::errc()) return;
  if (row == 0 || row > rows.rows()) return;
  fmt::print(stderr, "bushctl: that row is line {} of {}\n", rows.lines[row - 1],
             bushd::printable(rows.file));
}

struct FollowOptions {
  std::string file;
  std::string interpolation = "linear";
  std::string stretch;
  bool wait = false;
  bool dry_run = false;
  bool json = false;
};

int follow(Client& client, const FollowOptions& options, const bushd::csv::NumberTable& rows,
           api::Follow common) {
  const auto send_part = [&](api::Follow part) {
    part.array = common.array;
    part.motors = common.motors;
    part.cubic = common.cubic;
    part.stretch = common.stretch;
    return client.run(part, Client::Until::kResult);
  };
  const std::size_t per_part = std::max<std::size_t>(kNumbersPerPart / rows.columns.size(), 1);
  for (std::size_t from = 0; from < rows.rows(); from += per_part) {
    const std::size_t until = std::min(from + per_part, rows.rows());
    const auto reply = send_part(part_of(rows, from, until));
    if (!reply) return failure(client, reply.error());
    const auto* completed = std::get_if<api::Completed>(&*reply);
    if (completed == nullptr || completed->outcome != api::Outcome::kDone) {
      const auto* refusal = std::get_if<api::Refused>(&*reply);
      const int code = refused(*reply);
      say_line(rows, completed != nullptr ? completed->reason
                     : refusal != nullptr ? refusal->reason
                                          : "");
      return code;
    }
    const auto* plan = std::get_if<api::MovePlan>(&completed->detail);
    if (plan != nullptr && options.dry_run) print(*plan, options.json);
  }
  if (options.dry_run) return kDone;
  common.part = Part::kRun;
  return send(client, common, options.wait ? Client::Until::kResult : Client::Until::kAnswered,
              Hope::kReached);
}

}  // namespace

void add_follow_command(CommandLine& commands) {
  const auto options = std::make_shared<FollowOptions>();
  commands.add("follow", "Let motors follow a file of times and positions")
      .footer(
          "FILE has a line 'time_s, NAME, ...' and rows of numbers: seconds, and positions in the "
          "motors' units. All motors are on one bus, and stand at the first row. All of it is "
          "checked before anything moves: what cannot be followed is named, with the stretch of "
          "time by which it can be. With --wait the exit code is 0 only if every motor came to the "
          "last row. A stop of one motor stops all; a pause is refused; trajectories wait for no "
          "trigger.")
      .file("FILE", &options->file, "Rows of time and positions")
      .choice("--interpolation", &options->interpolation, {"linear", "cubic"},
              "Between rows: straight, or smooth (Hermite)")
      .option("--stretch", &options->stretch, "All times are so many times as long")
      .flag("--wait", &options->wait, "Wait for the result")
      .flag("--dry-run", &options->dry_run, "Only check it, and say how long it takes")
      .flag_with("--dry-run", "--json", &options->json, "With --dry-run: print JSON")
      .run([&commands, options] {
        const auto stretch = parse_stretch(options->stretch);
        if (!stretch) return wrong_usage(stretch.error());
        const auto rows = read_rows(options->file);
        if (!rows) return wrong_usage(rows.error());
        api::Follow common{
            .motors = {}, .cubic = options->interpolation == "cubic", .stretch = *stretch};
        common.array = static_cast<std::int64_t>(std::random_device()());
        for (std::size_t m = 1; m < rows->columns.size(); ++m) {
          common.motors.push_back(rows->columns[m].name);
        }
        return with_client(commands.connection(),
                           [&](Client& client) { return follow(client, *options, *rows, common); });
      });
}

}  // namespace bushctl
