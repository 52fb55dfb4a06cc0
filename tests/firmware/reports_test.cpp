// Reports tell what is new: whatever is lost, delayed or asked by somebody else, a master that has
// taken a report has what the MCU would tell one that knows nothing.
#include <algorithm>
#include <random>

#include "engine/told.h"
#include "firmware/streams.h"

namespace bushd::test {
namespace {

// What a master keeps, by docs/protocol.md.
struct Keeps {
  bushd_report report{};  // its number is 0: none yet
  void begin_anew() { report = {}; }
};

class Reports : public Streams {
 protected:
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); }

  // The answer to a POLL, if it has room; whether it arrives is another matter.
  std::optional<bushd_report> answer_to(const Keeps& master, std::uint8_t room = 255) {
    bushd_report before = master.report;
    if (before.number == 0) before.motor_count = BUSHD_MOTORS_PER_MCU;
    const auto report = rig.ask_report(master.report.number, room, before);
    EXPECT_TRUE(report);
    return report && report->number != 0 ? report : std::nullopt;
  }
  bool ask(Keeps& master, std::uint8_t room = 255) {
    auto report = answer_to(master, room);
    const bool booted =
        report && master.report.number != 0 && report->boot_number != master.report.boot_number;
    if (booted) {
      master.begin_anew();
      report = answer_to(master);
    }
    if (report) master.report = *report;
    return report.has_value();
  }
  void expect_to_know_all(const Keeps& master) {
    EXPECT_EQ(told(master.report), told(rig.all_of_report()));
  }

  // Something that reports tell of.
  void happen() {
    const auto motor = static_cast<std::uint8_t>(below(rig.options().motors));
    switch (below(14)) {
      case 0:
        rig.set_position(motor, static_cast<std::int32_t>(random()));
        return;
      case 1:
        rig.pins({static_cast<std::uint16_t>(random()), static_cast<std::uint8_t>(below(16))});
        return;
      case 2:
        rig.current(static_cast<std::uint16_t>(below(1024)));
        return;
      case 3:
        rig.feed(Bytes{1, 2, 3, 4, 5, 6, 7, 8, 9, 0});
        return;
      case 4:
        rig.frame(rig.options().address, 0x7E, {});  // answered
        rig.answer();
        return;
      case 5:
        rig.sync({1, ++sync_id, false, 0, 0, 0});
        return;
      case 6:
        rig.emergency(below(2) == 0 ? BUSHD_STOP_IMMEDIATE : BUSHD_STOP_RAMP);
        return;
      case 7:
      case 8:
        rig.clear(0);
        return;
      case 9:
        rig.home({motor, 1, 300, 0, 20, 2000, 77});
        return;
      case 10:
        rig.arm(static_cast<std::uint8_t>(1 + below(255)), BUSHD_EDGE_RISING, 50,
                {{motor, 0, 1, 1 + below(30), 0}});
        return;
      case 11:
        if (rig.awaited_edge() != BUSHD_EDGE_NONE) rig.trigger(1000);
        return;
      case 12:
        rig.control(BUSHD_CONTROL_ENABLE);
        return;
      default:
        run(motor);
    }
  }
  void run(std::uint8_t motor) {
    const bushd_table_run_entry entry = {motor, 0, static_cast<std::int8_t>(below(2) == 0 ? 1 : -1),
                                         1 + below(60), 0};
    const Bytes payload =
        table_run_payload(rig.mcu().stream.epoch, rig.first_open() + below(9), entry);
    rig.frame(BUSHD_MSG_TABLE_RUN, payload);
  }
  void limits_at_own_inputs() {
    InputSettings settings;
    settings.limit_positive = 0x3;
    settings.limit_negative = 0x6;
    ASSERT_EQ(rig.set_inputs(settings), BUSHD_OK);
  }

  std::mt19937 random{81};
  std::uint32_t sync_id = 1000;
};
BUSHD_IN_BOTH_FORMATS(Reports);

