// The bus with the real firmware core on it: frames in, edges and replies out.
#include "sim/bus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bus_fixture.h"

namespace bushd::sim::bus_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint32_t kBaud = 500'000;
constexpr TimeNs kByteNs = 20'000;
constexpr std::uint32_t kTickNs = 1'024'000;  // 256 slots of 4 us
constexpr TimeNs kSlotNs = kTickNs / 256;

class TwoMcus : public testing::Test {
 protected:
  TwoMcus() {
    bus.add_mcu({.address = 1, .boot_number = 11});
    bus.add_mcu({.address = 2, .boot_number = 22, .boot_ns = 333'333});
    bus.advance_to(1'000'000);
  }

  // Both in step, with a table on motor 0 of each: 4 steps to 1000 steps/s.
  void make_ready() {
    master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
    for (const std::uint8_t address : {std::uint8_t{1}, std::uint8_t{2}}) {
      master.upload_table(address, 0, 1000, {4000, 2000, 1500, 1000}, 1000);
      master.assign(address, 0, 0);
    }
    recorder.edges.clear();
  }

  // The beginning of a tick of MCU 0: it is as far from now as ticks lie between.
  TimeNs tick_start_ns(std::uint32_t tick) const {
    const bushd_mcu& core = bus.mcu(0).core();
    const std::uint32_t ahead = tick - core.tick - 1;
    return bus.mcu(0).next_event_ns() + TimeNs{ahead} * kTickNs;
  }

  Recorder recorder;
  Bus bus{kBaud, &recorder};
  FrameMaster master{bus};
};

TEST_F(TwoMcus, EachAnswersForItself) {
  for (std::size_t i = 0; i < 2; ++i) {
    const auto identity = master.identify(bus.mcu(i).address());
    ASSERT_TRUE(identity);
    EXPECT_EQ(identity->boot_number, bus.mcu(i).boot_number());
    EXPECT_EQ(identity->motors, 16);
    EXPECT_EQ(identity->slots, 256);
    EXPECT_EQ(identity->queue_ticks, 1024);
    EXPECT_EQ(master.frames.size(), 1u);
  }
  EXPECT_EQ(bus.collisions(), 0u);
}

TEST_F(TwoMcus, ReplyComesAfterRequestTurnaroundAndItsOwnBytes) {
  const Bytes request = FrameMaster::wire(1, BUSHD_MSG_TABLES, 0, {});
  const TimeNs asked_ns = bus.now_ns();
  const auto reply = master.request(1, BUSHD_MSG_TABLES);
  ASSERT_TRUE(reply);
  const std::size_t reply_bytes = reply->payload.size() + BUSHD_FRAME_OVERHEAD;
  EXPECT_EQ(reply->end_ns - asked_ns,
            static_cast<TimeNs>(1 + request.size() + 1 + reply_bytes) * kByteNs + 20'000);
}

TEST_F(TwoMcus, UnknownAddressIsMetWithSilence) {
  EXPECT_FALSE(master.identify(3));
  EXPECT_THAT(master.frames, IsEmpty());
}

TEST_F(TwoMcus, RepliesOfOthersCountForNothing) {
  for (int i = 0; i < 20; ++i) master.poll(1);
  const bushd_report report = master.poll(2);
  EXPECT_EQ(report.bad_frames, 0);
  EXPECT_EQ(report.rejected_frames, 0);
}

TEST_F(TwoMcus, BrokenFrameIsCountedByAllAndAnsweredByNone) {
  Bytes wire = FrameMaster::wire(1, BUSHD_MSG_TABLES, 9, {});
  wire[3] ^= 0x40;
  bus.master_send(wire, bus.now_ns());
  master.drain();
  EXPECT_THAT(master.frames, IsEmpty());
  EXPECT_EQ(master.poll(1).bad_frames, 1);
  EXPECT_EQ(master.poll(2).bad_frames, 1);
}

TEST_F(TwoMcus, TwoTalkersAtOnceCollideAndAreReported) {
  std::vector<std::array<int, 2>> collisions;
  bus.on_collision = [&](TimeNs, std::uint8_t first, std::uint8_t second) {
    collisions.push_back({first, second});
  };
  // Two requests without a pause: the second is on the bus while the first is being answered.
  Bytes both = FrameMaster::wire(1, BUSHD_MSG_TABLES, 1, {});
  const Bytes second = FrameMaster::wire(2, BUSHD_MSG_TABLES, 2, {});
  both.insert(both.end(), second.begin(), second.end());
  bus.master_send(both, bus.now_ns());
  master.drain();
  EXPECT_EQ(bus.collisions(), 1u);
  EXPECT_GT(bus.corrupted_bytes(), 4u);
  EXPECT_THAT(collisions, ElementsAre(ElementsAre(0, 1)));
  EXPECT_THAT(master.frames, IsEmpty());
  EXPECT_GT(master.bad_frames, 0);
  // What is left of that costs nobody the next frame.
  EXPECT_TRUE(master.identify(1));
  EXPECT_TRUE(master.identify(2));
}

TEST(Bus, TwoMcusOfOneAddressCollide) {
  Bus bus(kBaud);
  bus.add_mcu({.address = 5});
  bus.add_mcu({.address = 5});
  FrameMaster master(bus);
  int between_mcus = 0;
  bus.on_collision = [&](TimeNs, std::uint8_t first, std::uint8_t second) {
    between_mcus += first == 5 && second == 5;
  };
  EXPECT_FALSE(master.identify(5));
  EXPECT_EQ(between_mcus, 1);
}

// Reply windows of one broadcast, as the master lays them out: no collision, one answer each.
TEST_F(TwoMcus, OnePollIsAnsweredByAllInTheirWindows) {
  const TimeNs asked_ns = bus.now_ns();
  const std::array<bushd_poll_entry, 3> entries = {
      {{2, 500, 0, 255}, {9, 900, 0, 255}, {1, 1300, 0, 255}}};
  const Bytes payload =
      payload_of([&](std::uint8_t* to) { return bushd_encode_poll(entries.data(), 3, to); });
  master.frames.clear();
  master.send(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, payload);
  ASSERT_EQ(master.frames.size(), 2u);
  EXPECT_EQ(bus.collisions(), 0u);
  const TimeNs poll_ns =
      asked_ns + static_cast<TimeNs>(1 + payload.size() + BUSHD_FRAME_OVERHEAD) * kByteNs;
  const TimeNs begin_ns[] = {5'000'000, 13'000'000};
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(master.frames[i].address, i == 0 ? 2 : 1);
    const std::size_t bytes = 1 + master.frames[i].payload.size() + BUSHD_FRAME_OVERHEAD;
    EXPECT_EQ(master.frames[i].end_ns,
              poll_ns + begin_ns[i] + static_cast<TimeNs>(bytes) * kByteNs);
    const auto report = decoded(master.frames[i].payload, bushd_decode_report);
    ASSERT_TRUE(report);
    // As it was when the poll's frame ended.
    const TimeNs boot_ns = i == 0 ? 333'333 : 0;
    EXPECT_EQ(TimeNs{report->tick} * BUSHD_BOOT_TICK_NS + report->tick_ns, poll_ns - boot_ns);
  }
}

// The same address twice, told apart by the windows that their unique ids choose, and one moved
// away.
TEST(Bus, McusOfOneAddressAreFoundAndParted) {
  Bus bus(kBaud);
  bus.add_mcu({.address = 5});
  bus.add_mcu({.address = 5});
  FrameMaster master(bus);
  std::vector<Frame> found;
  for (std::uint16_t salt = 0; salt < 50 && found.size() < 2; ++salt) {
    found = master.scan({salt, 4, 300});
  }
  ASSERT_EQ(found.size(), 2u);
  const auto identity = decoded(found[1].payload, bushd_decode_identity);
  ASSERT_TRUE(identity);
  bushd_set_address message{};
  std::copy_n(identity->unique_id, BUSHD_UNIQUE_ID_SIZE, message.unique_id);
  message.address = 6;
  master.frames.clear();
  master.broadcast(message);
  ASSERT_EQ(master.frames.size(), 1u);
  EXPECT_EQ(master.frames[0].address, 6);
  EXPECT_EQ(master.frames[0].payload, Bytes{BUSHD_OK});
  EXPECT_TRUE(master.identify(5));
  EXPECT_TRUE(master.identify(6));
  for (std::size_t i = 0; i < 2; ++i) bus.reboot(i);
  bus.advance_to(bus.now_ns() + 1'000'000);
  EXPECT_TRUE(master.identify(5));
  EXPECT_TRUE(master.identify(6)) << "kept";
}

TEST_F(TwoMcus, StepsFallInExactlyTheirSlots) {
  make_ready();
  const std::uint32_t first = bus.mcu(0).core().tick + 10;
  // 1 step over two ticks; then 2 steps in a tick: at its half and at its end, which is the last
  // slot.
  master.fine_ticks(1, 0, first, {128, 128, 512});
  const TimeNs start_ns = tick_start_ns(first);
  bus.advance_to(start_ns + 5 * TimeNs{kTickNs});
  const std::vector<TimeNs> rises = {start_ns + kTickNs + 255 * kSlotNs,
                                     start_ns + 2 * kTickNs + 128 * kSlotNs,
                                     start_ns + 2 * kTickNs + 255 * kSlotNs};
  EXPECT_EQ(recorder.times(0, Signal::kStep, 0, true), rises);
  std::vector<TimeNs> falls = rises;
  for (TimeNs& fall_ns : falls) fall_ns += kSlotNs / 2;
  EXPECT_EQ(recorder.times(0, Signal::kStep, 0, false), falls);
  EXPECT_THAT(recorder.times(0, Signal::kDir, 0, true), ElementsAre(start_ns));
  EXPECT_EQ(bus.mcu(0).shaft(0).position_steps, 3);
  const bushd_report report = master.poll(1);
  EXPECT_EQ(report.motor[0].position_steps, 3);
  EXPECT_EQ(report.state, BUSHD_STATE_READY);
}

TEST_F(TwoMcus, DirectionChangesAtTheBoundaryBeforeTheFirstStepOfTheTick) {
  make_ready();
  const std::uint32_t first = bus.mcu(0).core().tick + 10;
  master.fine_ticks(1, 0, first, {512, -512});
  const TimeNs start_ns = tick_start_ns(first);
  bus.advance_to(start_ns + 3 * TimeNs{kTickNs});
  EXPECT_THAT(recorder.times(0, Signal::kDir, 0, true), ElementsAre(start_ns));
  EXPECT_THAT(recorder.times(0, Signal::kDir, 0, false), ElementsAre(start_ns + kTickNs));
  EXPECT_EQ(bus.mcu(0).shaft(0).position_steps, 0);
  EXPECT_EQ(bus.mcu(0).shaft(0).travel_steps, 4u);
}

TEST_F(TwoMcus, QueueThatEndsEarlyRunsDownTheTable) {
  make_ready();
  const std::uint32_t first = bus.mcu(0).core().tick + 10;
  master.fine_ticks(1, 0, first, {256, 256, 256}, 1000);
  bus.advance_to(tick_start_ns(first + 30));
  const bushd_report report = master.poll(1);
  EXPECT_EQ(report.faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(report.moving, 0);
  // The step that runs, then the fewest steps k with D(k) <= 1000 us: 1000 after 3 of the
  // table's 4.
  EXPECT_EQ(report.motor[0].position_steps, 3 + 1 + 3);
  EXPECT_EQ(bus.mcu(0).shaft(0).position_steps, report.motor[0].position_steps);
}

TEST_F(TwoMcus, EnableShowsOnTheEnWire) {
  make_ready();
  const TimeNs before_ns = bus.now_ns();
  ASSERT_EQ(master.acknowledged(2, bushd_control{BUSHD_CONTROL_DISABLE, 0}), BUSHD_OK);
  const auto falls = recorder.times(1, Signal::kEnable, 0, false);
  ASSERT_EQ(falls.size(), 1u);
  EXPECT_EQ(falls[0], before_ns + static_cast<TimeNs>(1 + BUSHD_FRAME_OVERHEAD + 1) * kByteNs);
  EXPECT_THAT(recorder.times(0, Signal::kEnable, 0, false), IsEmpty());
}

TEST_F(TwoMcus, RebootDropsThePinsTheReplyAndTheMemory) {
  make_ready();
  const std::uint32_t first = bus.mcu(0).core().tick + 10;
  master.fine_ticks(1, 0, first, {32 * 256, 32 * 256, 32 * 256}, 1000);
  // In the second tick, within the pulse of its 5th step.
  const TimeNs reset_ns = tick_start_ns(first) + kTickNs + 5 * 8 * kSlotNs + kSlotNs / 4;
  const Bytes question = FrameMaster::wire(1, BUSHD_MSG_TABLES, 1, {});
  bus.master_send(question, reset_ns - static_cast<TimeNs>(question.size() + 5) * kByteNs);
  bus.advance_to(reset_ns);
  master.frames.clear();
  bus.reboot(0, 3'000'000);
  EXPECT_EQ(bus.mcu(0).shaft(0).position_steps, 32 + 5);
  EXPECT_EQ(recorder.times(0, Signal::kStep, 0, true).size(), 32u + 5u);
  EXPECT_EQ(recorder.times(0, Signal::kStep, 0, false).back(), reset_ns);
  EXPECT_THAT(recorder.times(0, Signal::kEnable, 0, false), ElementsAre(reset_ns));
  EXPECT_THAT(recorder.times(0, Signal::kDir, 0, false), ElementsAre(reset_ns));
  EXPECT_FALSE(master.request(1, BUSHD_MSG_TABLES)) << "it is still in reset";
  bus.advance_to(reset_ns + 4'000'000);
  const bushd_report report = master.poll(1);
  EXPECT_EQ(report.boot_number, 12);
  EXPECT_EQ(report.state, BUSHD_STATE_BUSY);
  EXPECT_EQ(report.motor[0].position_steps, 0);
  EXPECT_EQ(bus.mcu(0).shaft(0).position_steps, 32 + 5) << "the shaft does not forget";
}

// What happens does not depend on how time is cut into pieces.
TEST(Bus, StrideDoesNotMatter) {
  const auto play = [](TimeNs stride_ns) {
    auto recorder = std::make_unique<Recorder>();
    Bus bus(kBaud, recorder.get());
    bus.add_mcu({.address = 1, .clock_ppm = 40});
    bus.add_mcu({.address = 2, .boot_ns = 777, .clock_ppm = -40});
    FrameMaster master(bus);
    master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
    master.upload_table(2, 0, 1000, {4000, 2000, 1500, 1000}, 1000);
    master.assign(2, 0, 0);
    master.fine_ticks(2, 0, bus.mcu(1).core().tick + 5, {300, 300, 300, 300}, 1000);
    const TimeNs end_ns = bus.now_ns() + 50'000'000;
    while (bus.now_ns() < end_ns) bus.advance_to(std::min(end_ns, bus.now_ns() + stride_ns));
    return recorder;
  };
  const auto coarse = play(50'000'000);
  const auto fine = play(1'234);
  for (std::size_t mcu = 0; mcu < 2; ++mcu) {
    for (const bool level : {false, true}) {
      EXPECT_EQ(coarse->times(mcu, Signal::kStep, 0, level),
                fine->times(mcu, Signal::kStep, 0, level));
      EXPECT_EQ(coarse->times(mcu, Signal::kEnable, 0, level),
                fine->times(mcu, Signal::kEnable, 0, level));
    }
  }
  EXPECT_GT(coarse->times(1, Signal::kStep, 0, true).size(), 4u);
}

TEST_F(TwoMcus, NextEventIsNeverLateAndNeverPast) {
  master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
  bus.master_send(FrameMaster::wire(1, BUSHD_MSG_TABLES, 1, {}), bus.now_ns() + 123);
  for (int i = 0; i < 500; ++i) {
    const TimeNs next_ns = bus.next_event_ns();
    ASSERT_GT(next_ns, bus.now_ns());
    bus.advance_to(next_ns);
  }
}

}  // namespace
}  // namespace bushd::sim::bus_test
