// docs/programs.md: its examples are programs, and its tables say what the parser takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <charconv>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "programs/program_places.h"
#include "source_path.h"

namespace bushd::test {
namespace {

std::string page() {
  std::ifstream file(source_path("docs/programs.md"));
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// What stands in code blocks of this language.
std::vector<std::string> blocks(const std::string& language) {
  std::vector<std::string> out;
  std::istringstream lines(page());
  bool within = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) {
      within = line == "```" + language;
      if (within) out.emplace_back();
    } else if (within) {
      out.back() += line + "\n";
    }
  }
  return out;
}

// The cells of each row of a table whose first cell is a key, by this key.
using Rows = std::map<std::string, std::vector<std::string>>;
Rows rows_under(const std::string& head) {
  Rows rows;
  std::istringstream lines(page());
  bool within = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == head) within = true;
    if (line.empty()) within = false;
    if (!within || !line.starts_with("| `")) continue;
    std::vector<std::string> cells;
    std::istringstream row(line.substr(1));
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
    const std::size_t end = cells[0].find('`', 2);
    rows[cells[0].substr(2, end - 2)] = {cells.begin() + 1, cells.end()};
  }
  return rows;
}
const std::string kHeadRow = "| key | value | allowed |";
const std::string kFrameRow = "| key | value | allowed | and beside it |";
const std::string kBesideRow = "| key beside it | value | allowed |";

std::string why_not(const std::string& text) {
  const auto program = programs::parse(text, "page.toml", [](const std::string& file) {
    const bool envelope = file.ends_with(".envelope");
    return Result<std::string>(envelope ? "table = \"feed\"\nzones = [[0, 5]]\nend = 9\n"
                                        : blocks("csv").front());
  });
  return program ? std::string() : program.error().text();
}

std::string frame(const std::string& keys) {
  const bool one_motor = keys.starts_with("envelope");
  return std::string("motors = [\"theta\"") + (one_motor ? "" : ", \"phi\"") + "]\n[[frame]]\n" +
         keys + "\n";
}

// Both numbers of a text such as "0.000001 to 3600 s; as many ...".
std::pair<std::string, std::string> range_of(const std::string& allowed) {
  std::smatch found;
  EXPECT_TRUE(std::regex_search(allowed, found, std::regex(R"(([0-9.]+) to ([0-9.]+))")))
      << allowed;
  return {found[1], found[2]};
}

TEST(ProgramsPage, ItsExamplesArePrograms) {
  const auto examples = blocks("toml");
  ASSERT_EQ(examples.size(), 6u);
  for (const std::string& example : examples) EXPECT_EQ(why_not(example), "");
}

TEST(ProgramsPage, TheKeysBesideAnotherAreTakenWithItAlone) {
  const std::map<std::string, std::string> written{{"move_to", "[1, 2]"},
                                                   {"move_by", "{ phi = 1 }"},
                                                   {"line_to", "[[1, 2]]"},
                                                   {"line_by", "\"p.csv\""},
                                                   {"wait_s", "1"},
                                                   {"wait_input", "\"trigger\""},
                                                   {"travel_by", "{ phi = 60 }"},
                                                   {"envelope", "\"in.envelope\""},
                                                   {"pulse_us", "5"},
                                                   {"repeat", "2"},
                                                   {"next", "true"}};
  const std::map<std::string, std::string> beside{
      {"speed", "2.5"},    {"law", "\"elementary\""}, {"feed", "2\nlaw = \"elementary\""},
      {"active", "false"}, {"longest_s", "9"},        {"after_edge_s", "0.1"},
      {"return_s", "0.1"}, {"until_input", "3"},      {"after", "2\nuntil_input = 3"}};
  const Rows told = rows_under(kBesideRow);
  for (const auto& [key, value] : beside) EXPECT_EQ(told.count(key), 1u) << key;
  EXPECT_EQ(told.size(), beside.size());
  const Rows rows = rows_under(kFrameRow);
  ASSERT_EQ(rows.size(), written.size());
  for (const auto& [key, cells] : rows) {
    std::string one = key + " = " + written.at(key);
    // What opens needs its end, and the other way round.
    const std::string before = key == "next" ? "repeat = 2\n[[frame]]\n" : "";
    const std::string behind = key == "repeat" ? "\n[[frame]]\nnext = true" : "";
    EXPECT_EQ(why_not(frame(before + one + behind)), "") << key;
    for (const auto& [other, value] : beside) {
      const bool allowed = cells.at(2).find("`" + other + "`") != std::string::npos;
      // Beside a move it says the level of the input that ends that.
      const std::string end = key == "move_by" && other == "active" ? "\nuntil_input = 3" : "";
      const std::string why =
          why_not(frame(before + one + "\n" + other + " = " + value + end + behind));
      EXPECT_EQ(why.empty(), allowed) << key << " with " << other << ": " << why;
    }
  }
}

