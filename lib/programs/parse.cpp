#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/csv/number_csv.h"
#include "engine/message_motion.h"
#include "engine/program.h"
#include "programs/parse_head.h"
#include "programs/program.h"
#include "tables/speed_zones.h"
#include "tables/table.h"
#include "tables/toml_file.h"
#include "tables/toml_reader.h"

namespace bushd::programs {
namespace {

using tables::TomlReader;

constexpr std::size_t kMostPoints = 65535;
constexpr double kUsPerS = 1e6;

constexpr std::array<std::pair<std::string_view, std::uint8_t>, 4> kSystemInputs = {{
    {"emergency", 16},
    {"forward", 17},
    {"reverse", 18},
    {"trigger", 19},
}};

class FrameReader {
 public:
  FrameReader(const Program& program, TomlReader toml, const ReadPoints& points)
      : program_(program), toml_(std::move(toml)), points_(points) {}

  Result<Frame> read(const std::string& place) const {
    Frame frame{.what = Next{}, .place = place};
    const Result<void> filled = fill(frame);
    if (!filled) return fail(filled.error());
    return frame;
  }

 private:
  template <class What>
  static Result<void> put(Frame& frame, Result<What> what) {
    if (!what) return fail(what.error());
    frame.what = std::move(*what);
    return {};
  }

  Result<void> fill(Frame& frame) const {
    for (const bool relative : {false, true}) {
      const char* const move_key = relative ? "move_by" : "move_to";
      if (toml_.has(move_key)) return put(frame, move(move_key, relative));
      const char* const line_key = relative ? "line_by" : "line_to";
      if (toml_.has(line_key)) return put(frame, line(line_key, relative));
    }
    if (toml_.has("travel_by")) return put(frame, travel());
    if (toml_.has("envelope")) return put(frame, envelope());
    if (toml_.has("wait_s")) return put(frame, wait());
    if (toml_.has("wait_input")) return put(frame, wait_input());
    if (toml_.has("pulse_us")) return put(frame, pulse());
    if (toml_.has("repeat")) return put(frame, repeat());
    if (toml_.has("next")) return put(frame, next());
    return fail(toml_.error("",
                            "no frame; allowed: one of move_to, move_by, line_to, line_by, "
                            "travel_by, envelope, wait_s, wait_input, "
                            "pulse_us, repeat, next"));
  }

  Result<Move> move(const char* key, bool relative) const {
    const auto only = relative ? toml_.only({key, "speed", "until_input", "active", "after"})
                               : toml_.only({key, "speed"});
    if (!only) return fail(only.error());
    Move move{.relative = relative, .to = {}};
    auto to = toml_.table(key) != nullptr ? by_name(key) : by_order(key);
    if (!to) return fail(to.error());
    move.to = std::move(*to);
    auto given = speed();
    if (!given) return fail(given.error());
    move.speed = *given;
    auto ends = until(move);
    if (!ends) return fail(ends.error());
    move.until = *ends;
    return move;
  }

  Result<std::optional<Move::Until>> until(const Move& move) const {
    if (!toml_.has("until_input")) {
      for (const char* const key : {"active", "after"}) {
        if (toml_.has(key))
          return fail(
              toml_.error(key, "is for a move with until_input; add until_input, or remove it"));
      }
      return std::optional<Move::Until>();
    }
    if (std::ranges::count_if(move.to, [](const auto& at) { return at.has_value(); }) != 1) {
      return fail(toml_.error("until_input", "ends a move of one motor; name one in move_by"));
    }
    const auto number = input("until_input");
    if (!number) return fail(number.error());
    const auto level = active();
    if (!level) return fail(level.error());
    Move::Until until{.input = *number, .active = *level};
    if (!toml_.has("after")) return std::optional(until);
    constexpr const char* kAllowed = "a distance of 0 or more";
    const auto after = toml_.number("after", kAllowed);
    if (!after) return fail(after.error());
    if (*after < 0) {
      return fail(toml_.error("after", std::string("below 0; allowed: ") + kAllowed));
    }
    until.after = *after;
    return std::optional(until);
  }

