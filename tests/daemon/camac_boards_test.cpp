// Programs of BUSHD-2 for motors behind a commutator board.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "daemon/camac_lab.h"

namespace bushd::test::camac_boards_test {
namespace {

// The module has the motors in this order, each at the output of its number.
std::string with_motors(const std::vector<int>& numbers) {
  std::string toml =
      "[[bus]]\nname = \"board\"\nkind = \"commutator\"\nport = \"/dev/null\"\nbaud = 115200\n"
      "start_hz = 100\n[[group]]\nname = \"axes\"\ntable = \"bushd2-constant\"\n";
  std::string names;
  for (const int number : numbers) {
    const std::string name = "\"m" + std::to_string(number) + "\"";
    toml += "[[motor]]\nname = " + name + "\nmcu = \"board\"\noutput = " + std::to_string(number) +
            "\ngroup = \"axes\"\n";
    names += (names.empty() ? "" : ", ") + name;
  }
  return toml +
         "[[crate]]\nnumber = 1\n[[crate.module]]\nstation = 5\ntype = \"bushd-2\"\n"
         "f_start_hz = 100\nmotors = [" +
         names + "]\n";
}

// The steps of all motors of a board.
class StepEdges final : public sim::EdgeSink {
 public:
  struct Step {
    int motor;
    bool right;
    bool operator==(const Step&) const = default;
  };
  void edge(const sim::Edge& edge) override {
    if (edge.signal == sim::Signal::kDir) right_[edge.index] = edge.level;
    if (edge.signal == sim::Signal::kStep && edge.level) {
      steps.push_back({edge.index, right_[edge.index]});
    }
  }
  void settled(sim::TimeNs) override {}
  std::vector<Step> steps;

 private:
  std::map<int, bool> right_;
};

// S30, S32: of the eight motors behind a board the one that the control register names makes the
// steps, in the direction that it names, and no other one makes any.
TEST(CamacBoards, EachNumberTurnsItsOwnMotor) {
  StepEdges edges;
  CamacLab lab(with_motors({0, 1, 2, 3, 4, 5, 6, 7}), &edges);
  lab.load(0, 3, {250, 200});
  // In another order than that of the outputs, so that none is turned for having been the last.
  for (const int number : {5, 0, 7, 2, 1, 6, 3, 4}) {
    for (const bool left : {false, true}) {
      SCOPED_TRACE(number);
      edges.steps.clear();
      lab.naf(5, 0, 10);
      lab.run_to_lam(static_cast<std::uint32_t>(number) | 1 << 5 | 1 << 6 | (left ? 1u << 7 : 0u));
      EXPECT_EQ(edges.steps, std::vector<StepEdges::Step>(3, {number, !left}));
    }
  }
}

// Program, BUSHD-2, commutator, windings: what the report of 1985 describes.
TEST(CamacBoards, ProgramOfABushd2MovesAMotorBehindABoard) {
  CamacLab lab(with_motors({0, 5}));
  // Not those of the table in service: 250, 249, 248, ... and none below 20.
  std::vector<int> codes;
  for (int i = 0; i < 238; ++i) codes.push_back(std::max(250 - i, 20));
  lab.load(0, 300, codes);
  std::vector<std::uint8_t> sent;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    sent.insert(sent.end(), bytes.begin(), bytes.end());
    return true;
  };
  lab.permit(1 | 1 << 5 | 1 << 6 | 1 << 7);  // motor 1, requests, left
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.shaft_steps("m5"), -300);
  EXPECT_EQ(lab.requests() & 0x1Fu, 1u << 4);  // step done, and nothing is wrong
  std::vector<std::uint8_t> expected{0, 0x8D};
  for (int k = 0; k < 300; ++k) {
    expected.push_back(
        static_cast<std::uint8_t>(codes[static_cast<std::size_t>(std::min(k, 299 - k))]));
  }
  EXPECT_EQ(sent, expected);

  // The board misses the supply, and the module tells its program.
  lab.naf(5, 0, 10);
  lab.board(0).supply = false;
  lab.run_to_lam(1 | 1 << 5 | 1 << 6);
  EXPECT_EQ(lab.shaft_steps("m5"), -300);
  EXPECT_EQ(lab.requests() & 0x1Fu, 1u << 2);

  // Nor is the motor there.
  lab.board(0).supply = true;
  lab.board(0).motor(5).connected = false;
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  lab.ask(Ask::kSetPosition, {"m5"}, {lab.shaft_steps("m5")});
  lab.naf(5, 0, 10);
  lab.run_to_lam(1 | 1 << 5 | 1 << 6);
  EXPECT_EQ(lab.requests() & 0x1Fu, 1u << 3);
}

}  // namespace
}  // namespace bushd::test::camac_boards_test