TEST(ProgramsPage, ItsRangesAreThoseOfTheParser) {
  const Rows frames = rows_under(kFrameRow);
  const Rows beside = rows_under(kBesideRow);
  const auto holds = [](const std::string& allowed, const std::string& key,
                        const std::string& behind, const std::string& above) {
    const auto [least, most] = range_of(allowed);
    EXPECT_EQ(why_not(frame(key + " = " + least + behind)), "") << key;
    EXPECT_EQ(why_not(frame(key + " = " + most + behind)), "") << key;
    EXPECT_NE(why_not(frame(key + " = " + above + behind)), "") << key;
    EXPECT_NE(why_not(frame(key + " = -1" + behind)), "") << key;
  };
  holds(frames.at("wait_s").at(1), "wait_s", "", "3600.000001");
  EXPECT_NE(why_not(frame("wait_s = 0.0000004")), "");
  holds(beside.at("longest_s").at(1), "wait_input = 1\nlongest_s", "", "3600.000001");
  for (const char* key : {"after_edge_s", "return_s"}) {
    holds(beside.at(key).at(1), std::string("travel_by = { phi = 1 }\n") + key, "", "1.651");
  }
  holds(frames.at("pulse_us").at(1), "pulse_us", "", "1000001");
  EXPECT_NE(why_not(frame("pulse_us = 0")), "");
  holds(frames.at("repeat").at(1), "repeat", "\n[[frame]]\nnext = true", "65536");
  holds(frames.at("wait_input").at(1), "wait_input", "", "16");
  const std::regex word("\"[a-z]+\"");
  const std::string& inputs = frames.at("wait_input").at(1);
  int words = 0;
  for (std::sregex_iterator found(inputs.begin(), inputs.end(), word), end; found != end; ++found) {
    EXPECT_EQ(why_not(frame("wait_input = " + found->str())), "") << found->str();
    ++words;
  }
  EXPECT_EQ(words, 4);
}

// What a list such as "a, b, c" in the text behind `from` names.
std::set<std::string> named(const std::string& text, const std::string& from) {
  std::set<std::string> names;
  const std::string list = text.substr(text.find(from) + from.size());
  const std::regex word("[a-z_]+");
  for (std::sregex_iterator found(list.begin(), list.end(), word), end; found != end; ++found) {
    names.insert(found->str());
  }
  return names;
}

std::set<std::string> keys_of(const Rows& rows) {
  std::set<std::string> keys;
  for (const auto& [key, cells] : rows) keys.insert(key);
  return keys;
}

TEST(ProgramsPage, ItHasEveryKey) {
  EXPECT_EQ(keys_of(rows_under(kFrameRow)), named(why_not(frame("speed = 1")), "one of "));
  EXPECT_EQ(keys_of(rows_under(kHeadRow)), named(why_not("zzz = 1"), "allowed here: "));
}

std::string nested(int depth) {
  std::string text = "motors = [\"theta\"]\n";
  for (int i = 0; i < depth; ++i) text += "[[frame]]\nrepeat = 2\n";
  for (int i = 0; i < depth; ++i) text += "[[frame]]\nnext = true\n";
  return text;
}

TEST(ProgramsPage, FourRepeatsStandWithinEachOther) {
  EXPECT_THAT(page(), testing::HasSubstr("At most four `repeat` stand within each other."));
  EXPECT_EQ(why_not(nested(4)), "");
  EXPECT_NE(why_not(nested(5)), "");
}

class ProgramsPageMemory : public ProgramPlaces {
 protected:
  // Whether a program of one or two motors fits, with so many moves, or a line of so many points.
  bool fits(int motors, std::size_t memory, int moves, int points) {
    const std::string numbers = motors == 1 ? "[1]" : "[1, 1]";
    std::string text = motors == 1 ? "motors = [\"x\"]\n" : "motors = [\"x\", \"theta\"]\n";
    for (int i = 0; i < moves; ++i) text += "[[frame]]\nmove_by = " + numbers + "\n";
    if (points > 0) text += "[[frame]]\nline_by = [" + numbers;
    for (int i = 1; i < points; ++i) text += "," + numbers;
    if (points > 0) text += "]\n";
    const auto program = parse(text);
    EXPECT_TRUE(program) << program.error().text();
    mcu_.memory = memory;
    const std::span some(motors_.data(), static_cast<std::size_t>(motors));
    return programs::compile(*program, mcu_, some).has_value();
  }
};

TEST_F(ProgramsPageMemory, HasRoomForAsMuchAsThePageSays) {
  std::istringstream lines(page());
  int rows = 0;
  const std::regex numbers(R"(\| (\d+) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|)");
  for (std::string line; std::getline(lines, line);) {
    std::smatch cells;
    if (!std::regex_match(line, cells, numbers)) continue;
    ++rows;
    const int motors = std::stoi(cells[1]);
    for (int i = 0; i < 2; ++i) {
      const int memory = 4096 << i;
      const int moves = std::stoi(cells[2 + i]);
      const int points = std::stoi(cells[4 + i]);
      // By the bytes that the page tells of each.
      const int rest = memory - 5 - 9 * motors;
      EXPECT_EQ(moves, rest / (3 + 6 * motors)) << line;
      EXPECT_EQ(points, (rest - 8) / (4 * motors)) << line;
      if (motors > 2) continue;
      const auto bytes = static_cast<std::size_t>(memory);
      EXPECT_TRUE(fits(motors, bytes, moves, 0)) << line;
      EXPECT_FALSE(fits(motors, bytes, moves + 1, 0)) << line;
      EXPECT_TRUE(fits(motors, bytes, 0, points)) << line;
      EXPECT_FALSE(fits(motors, bytes, 0, points + 1)) << line;
    }
  }
  EXPECT_EQ(rows, 3);
}

}  // namespace
}  // namespace bushd::test