  Result<Line> line(const char* key, bool relative) const {
    if (auto only = toml_.only({key, "speed", "law", "feed"}); !only) return fail(only.error());
    auto points = toml_.is_string(key) ? points_of_file(key) : points_of_text(key);
    if (!points) return fail(points.error());
    auto given = speed();
    if (!given) return fail(given.error());
    Line line{relative, std::move(*points), *given};
    if (toml_.has("law")) {
      const auto law = toml_.string("law", "\"leading\" or \"elementary\"");
      if (!law) return fail(law.error());
      if (*law != "leading" && *law != "elementary") {
        return fail(toml_.error("law", "\"" + *law + "\"; allowed: \"leading\", \"elementary\""));
      }
      line.elementary = *law == "elementary";
    }
    if (toml_.has("feed")) {
      const auto feed = toml_.number("feed", "a feed above 0");
      if (!feed) return fail(feed.error());
      if (*feed <= 0) return fail(toml_.error("feed", "not above 0; allowed: a feed above 0"));
      if (!line.elementary) {
        return fail(
            toml_.error("feed", "is of lines with law = \"elementary\"; allowed here: speed"));
      }
      line.feed = *feed;
    }
    return line;
  }

  Result<Line> envelope() const {
    constexpr const char* kKey = "envelope";
    if (auto only = toml_.only({kKey}); !only) return fail(only.error());
    if (program_.motors.size() != 1) {
      return fail(toml_.error(kKey, "for several motors; allowed: in programs of one motor"));
    }
    if (program_.codes) {
      return fail(toml_.error(kKey, "has delays of its own, beside `codes`; remove one of them"));
    }
    const auto name = toml_.string(kKey, "the name of a file");
    if (!name) return fail(name.error());
    const auto text = points_(*name);
    if (!text) return fail(text.error());
    auto zones = tables::parse_zones(*text, *name);
    if (!zones) return fail(zones.error());
    if (zones->by == tables::SpeedZones::By::kPosition) {
      return fail(toml_.error(kKey, "\"" + *name +
                                        "\" goes by positions; allowed: by = \"distance\", and "
                                        "move_to before it"));
    }
    return Line{.relative = true, .points = {{zones->end}}, .envelope = std::move(*zones)};
  }

  Result<std::optional<double>> speed() const {
    if (!toml_.has("speed")) return std::optional<double>();
    const auto value = toml_.number("speed", "a speed above 0");
    if (!value) return fail(value.error());
    if (*value <= 0) return fail(toml_.error("speed", "not above 0; allowed: a speed above 0"));
    return std::optional<double>(*value);
  }

  Result<Point> by_name(const char* key) const {
    Point point(program_.motors.size());
    for (const auto& [name, node] : *toml_.table(key)) {
      const auto motor = std::ranges::find(program_.motors, std::string(name.str()));
      if (motor == program_.motors.end()) {
        return fail(
            toml_.error(key, "\"" + std::string(name.str()) +
                                 "\" is not in `motors`; allowed: the motors of the program"));
      }
      const auto index = static_cast<std::size_t>(motor - program_.motors.begin());
      const auto value = toml_.number(key, index, node, "a position");
      if (!value) return fail(value.error());
      point[index] = *value;
    }
    if (std::ranges::none_of(point, [](const auto& at) { return at.has_value(); })) {
      return fail(toml_.error(key, "no motor; allowed: one or more of `motors`"));
    }
    return point;
  }

  Result<Point> numbers(const char* key, const toml::array& array) const {
    if (array.size() != program_.motors.size()) {
      return fail(toml_.error(key, std::to_string(array.size()) + " numbers; allowed: " +
                                       std::to_string(program_.motors.size()) +
                                       ", one for each of `motors`"));
    }
    Point point;
    for (std::size_t i = 0; i < array.size(); ++i) {
      const auto value = toml_.number(key, i, array[i], "a position");
      if (!value) return fail(value.error());
      point.emplace_back(*value);
    }
    return point;
  }

  Result<Point> by_order(const char* key) const {
    const auto array = toml_.array(key, "a list of numbers, or a table of motors");
    if (!array) return fail(array.error());
    return numbers(key, **array);
  }

  Result<std::vector<Point>> points_of_text(const char* key) const {
    const auto array = toml_.array(key, "a list of points, or the name of a file");
    if (!array) return fail(array.error());
    std::vector<Point> points;
    for (const toml::node& node : **array) {
      const toml::array* const point = node.as_array();
      if (point == nullptr) {
        return fail(toml_.error(key, points.size(),
                                tables::describe(node) + "; allowed: a list of numbers"));
      }
      auto read = numbers(key, *point);
      if (!read) return fail(read.error());
      points.push_back(std::move(*read));
    }
    return some(key, std::move(points));
  }

