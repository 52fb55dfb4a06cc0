#include "heritage/camac/block.h"

#include <gtest/gtest.h>

#include <functional>

#include "heritage/camac/bench.h"

namespace bushd::camac::block_test {
namespace {

// Answers as the test says, and counts.
class Scripted final : public Module {
 public:
  explicit Scripted(std::function<Response(int, const Command&)> answer)
      : answer_(std::move(answer)) {}
  Response cycle(const Command& command) override {
    written.push_back(command.data);
    return answer_(cycles++, command);
  }
  void initialise() override {}
  void clear() override {}
  void set_inhibit(bool) override {}
  bool lam() const override { return false; }

  int cycles = 0;
  std::vector<std::uint32_t> written;

 private:
  std::function<Response(int, const Command&)> answer_;
};

Response with_q(std::uint32_t data) {
  return {.x = true, .q = true, .data = data};
}
constexpr Response kNoQ{.x = true};

TEST(Block, SingleMakesEachCycleWhateverItAnswers) {
  Scripted module([](int i, const Command&) { return i == 0 ? Response{} : with_q(7); });
  Crate crate;
  crate.insert(3, module);
  const BlockResult result = transfer(crate, {.cycles = {{3, 0, 0}, {4, 0, 0}, {3, 1, 0}}});
  EXPECT_EQ(result.tally, 3U);
  EXPECT_EQ(result.responses, (std::vector<Response>{{}, {}, with_q(7)}));
}

TEST(Block, QStopEndsWithAWordThatIsNone) {
  Scripted module([](int i, const Command&) { return i < 3 ? with_q(10U + i) : kNoQ; });
  Crate crate;
  crate.insert(3, module);
  const BlockResult result =
      transfer(crate, {.mode = BlockMode::kQStop, .cycles = {{3, 0, 0}}, .count = 10});
  EXPECT_EQ(result.tally, 3U);
  EXPECT_EQ(module.cycles, 4);
  EXPECT_EQ(result.responses.back(), kNoQ);
}

// As U4 reads it: a transfer of exactly the memory's length moves every byte.
TEST(Block, QStopReadsAWholeMemory) {
  MotorsBench motors;
  Bushd2 module(motors);
  Crate crate;
  crate.insert(5, module);
  crate.cycle(5, {.subaddress = 2, .function = 16, .data = 0x10});
  Block block{.mode = BlockMode::kQStop};
  for (std::uint32_t i = 0; i < 2000; ++i) block.cycles.push_back({5, 0, 16, i & 0xFF});
  block.count = 2000;
  EXPECT_EQ(transfer(crate, block).tally, 1024U);
}

TEST(Block, RepeatWaitsForQButNotForEver) {
  Scripted module([](int i, const Command&) { return i % 5 == 4 ? with_q(1) : kNoQ; });
  Crate crate;
  crate.insert(3, module);
  const Block block{
      .mode = BlockMode::kRepeat, .cycles = {{3, 0, 16, 8}, {3, 0, 16, 9}}, .count = 2};
  EXPECT_EQ(transfer(crate, block).tally, 2U);
  EXPECT_EQ(module.written, (std::vector<std::uint32_t>{8, 8, 8, 8, 8, 9, 9, 9, 9, 9}));

  Scripted never([](int, const Command&) { return kNoQ; });
  crate.insert(4, never);
  const BlockResult result =
      transfer(crate, {.mode = BlockMode::kRepeat, .cycles = {{4, 0, 0}}, .count = 5});
  EXPECT_EQ(result.tally, 0U);
  EXPECT_EQ(never.cycles, Block::kMostTries);
  const BlockResult empty =
      transfer(crate, {.mode = BlockMode::kRepeat, .cycles = {{9, 0, 0}}, .count = 5});
  EXPECT_EQ(empty.responses, std::vector<Response>{{}}) << "X = 0 ends it at once";
}

TEST(Block, ScanGoesFromSubaddressToStation) {
  // Station 3 has subaddresses 0..2, station 4 is empty, 5 has all 16.
  Scripted three([](int, const Command& c) { return c.subaddress < 3 ? with_q(3) : kNoQ; });
  Scripted five(
      [](int, const Command& c) { return with_q(500U + static_cast<unsigned>(c.subaddress)); });
  Crate crate;
  crate.insert(3, three);
  crate.insert(5, five);
  Block block{.mode = BlockMode::kScan, .cycles = {{3, 1, 0}}, .count = 100};
  EXPECT_EQ(transfer(crate, block).tally, 2U + 16U);
  EXPECT_EQ(three.cycles, 3);
  block.last_station = 5;
  block.last_subaddress = 1;
  const BlockResult part = transfer(crate, block);
  EXPECT_EQ(part.tally, 4U);
  EXPECT_EQ(part.responses.back(), with_q(501));
  block.count = 3;
  EXPECT_EQ(transfer(crate, block).tally, 3U);
}

}  // namespace
}  // namespace bushd::camac::block_test