TEST_P(Reports, AnyPatternOfLossesLeavesAMasterWithWhatTheMcuTells) {
  limits_at_own_inputs();
  Keeps master;
  Keeps other;  // asks by turns, and need not hear all of its answers either
  int taken = 0;
  int short_of_all = 0;
  for (int i = 0; i < 30'000 && !HasFailure(); ++i) {
    SCOPED_TRACE(i);
    for (std::uint32_t n = below(3); n > 0; --n) happen();
    rig.pass(static_cast<int>(below(4) == 0 ? below(60) : below(3)));
    switch (below(12)) {
      case 0:
      case 1:
        continue;  // the POLL is lost
      case 2:
      case 3:
        answer_to(master);  // its answer is
        continue;
      case 4:
        answer_to(master);  // a copy of the POLL that comes first, or a late one
        break;
      case 5:
        if (below(3) == 0) ask(other);
        break;
      case 6:
        if (below(9) == 0) master.begin_anew();
        break;
      case 7:
        if (ask(master, static_cast<std::uint8_t>(below(120)))) expect_to_know_all(master);
        continue;
      case 8:
        if (below(40) != 0) break;
        ++rig.mutable_mcu()->config.boot_number;
        rig.restart_with_nvm();
        rig.make_ready(law, format, 1000);
        limits_at_own_inputs();
        break;
      default:
        break;
    }
    ASSERT_TRUE(ask(master));
    expect_to_know_all(master);
    ++taken;
    short_of_all += bushd_report_is_whole(&master.report) ? 0 : 1;
  }
  EXPECT_GT(taken, 15'000);
  EXPECT_GT(short_of_all, 8'000) << "most tell no more than what is new";
}

TEST_P(Reports, AtRestHaveNoSectionAndNoMotor) {
  Keeps master;
  ASSERT_TRUE(ask(master));
  EXPECT_TRUE(bushd_report_is_whole(&master.report));
  for (int i = 0; i < 600; ++i) {
    const std::uint8_t before = master.report.number;
    rig.pass(20);
    ASSERT_TRUE(ask(master, 22)) << "the least room is enough";
    EXPECT_EQ(master.report.sections, 0);
    EXPECT_EQ(master.report.motors, 0);
    EXPECT_EQ(master.report.number, before % 255 + 1);
  }
}

TEST_P(Reports, TellASectionOnceWhenItHasChanged) {
  limits_at_own_inputs();
  Keeps master;
  ASSERT_TRUE(ask(master));
  const auto expect_news = [&](int sections, unsigned motors) {
    ASSERT_TRUE(ask(master));
    EXPECT_EQ(master.report.sections, sections);
    EXPECT_EQ(master.report.motors, motors);
    ASSERT_TRUE(ask(master));
    EXPECT_EQ(master.report.sections, 0);
    EXPECT_EQ(master.report.motors, 0);
  };
  rig.sync({1, ++sync_id, false, 0, 0, 0});
  expect_news(BUSHD_TELLS_SYNC, 0);
  rig.feed(Bytes{1, 2, 3, 4, 5, 6, 7, 8, 9, 0});
  expect_news(BUSHD_TELLS_COUNTERS, 0);
  rig.pins({0, BUSHD_INPUT_FORWARD});
  expect_news(BUSHD_TELLS_INPUTS, 0);
  rig.set_position(3, 12);
  expect_news(0, 1u << 3);
  ASSERT_EQ(rig.arm(1, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 5, 0}}), BUSHD_OK);
  expect_news(BUSHD_TELLS_AUTONOMOUS, 0);
  ASSERT_EQ(rig.disarm(), BUSHD_OK);
  expect_news(BUSHD_TELLS_AUTONOMOUS, 0);
}

// It has begun and ended between two reports.
TEST_P(Reports, TellOfAMotionThatIsOverAlready) {
  Keeps master;
  ASSERT_TRUE(ask(master));
  run(2);
  rig.pass(2000);
  ASSERT_TRUE(ask(master));
  EXPECT_EQ(master.report.motors, 1u << 2);
  EXPECT_EQ(master.report.motor[2].position_steps, rig.pulses(2));
  EXPECT_NE(rig.pulses(2), 0);
}

TEST_P(Reports, WithoutRoomForAllThatIsNewTellNothing) {
  Keeps master;
  ASSERT_TRUE(ask(master));
  rig.set_position(1, 1000);
  rig.sync({1, ++sync_id, false, 0, 0, 0});
  const std::uint8_t all = 22 + 16 + 6;
  for (const std::uint8_t room : {std::uint8_t{0}, std::uint8_t{22}, std::uint8_t{all - 1}}) {
    EXPECT_FALSE(ask(master, room)) << int{room};
  }
  EXPECT_TRUE(ask(master, all)) << "as if it had not been asked before";
  EXPECT_EQ(master.report.sections, BUSHD_TELLS_SYNC);
  EXPECT_EQ(master.report.motors, 1u << 1);
  expect_to_know_all(master);
}

TEST_P(Reports, NeverHaveTheNumberThatTheirMasterHas) {
  Keeps master;
  ASSERT_TRUE(ask(master));
  for (int lost = 0; lost < 600; ++lost) {
    rig.set_position(0, lost);
    const auto report = answer_to(master);
    ASSERT_TRUE(report);
    EXPECT_NE(report->number, master.report.number);
    EXPECT_NE(report->number, 0);
  }
  ASSERT_TRUE(ask(master));
  expect_to_know_all(master);
}

// The fewest ticks that a motor had queued, since the last report that was taken.
TEST_P(Reports, LoseNoLowWater) {
  rig.set_inputs({});
  Keeps master;
  ASSERT_TRUE(ask(master));
  std::uint16_t fewest = UINT16_MAX;
  int told_of = 0;
  const Plan way = plan(4000);
  const std::uint32_t start = rig.first_open() + 4;
  std::size_t sent = 0;
  for (int i = 0; i < 20'000 && sent < way.ticks() && !HasFailure(); ++i) {
    const auto at = static_cast<std::int64_t>(rig.tick()) - start;
    const std::int64_t ahead = static_cast<std::int64_t>(sent) - at;
    if (ahead < 8 + static_cast<std::int64_t>(below(60))) {
      const std::size_t count = std::min<std::size_t>({way.ticks() - sent, 20, 1 + below(20)});
      rig.frame(BUSHD_MSG_TICKS, rig.encode(rig.part(way, start, sent, count)));
      sent += count;
      fewest = std::min(fewest, rig.mcu().low_water_ticks);
    }
    rig.pass();
    fewest = std::min(fewest, rig.mcu().low_water_ticks);
    if (below(5) == 0) answer_to(master);  // lost
    if (below(9) != 0) continue;
    ASSERT_TRUE(ask(master));
    EXPECT_EQ(master.report.low_water_ticks, fewest);
    told_of += fewest != UINT16_MAX ? 1 : 0;
    fewest = UINT16_MAX;
  }
  EXPECT_EQ(sent, way.ticks());
  EXPECT_GT(told_of, 20);
}

}  // namespace
}  // namespace bushd::test