  Result<std::vector<Point>> points_of_file(const char* key) const {
    const auto name = toml_.string(key, "the name of a file");
    if (!name) return fail(name.error());
    const auto text = points_(*name);
    if (!text) return fail(text.error());
    const auto table = csv::parse_numbers(*text, *name, kMostPoints);
    if (!table) return fail(table.error());
    std::vector<Point> points(table->rows(), Point(program_.motors.size()));
    for (const csv::NumberColumn& column : table->columns) {
      const auto motor = std::ranges::find(program_.motors, column.name);
      if (motor == program_.motors.end()) {
        return fail(
            Error{.message = "column \"" + column.name + "\" is not in `motors`", .file = *name});
      }
      const auto index = static_cast<std::size_t>(motor - program_.motors.begin());
      for (std::size_t row = 0; row < points.size(); ++row)
        points[row][index] = column.numbers[row];
    }
    return some(key, std::move(points));
  }

  Result<std::vector<Point>> some(const char* key, std::vector<Point> points) const {
    if (!points.empty() && points.size() <= kMostPoints) return points;
    return fail(toml_.error(key, std::to_string(points.size()) + " points; allowed: 1 to " +
                                     std::to_string(kMostPoints)));
  }

  // Seconds as whole microseconds, 1 to `most_us`.
  Result<std::uint32_t> us_of(const char* key, std::uint32_t most_us) const {
    return us_of(
        key, 1, most_us,
        "0.000001 to " + std::to_string(most_us / static_cast<std::uint32_t>(kUsPerS)) + " s");
  }
  Result<std::uint32_t> us_of(const char* key, std::uint32_t least_us, std::uint32_t most_us,
                              const std::string& allowed) const {
    const auto seconds = toml_.number(key, allowed);
    if (!seconds) return fail(seconds.error());
    const double us = std::round(*seconds * kUsPerS);
    if (us < least_us || us > most_us) {
      return fail(toml_.error(key, "out of range; allowed: " + allowed));
    }
    return static_cast<std::uint32_t>(us);
  }

  Result<Travel> travel() const {
    if (auto only = toml_.only({"travel_by", "after_edge_s", "return_s"}); !only) {
      return fail(only.error());
    }
    auto by = toml_.table("travel_by") != nullptr ? by_name("travel_by") : by_order("travel_by");
    if (!by) return fail(by.error());
    if (std::ranges::count_if(*by, [](const auto& at) { return at.has_value(); }) != 1) {
      return fail(toml_.error("travel_by", "several motors; allowed: one, by its name"));
    }
    static_assert(BUSHD_TRAVEL_MIN_WAIT_US == BUSHD_TRIGGER_MIN_DELAY_US);
    static_assert(BUSHD_TRAVEL_MAX_WAIT_US == BUSHD_TRIGGER_MAX_DELAY_US);
    const auto time = [this](const char* key, std::uint32_t* us) -> Result<void> {
      if (!toml_.has(key)) return {};
      const auto given =
          us_of(key, BUSHD_TRAVEL_MIN_WAIT_US, BUSHD_TRAVEL_MAX_WAIT_US, "0.00005 to 1.65 s");
      if (!given) return fail(given.error());
      *us = *given;
      return {};
    };
    Travel travel{.by = std::move(*by),
                  .at_edges = toml_.has("after_edge_s"),
                  .return_us = BUSHD_TRAVEL_MIN_WAIT_US};
    if (auto read = time("after_edge_s", &travel.delay_us); !read) return fail(read.error());
    if (auto read = time("return_s", &travel.return_us); !read) return fail(read.error());
    return travel;
  }

  Result<Wait> wait() const {
    if (auto only = toml_.only({"wait_s"}); !only) return fail(only.error());
    const auto us = us_of("wait_s", BUSHD_PROGRAM_MOST_WAIT_US);
    if (!us) return fail(us.error());
    return Wait{*us};
  }

  Result<bool> active() const {
    if (!toml_.has("active")) return true;
    return toml_.boolean("active");
  }

  Result<std::uint8_t> input(const char* key) const {
    if (!toml_.is_string(key)) {
      const auto number = toml_.integer(key, 0, BUSHD_PROGRAM_SYSTEM_INPUT - 1);
      if (!number) return fail(number.error());
      return static_cast<std::uint8_t>(*number);
    }
    const auto word = toml_.string(key, "");
    if (!word) return fail(word.error());
    for (const auto& [name, number] : kSystemInputs) {
      if (name == *word) return number;
    }
    return fail(toml_.error(key, "\"" + *word +
                                     "\"; allowed: 0 to 15, \"emergency\", "
                                     "\"forward\", \"reverse\", \"trigger\""));
  }

