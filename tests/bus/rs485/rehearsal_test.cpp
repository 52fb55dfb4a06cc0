// What a dry run counts is what the moves then send.
#include "bus/rs485/rehearsal.h"

#include "bus/rs485/slave.h"

namespace bushd::test {
namespace {

using link::PlannedMove;
using link::Tick;

class RehearsalTest : public testing::Test {
 protected:
  RehearsalTest() {
    bus.connect();
    bus.run_for(1'000'000);
    start = bus.master->earliest_start(bus.now_us, McuIndex{0}, 0);
    bus.source.end = [this](std::uint8_t) { return start + 300; };
    bus.source.delay = [this](std::uint8_t, Tick tick) {
      return std::uint16_t(tick < start + 300 ? 50 : 0);
    };
    moves = {{McuIndex{0}, 0, start, {}}, {McuIndex{0}, 2, start, {}}, {McuIndex{1}, 1, start, {}}};
  }
  std::optional<link::Traffic> rehearse(std::uint64_t max_frames = 1000) {
    link::Rehearsal rehearsal(bus.master->snapshot(bus.now_us), bus.source, moves, max_frames);
    while (rehearsal.step()) {
    }
    return rehearsal.traffic();
  }
  FakeBus bus{2, 4};
  Tick start = 0;
  std::vector<PlannedMove> moves;
};

TEST_F(RehearsalTest, CountsWhatIsThenSent) {
  const auto traffic = rehearse();
  ASSERT_TRUE(traffic);
  bus.heard.clear();
  for (const PlannedMove& move : moves) bus.master->begin(move.mcu, move.motor, move.start);
  bus.run_for(1'500'000);
  const auto sent = bus.heard_of(BUSHD_MSG_TICKS);
  EXPECT_EQ(traffic->frames, sent.size());
  std::size_t bytes = 0;
  for (const Heard& heard : sent) bytes += heard.payload.size() + BUSHD_FRAME_OVERHEAD;
  EXPECT_GE(traffic->bytes, bytes);
  EXPECT_LE(traffic->bytes, bytes + sent.size()) << "a delimiter before each, at most";
}

TEST_F(RehearsalTest, TableRunsAreOneFrameForTheMotorsOfAnMcu) {
  for (PlannedMove& move : moves) move.run = link::TableRun{500};
  const auto traffic = rehearse();
  ASSERT_TRUE(traffic);
  EXPECT_EQ(traffic->frames, 2u);
}

TEST_F(RehearsalTest, TooManyFramesAreNotCounted) {
  EXPECT_FALSE(rehearse(10));
}

// What becomes of the bus while a rehearsal is under way is no concern of it.
TEST_F(RehearsalTest, CountsWhatWasAtItsBegin) {
  const auto traffic = rehearse();
  link::Rehearsal rehearsal(bus.master->snapshot(bus.now_us), bus.source, moves, 1000);
  rehearsal.step();
  bus.master->begin(McuIndex{0}, 3, start);
  bus.run_for(500'000);
  bus.master->port_lost(bus.now_us, "unplugged");
  while (rehearsal.step()) {
  }
  ASSERT_TRUE(rehearsal.traffic());
  EXPECT_EQ(rehearsal.traffic()->frames, traffic->frames);
  EXPECT_EQ(rehearsal.traffic()->bytes, traffic->bytes);
}

TEST_F(RehearsalTest, NothingIsSentAndNothingChanges) {
  const Tick before = bus.master->earliest_start(bus.now_us, McuIndex{0}, 0);
  bus.heard.clear();
  rehearse();
  EXPECT_EQ(bus.master->earliest_start(bus.now_us, McuIndex{0}, 0), before);
  bus.run_for(500'000);
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_TICKS).empty());
  EXPECT_EQ(bus.master->health(McuIndex{0}).repeats, 0u);
}

}  // namespace
}  // namespace bushd::test
