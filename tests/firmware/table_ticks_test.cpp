// TABLE_TICKS have the effect of the TICKS that the same run expands to, bit for bit.
#include "engine/tables.h"
#include "firmware/streams.h"

namespace bushd::test {
namespace {

class TableTicks : public Streams {
 protected:
  Bytes state_frame(const Ticks& head, std::uint16_t count,
                    std::vector<bushd_table_ticks_entry> entries) const {
    return payload_of([&](std::uint8_t* to) {
      return bushd_encode_table_ticks(head.epoch, head.flags, head.first, count, entries.data(),
                                      static_cast<std::uint8_t>(entries.size()), to);
    });
  }
  bushd_status take_state(Rig& on, const Ticks& head, std::uint16_t count,
                          const std::vector<bushd_table_ticks_entry>& entries) const {
    return on.take(BUSHD_MSG_TABLE_TICKS, state_frame(head, count, entries));
  }
  // `count` ticks of a run, as TICKS carry them.
  Ticks expanded(bushd_run* run, Ticks head, std::uint8_t count) const {
    head.count = count;
    if (format == BUSHD_FORMAT_FINE) {
      head.displacements.resize(count);
      bushd_run_expand_fine(run, Rig::kTickNs, count, head.displacements.data(), 1);
    } else {
      std::vector<std::uint8_t> bytes(count);
      bushd_run_expand_coarse(run, Rig::kTickNs, count, bytes.data(), 1);
      head.displacements.assign(bytes.begin(), bytes.end());
    }
    head.delays = {static_cast<std::uint16_t>(bushd_run_delay(run))};
    return head;
  }
  const TestTable table{law, false};
};
BUSHD_IN_BOTH_FORMATS(TableTicks);

TEST_P(TableTicks, EqualTicksForAnyRunFromAnyTick) {
  holds("two MCUs, one hears displacements, the other run states", [this] {
    ReadyRig by_ticks(law, format);
    ReadyRig by_states(law, format);
    bushd_run run;
    const int direction = between(0, 1) != 0 ? 1 : -1;
    const bool lead = between(0, 3) == 0;
    if (lead) {
      bushd_run_start_ramp_down(&run, table.view(), between<std::uint16_t>(law.cruise, 400),
                                between<std::uint8_t>(0, 255), direction);
    } else {
      bushd_run_start(&run, table.view(), between<std::uint32_t>(1, 400), direction, 0);
    }
    Ticks head{.flags = kStart, .first = by_ticks.first_open()};
    const auto cut_tick = between<int>(5, 300);
    int sent = 0;
    while (!bushd_run_done(&run)) {
      const auto count = between<std::uint8_t>(1, 25);
      head.epoch = by_ticks.mcu().stream.epoch;
      if (sent > cut_tick &&
          sent < cut_tick + 25) {  // a stop, from the middle of what is queued on
        bushd_run_ramp_down(&run);
        head.flags = kReplace;
        ++head.epoch;
      }
      const bushd_run_state state = bushd_run_save(&run, Rig::kTickNs, count);
      const Ticks ticks = expanded(&run, head, count);
      RC_ASSERT(by_ticks.take(ticks) == BUSHD_OK);
      RC_ASSERT(take_state(by_states, head, count, {{0, state}}) == BUSHD_OK);
      sent += count;
      head.first += count;
      head.flags = 0;
      while (head.first - by_ticks.tick() > 30) {
        RC_ASSERT(by_ticks.mcu().motor[0].delay == by_states.mcu().motor[0].delay);
        RC_ASSERT(by_ticks.mcu().motor[0].known_until == by_states.mcu().motor[0].known_until);
        for (std::size_t slot = 0; slot < 256; ++slot) {
          RC_ASSERT(by_ticks.slot_buffer().step[slot] == by_states.slot_buffer().step[slot]);
        }
        by_ticks.pass();
        by_states.pass();
      }
    }
    by_ticks.pass_until_rest();
    by_states.pass_until_rest();
    RC_ASSERT(by_ticks.history(0).size() == by_states.history(0).size());
    RC_ASSERT(by_ticks.history(0) == by_states.history(0));
    RC_ASSERT(by_states.poll().faults == 0);
    RC_ASSERT(by_states.poll().motor[0].position_steps == by_ticks.poll().motor[0].position_steps);
  });
}

TEST_P(TableTicks, SeveralMotorsShareAFrameAndDuplicatesChangeNothing) {
  std::vector<bushd_table_ticks_entry> entries;
  std::vector<bushd_run> runs(4);
  for (std::uint8_t m = 0; m < 4; ++m) {
    bushd_run_start(&runs[m], table.view(), 10u + 20u * m, m % 2 ? -1 : 1, 0);
    entries.push_back({m, bushd_run_save(&runs[m], Rig::kTickNs, 120)});
  }
  const Ticks head{.flags = kStart, .first = rig.first_open()};
  ASSERT_EQ(take_state(rig, head, 120, entries), BUSHD_OK);
  EXPECT_EQ(take_state(rig, head, 120, entries), BUSHD_E_LATE);
  rig.pass(5);
  EXPECT_EQ(take_state(rig, head, 120, entries), BUSHD_E_LATE);
  rig.pass_until_rest();
  for (std::uint8_t m = 0; m < 4; ++m) {
    EXPECT_EQ(rig.pulses(m), (m % 2 ? -1 : 1) * (10 + 20 * m));
    EXPECT_EQ(rig.poll().motor[m].position_steps, rig.pulses(m));
  }
  EXPECT_EQ(rig.poll().faults, 0);
}

TEST_P(TableTicks, LostFrameLeavesAnOutOfOrderRangeToo) {
  bushd_run run;
  bushd_run_start(&run, table.view(), 60, 1, 0);
  Ticks head{.flags = kStart, .first = rig.first_open()};
  std::vector<std::pair<Ticks, bushd_run_state>> frames;
  while (!bushd_run_done(&run)) {
    frames.emplace_back(head, bushd_run_save(&run, Rig::kTickNs, 20));
    expanded(&run, head, 20);
    head.first += 20;
    head.flags = 0;
  }
  ASSERT_EQ(frames.size(), 4u);
  for (const std::size_t i : {0u, 2u, 3u, 1u}) {
    ASSERT_EQ(take_state(rig, frames[i].first, 20, {{0, frames[i].second}}), BUSHD_OK) << i;
  }
  expect_position(0, 60);
}

// Nothing that a table cannot do is believed, and of a frame with one such state nothing is taken.
TEST_P(TableTicks, StatesThatNoRunHasAreRefusedAndChangeNothing) {
  bushd_run run;
  bushd_run_start(&run, table.view(), 300, 1, 0);
  const bushd_run_state good = bushd_run_save(&run, Rig::kTickNs, 30);
  const auto with = [&](auto change) {
    bushd_run_state state = good;
    change(state);
    return state;
  };
  using State = bushd_run_state;
  const std::vector<State> hostile = {with([](State& s) { s.since = 250; }),
                                      with([](State& s) { s.since = 65535; }),
                                      with([](State& s) { s.since_ns = 40'000; }),
                                      with([](State& s) { s.accel_at = 60000; }),
                                      with([](State& s) { s.accel_end = 25; }),
                                      with([](State& s) { s.accel_end = 65535; }),
                                      with([](State& s) { s.decel_left = 12; }),
                                      with([](State& s) { s.decel_left = 65535; }),
                                      with([](State& s) { s.lead_delay = 19; }),
                                      with([](State& s) { s.cruise_left = UINT32_MAX; }),
                                      State{1, false, 0, 0, 0, 0, 0, 0, 0, 0},
                                      State{1, true, 20, 0, 0, 0, 0, 0, 0, 0}};
  const Ticks head{.flags = kStart, .first = rig.first_open() + 5};
  for (std::size_t i = 0; i < hostile.size(); ++i) {
    EXPECT_EQ(take_state(rig, head, 30, {{0, good}, {1, hostile[i]}}), BUSHD_E_FORMAT) << i;
    EXPECT_EQ(rig.poll().moving, 0) << i;
  }
  EXPECT_EQ(take_state(rig, head, 30, {{0, good}, {4, good}}), BUSHD_E_FORMAT) << "four motors";
  EXPECT_EQ(take_state(rig, head, 200, {{0, good}}), BUSHD_E_CAPACITY);
  EXPECT_EQ(take_state(rig, head, 65535, {{0, good}}), BUSHD_E_CAPACITY);
  rig.pass(60);
  EXPECT_EQ(rig.pulses(0), 0);
  ASSERT_EQ(rig.upload(0, law), BUSHD_OK);
  EXPECT_EQ(take_state(rig, {.flags = kStart, .first = rig.first_open()}, 30, {{0, good}}),
            BUSHD_E_NO_TABLE);
}

TEST_P(TableTicks, AreRefusedByAnMcuThatIsTooSlowForThem) {
  Rig slow({.disabled_capabilities = BUSHD_CAN_TABLE_TICKS});
  EXPECT_EQ(slow.identify().capabilities & BUSHD_CAN_TABLE_TICKS, 0);
  slow.make_ready(law, format);
  bushd_run run;
  bushd_run_start(&run, table.view(), 50, 1, 0);
  const Ticks head{.flags = kStart, .first = slow.first_open()};
  EXPECT_EQ(take_state(slow, head, 30, {{0, bushd_run_save(&run, Rig::kTickNs, 30)}}),
            BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(slow.poll().moving, 0);
}

}  // namespace
}  // namespace bushd::test