  Result<WaitInput> wait_input() const {
    if (auto only = toml_.only({"wait_input", "active", "longest_s"}); !only) {
      return fail(only.error());
    }
    const auto number = input("wait_input");
    if (!number) return fail(number.error());
    const auto level = active();
    if (!level) return fail(level.error());
    WaitInput wait{.input = *number, .active = *level};
    if (toml_.has("longest_s")) {
      const auto us = us_of("longest_s", BUSHD_PROGRAM_MOST_WAIT_US);
      if (!us) return fail(us.error());
      wait.longest_us = *us;
    }
    return wait;
  }

  Result<Pulse> pulse() const {
    if (auto only = toml_.only({"pulse_us"}); !only) return fail(only.error());
    const auto us = toml_.integer("pulse_us", 1, BUSHD_PROGRAM_MOST_PULSE_US, "us");
    if (!us) return fail(us.error());
    return Pulse{static_cast<std::uint32_t>(*us)};
  }

  Result<Repeat> repeat() const {
    if (auto only = toml_.only({"repeat"}); !only) return fail(only.error());
    const auto count = toml_.integer("repeat", 0, UINT16_MAX);
    if (!count) return fail(count.error());
    return Repeat{static_cast<std::uint16_t>(*count)};
  }

  Result<Next> next() const {
    if (auto only = toml_.only({"next"}); !only) return fail(only.error());
    const auto is = toml_.boolean("next");
    if (!is) return fail(is.error());
    if (!*is) return fail(toml_.error("next", "false; allowed: true"));
    return Next{};
  }

  const Program& program_;
  TomlReader toml_;
  const ReadPoints& points_;
};

// Every REPEAT has its NEXT; few enough within each other.
Result<void> check_nesting(const Program& program) {
  unsigned depth = 0;
  for (const Frame& frame : program.frames) {
    if (std::holds_alternative<Repeat>(frame.what) && ++depth > BUSHD_PROGRAM_MOST_DEPTH) {
      return fail(frame.place + ": more than " + std::to_string(BUSHD_PROGRAM_MOST_DEPTH) +
                  " repeats within each other; end one by `next` before");
    }
    if (std::holds_alternative<Next>(frame.what) && depth-- == 0) {
      return fail(frame.place + ": `next` without a `repeat` before it; remove it");
    }
  }
  if (depth == 0) return {};
  return fail("a `repeat` has no `next`; add a frame with next = true where it ends");
}

// Lines and travels of a program go by one list of delays.
Result<void> take_envelope(Program& program) {
  for (const Frame& frame : program.frames) {
    const Line* const line = std::get_if<Line>(&frame.what);
    if (line != nullptr && line->envelope && !program.envelope) program.envelope = line->envelope;
  }
  if (!program.envelope) return {};
  for (const Frame& frame : program.frames) {
    const Line* const line = std::get_if<Line>(&frame.what);
    if (line != nullptr && line->envelope && *line->envelope != *program.envelope) {
      return fail(frame.place +
                  ": a second envelope; a program has one: write another program for it");
    }
    if (std::holds_alternative<Travel>(frame.what) || (line != nullptr && !line->envelope)) {
      return fail(frame.place +
                  ": a line or a travel, in a program with an envelope, by whose delays it would "
                  "go; allowed: move_to and move_by");
    }
  }
  return {};
}

}  // namespace

Result<Program> parse(std::string_view text, const std::string& file, const ReadPoints& points) {
  const auto table = tables::parse_toml(text, file);
  if (!table) return fail(table.error());
  const TomlReader toml(*table, file);
  Program program;
  if (auto head = read_head(toml, program); !head) return fail(head.error());
  const auto frames = toml.array("frame", "frames, each [[frame]]");
  if (!frames) return fail(frames.error());
  for (std::size_t i = 0; i < (*frames)->size(); ++i) {
    const toml::node& node = (**frames)[i];
    const toml::table* const one = node.as_table();
    if (one == nullptr) {
      return fail(toml.error("frame", i, tables::describe(node) + "; allowed: [[frame]]"));
    }
    const std::string place = file + ":" + std::to_string(node.source().begin.line);
    auto frame =
        FrameReader(program, TomlReader(*one, file, "frame[" + std::to_string(i) + "]"), points)
            .read(place);
    if (!frame) return fail(frame.error());
    program.frames.push_back(std::move(*frame));
  }
  if (auto nested = check_nesting(program); !nested) return fail(nested.error());
  if (auto taken = take_envelope(program); !taken) return fail(taken.error());
  if (auto fits = check_power_on(toml, program); !fits) return fail(fits.error());
  return program;
}

}  // namespace bushd::programs
