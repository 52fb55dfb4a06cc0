// Programs from end to end: the master against MCUs that run the firmware core, on one virtual
// line, with the host there, away, and back.
#include <gmock/gmock.h>

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "bus/rs485/master.h"
#include "engine/program.h"
#include "sim/bus.h"

namespace bushd::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using link::McuIndex;

constexpr std::uint32_t kTickNs = 2'560'000;
constexpr std::int64_t kSlotNs = 10'000;
constexpr std::uint16_t kMotors = 0b11;

void append(Bytes& bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

void append_move(Bytes& bytes, std::int32_t first, std::int32_t second) {
  bytes.push_back(2);
  append(bytes, kMotors, 2);
  for (const std::int32_t steps : {first, second}) {
    append(bytes, static_cast<std::uint32_t>(steps), 4);
    append(bytes, 0, 2);
  }
}

// Motors 0 and 1 to and fro, with rests between, `times` times; 0: without end.
Bytes to_and_fro(std::uint8_t flags, std::uint16_t times = 0) {
  Bytes bytes = {BUSHD_PROGRAM_FORMAT, flags};
  append(bytes, kMotors, 2);
  for (int motor = 0; motor < 2; ++motor) {
    bytes.push_back(0);
    append(bytes, 0u - 5000u, 4);
    append(bytes, 5000, 4);
  }
  bytes.push_back(8);
  append(bytes, times, 2);
  append_move(bytes, 230, -90);
  bytes.push_back(5);
  append(bytes, 150'000, 4);
  append_move(bytes, -230, 90);
  bytes.push_back(9);
  bytes.push_back(0);
  return bytes;
}

// Nothing moves but programs.
class NoTicks : public link::TickSource {
 public:
  std::uint16_t render(McuIndex, std::uint8_t, link::Tick, unsigned, std::int16_t*,
                       std::size_t) override {
    ADD_FAILURE() << "nothing was begun";
    return 0;
  }
  std::optional<RunSegment> run_at(McuIndex, std::uint8_t, link::Tick, unsigned) override {
    return std::nullopt;
  }
  link::Tick end_tick(McuIndex, std::uint8_t) override { return 0; }
};

class CoreBus : private sim::EdgeSink {
 public:
  explicit CoreBus(const std::vector<std::int32_t>& clocks_ppm = {0}) {
    for (std::uint16_t i = 0; i < 150; ++i) codes_.push_back(static_cast<std::uint16_t>(250 - i));
    table_.accel = table_.decel = {codes_.data(), 150, nullptr, nullptr, 0};
    table_.cruise = 90;
    table_.time_unit_ns = 40'000;
    setup = {.baud = 500'000, .tick_ns = kTickNs, .mcus = {}};
    for (const std::int32_t ppm : clocks_ppm) {
      sim::McuOptions options;
      options.address = static_cast<std::uint8_t>(setup.mcus.size() + 1);
      options.motors = 4;
      options.clock_ppm = ppm;
      line.add_mcu(options);
      link::McuSetup mcu;
      mcu.address = {options.address};
      mcu.tables = {{&table_, 7}};
      std::fill_n(mcu.table_of_motor.begin(), 4, std::uint8_t{0});
      setup.mcus.push_back(mcu);
    }
    line.on_master_byte = [this](std::uint8_t byte, sim::TimeNs) { received_.push_back(byte); };
    begin_master();
  }

  // The host as it begins: nothing is known to it.
  void begin_master() {
    received_.clear();
    setup.master = static_cast<std::uint16_t>(setup.master + 1);
    master = std::make_unique<link::Rs485Master>(setup, source_);
    master->port_opened(now_us());
    online = 0;
  }
  std::int64_t now_us() const { return now_ns_ / 1000; }

  bool run_until(const std::function<bool()>& done, double limit_s = 10) {
    const auto limit_ns = now_ns_ + static_cast<sim::TimeNs>(limit_s * 1e9);
    while (now_ns_ < limit_ns) {
      if (done()) return true;
      advance(limit_ns);
    }
    return done();
  }
  void run_for(double seconds) {
    run_until([] { return false; }, seconds);
  }
  // Nobody says a word.
  void be_silent(double seconds) {
    now_ns_ += static_cast<sim::TimeNs>(seconds * 1e9);
    line.advance_to(now_ns_);
    received_.clear();
  }

  void say(const bushd_sync& sync) {
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(bushd_encode_sync(&sync, payload.data()));
    Bytes wire(1 + BUSHD_FRAME_MAX_WIRE);
    wire.resize(1 + bushd_frame_encode(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC,
                                       static_cast<std::uint8_t>(sync.sync_id), payload.data(),
                                       payload.size(), wire.data() + 1));
    line.master_send(wire, now_ns_);
  }

  bool all_online() const {
    for (std::size_t i = 0; i < setup.mcus.size(); ++i) {
      if (master->view(McuIndex{i}).phase != link::McuPhase::kOnline) return false;
    }
    return true;
  }
  const bushd_program_state& state(std::size_t mcu = 0) const {
    return master->program(McuIndex{mcu}).state;
  }
  const bushd_report& report(std::size_t mcu = 0) const { return master->view({mcu}).report; }
  bool runs_until(std::uint8_t stage, std::size_t mcu = 0, double limit_s = 10) {
    return run_until([&] { return state(mcu).stage == stage; }, limit_s);
  }

  // All MCUs have the program, and begin it in one tick.
  void load_and_run(const Bytes& bytes) {
    ASSERT_TRUE(run_until([&] { return all_online(); }));
    std::vector<McuIndex> mcus;
    for (std::size_t i = 0; i < setup.mcus.size(); ++i) mcus.push_back({i});
    for (const McuIndex mcu : mcus) master->put_program(mcu, bytes);
    for (const McuIndex mcu : mcus) ASSERT_TRUE(runs_until(BUSHD_PROGRAM_LOADED, mcu.value));
    begun = master->earliest_program_start(now_us(), mcus);
    for (const McuIndex mcu : mcus) master->run_program(mcu, 1, begun);
    for (const McuIndex mcu : mcus) ASSERT_TRUE(runs_until(BUSHD_PROGRAM_WAITS, mcu.value));
    EXPECT_LT(master->tick_at(now_us()), begun);
  }
  // At rest: what pins have made is what is counted, here and there.
  void expect_counted() {
    run_for(0.3);
    for (std::size_t i = 0; i < setup.mcus.size(); ++i) {
      for (std::uint8_t m = 0; m < 4; ++m) {
        const std::int32_t counted = report(i).motor[m].position_steps;
        EXPECT_EQ(line.mcu(i).core().motor[m].position_steps, counted);
        EXPECT_EQ((position[{i, m}]), counted);
      }
    }
  }
  sim::TimeNs first_step_ns(std::size_t mcu, std::uint8_t motor) const {
    return steps.at({mcu, motor}).front();
  }
  // Between the steps of a motor, in slots.
  std::vector<std::int64_t> intervals(std::size_t mcu, std::uint8_t motor) const {
    const std::vector<sim::TimeNs>& times = steps.at({mcu, motor});
    std::vector<std::int64_t> between;
    for (std::size_t i = 1; i < times.size(); ++i) {
      between.push_back((times[i] - times[i - 1] + kSlotNs / 2) / kSlotNs);
    }
    return between;
  }

  link::BusSetup setup;
  sim::Bus line{500'000, this};
  std::unique_ptr<link::Rs485Master> master;
  link::Tick begun = 0;
  int online = 0;  // McuOnline of this master
  int refused = 0;
  std::map<std::pair<std::size_t, std::uint8_t>, std::vector<sim::TimeNs>> steps;
  std::map<std::pair<std::size_t, std::uint8_t>, std::int32_t> position;

 private:
  void edge(const sim::Edge& edge) override {
    const std::pair motor{edge.mcu, edge.index};
    if (edge.signal == sim::Signal::kDir) forward_[motor] = edge.level;
    if (edge.signal != sim::Signal::kStep || !edge.level) return;
    steps[motor].push_back(edge.time_ns);
    position[motor] += forward_[motor] ? 1 : -1;
  }
  void settled(sim::TimeNs) override {}

  void take_events() {
    for (const link::Event& event : master->take_events()) {
      online += std::holds_alternative<link::McuOnline>(event) ? 1 : 0;
      refused += std::holds_alternative<link::RequestRefused>(event) ? 1 : 0;
    }
  }
  void advance(sim::TimeNs limit_ns) {
    line.master_send(master->step(now_us()), now_ns_);
    take_events();
    const sim::TimeNs wake_us = std::min(master->next_wake_us(), limit_ns / 1000 + 1);
    const sim::TimeNs next_ns = std::min(std::max(wake_us * 1000, now_ns_ + 1000),
                                         std::max(line.next_event_ns(), now_ns_ + 1));
    now_ns_ = std::min(next_ns, std::max(limit_ns, now_ns_ + 1));
    line.advance_to(now_ns_);
    if (received_.empty()) return;
    master->receive(now_us(), std::exchange(received_, {}));
    take_events();
  }

  std::vector<std::uint16_t> codes_;
  bushd_table table_{};
  NoTicks source_;
  Bytes received_;
  std::map<std::pair<std::size_t, std::uint8_t>, bool> forward_;
  sim::TimeNs now_ns_ = 0;
};

constexpr McuIndex kMcu{0};

TEST(ProgramOnCore, IsRunPausedResumedAndStopped) {
  CoreBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.load_and_run(to_and_fro(0)));
  ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_RUNS));
  EXPECT_EQ(bus.state().start_tick, static_cast<std::uint32_t>(bus.begun));
  ASSERT_TRUE(bus.run_until([&] { return bus.state().repeats == 2; }));
  bus.master->pause_program(kMcu);
  ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_PAUSED));
  const auto at_rest = bus.position;
  bus.run_for(2);
  EXPECT_EQ(bus.position, at_rest);
  bus.master->resume_program(kMcu);
  ASSERT_TRUE(bus.run_until([&] { return bus.state().repeats == 4; }));
  bus.master->stop_program(kMcu, BUSHD_STOP_RAMP);
  ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_ENDED));
  EXPECT_EQ(bus.state().reason, BUSHD_PROGRAM_STOPPED);
  EXPECT_EQ(bus.report().faults, 0);
  EXPECT_EQ(bus.refused, 0);
  bus.expect_counted();
}

TEST(ProgramOnCore, BeginsInOneTickOnAllMcus) {
  CoreBus bus({-30, 0, 50});
  ASSERT_NO_FATAL_FAILURE(bus.load_and_run(to_and_fro(0, 5)));
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_ENDED, i, 30));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(bus.state(i).reason, BUSHD_PROGRAM_DONE);
    for (const std::uint8_t m : {std::uint8_t{0}, std::uint8_t{1}}) {
      EXPECT_EQ(bus.intervals(i, m), bus.intervals(0, m));
      // As well as the line tells the time: SYNC_NOISE_NS of both, and drift between SYNCs.
      EXPECT_LT(std::abs(bus.first_step_ns(i, m) - bus.first_step_ns(0, m)), 100'000);
    }
  }
  bus.expect_counted();
}

TEST(ProgramOnCore, EndsInSilenceUnlessItSaysOtherwise) {
  for (const bool without_host : {false, true}) {
    CoreBus bus;
    ASSERT_NO_FATAL_FAILURE(bus.load_and_run(
        to_and_fro(without_host ? std::uint8_t{BUSHD_PROGRAM_WITHOUT_HOST} : std::uint8_t{0})));
    bus.run_for(1);
    bus.be_silent(3);
    bus.run_for(1);
    if (without_host) {
      EXPECT_EQ(bus.state().stage, BUSHD_PROGRAM_RUNS);
      EXPECT_EQ(bus.report().faults, 0);
      bus.master->stop_program(kMcu, BUSHD_STOP_RAMP);
      ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_ENDED));
    } else {
      EXPECT_EQ(bus.state().stage, BUSHD_PROGRAM_ENDED);
      EXPECT_EQ(bus.state().reason, BUSHD_PROGRAM_SILENCE);
      EXPECT_EQ(bus.report().faults, BUSHD_FAULT_LINK);
    }
    bus.expect_counted();
  }
}

// A host that begins anew, once at once and once after long, finds the program, and not a step
// differs from what is made while the host never went.
TEST(ProgramOnCore, AHostThatComesBackAdoptsItWithoutDisturbingAStep) {
  CoreBus undisturbed({-20, 20});
  ASSERT_NO_FATAL_FAILURE(undisturbed.load_and_run(to_and_fro(BUSHD_PROGRAM_WITHOUT_HOST)));
  undisturbed.run_for(12);
  for (const double away_s : {0.05, 5.0}) {
    SCOPED_TRACE(away_s);
    CoreBus bus({-20, 20});
    ASSERT_NO_FATAL_FAILURE(bus.load_and_run(to_and_fro(BUSHD_PROGRAM_WITHOUT_HOST)));
    bus.run_for(1);
    bus.be_silent(away_s);
    bus.begin_master();
    ASSERT_TRUE(bus.run_until([&] { return bus.all_online(); }, 5));
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(bus.state(i).stage, BUSHD_PROGRAM_RUNS);
      EXPECT_EQ(bus.report(i).faults, 0);
      EXPECT_EQ(bus.report(i).moving & kMotors, kMotors);
      EXPECT_EQ(bus.report(i).autonomous, kMotors);
    }
    bus.run_until([&] { return bus.now_us() >= undisturbed.now_us(); }, 12);
    EXPECT_EQ(bus.online, 2) << "and stay so";
    for (std::size_t i = 0; i < 2; ++i) {
      for (const std::uint8_t m : {std::uint8_t{0}, std::uint8_t{1}}) {
        auto made = bus.intervals(i, m);
        auto expected = undisturbed.intervals(i, m);
        // Clocks of both runs follow other SYNCs, by less than a step.
        const std::size_t common = std::min(made.size(), expected.size());
        ASSERT_GE(common + 1, std::max(made.size(), expected.size()));
        made.resize(common);
        expected.resize(common);
        EXPECT_EQ(made, expected);
      }
      bus.master->stop_program({i}, BUSHD_STOP_RAMP);
    }
    for (std::size_t i = 0; i < 2; ++i) ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_ENDED, i));
    bus.expect_counted();
    EXPECT_EQ(bus.online, 4) << "with all of their setup";
  }
}

// Another master, which the first MCU does not hear, has told the second one another time.
void say_other_time(CoreBus& bus) {
  const bushd_mcu& core = bus.line.mcu(1).core();
  bus.line.deafen(0, (bus.now_us() + 3'000'000) * 1000);
  for (std::uint32_t id = 1; id < 40; ++id) {
    const bushd_sync sync = {.master = 777,
                             .sync_id = id,
                             .follows = id > 1,
                             .follow_up_id = id > 1 ? id - 1 : 0,
                             .sync_tick = core.clock.sync_tick + 40,
                             .sync_ns = core.clock.sync_ns};
    if (static_cast<std::int32_t>(core.tick - bus.line.mcu(0).core().tick) < 30) bus.say(sync);
    bus.be_silent(0.05);
  }
  ASSERT_GT(static_cast<std::int32_t>(core.tick - bus.line.mcu(0).core().tick), 30);
  bus.be_silent(2);
}

// It gets into step while its motors rest, and goes online then.
TEST(ProgramOnCore, AnMcuWithAnotherTimeComesIntoStepAndTheProgramGoesOn) {
  CoreBus bus({0, 0});
  ASSERT_NO_FATAL_FAILURE(bus.load_and_run(to_and_fro(BUSHD_PROGRAM_WITHOUT_HOST)));
  bus.run_for(0.5);
  ASSERT_NO_FATAL_FAILURE(say_other_time(bus));
  bus.begin_master();
  bool waited = false;
  ASSERT_TRUE(bus.run_until(
      [&] {
        waited |= bus.master->view({1}).detail.find("its clock is not") != std::string::npos;
        // Nobody takes its ticks for those of the bus.
        if (bus.master->time_known()) {
          EXPECT_LE(bus.master->tick_at(bus.now_us()), bus.line.mcu(0).core().tick);
        }
        return bus.all_online();
      },
      10));
  EXPECT_EQ(bus.line.mcu(0).core().tick, bus.line.mcu(1).core().tick);
  EXPECT_TRUE(waited);
  bus.run_for(5);
  EXPECT_EQ(bus.online, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(bus.state(i).stage, BUSHD_PROGRAM_RUNS);
    EXPECT_EQ(bus.report(i).faults, 0);
    EXPECT_NE(bus.report(i).flags & BUSHD_FLAG_SYNCED, 0);
  }
  EXPECT_EQ(bus.line.mcu(0).core().tick, bus.line.mcu(1).core().tick);
  for (std::size_t i = 0; i < 2; ++i) bus.master->stop_program({i}, BUSHD_STOP_RAMP);
  for (std::size_t i = 0; i < 2; ++i) ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_ENDED, i));
  bus.expect_counted();
}

TEST(ProgramOnCore, AHostWithAnotherConfigurationLeavesItAlone) {
  for (const bool other_tables : {true, false}) {
    CoreBus bus;
    ASSERT_NO_FATAL_FAILURE(bus.load_and_run(to_and_fro(BUSHD_PROGRAM_WITHOUT_HOST)));
    bus.run_for(1);
    if (other_tables) {
      bus.setup.mcus[0].tables[0].revision = 8;
    } else {
      bus.setup.mcus[0].emission.settings.dir_setup_us = 20;
    }
    bus.begin_master();
    bus.run_for(3);
    EXPECT_FALSE(bus.all_online());
    EXPECT_THAT(bus.master->view(kMcu).detail,
                testing::HasSubstr("runs a program of another configuration"));
    EXPECT_EQ(bus.state().stage, BUSHD_PROGRAM_RUNS);
    EXPECT_EQ(bus.report().faults, 0);
    bus.master->stop_program(kMcu, BUSHD_STOP_RAMP);
    ASSERT_TRUE(bus.run_until([&] { return bus.all_online(); }));
    EXPECT_EQ(bus.state().reason, BUSHD_PROGRAM_STOPPED);
    bus.expect_counted();
  }
}

// INPUTS are refused while it runs.
TEST(ProgramOnCore, WhatCannotBeToldBesideItIsToldWhenItHasEnded) {
  CoreBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.load_and_run(to_and_fro(BUSHD_PROGRAM_WITHOUT_HOST, 8)));
  bus.setup.mcus[0].inputs.limit_positive = 0b1000;
  bus.begin_master();
  ASSERT_TRUE(bus.run_until([&] { return bus.all_online(); }, 3));
  EXPECT_EQ(bus.line.mcu(0).core().inputs.limit_positive, 0);
  ASSERT_TRUE(bus.run_until([&] { return bus.online == 2; }, 30));
  EXPECT_EQ(bus.state().reason, BUSHD_PROGRAM_DONE);
  EXPECT_EQ(bus.line.mcu(0).core().inputs.limit_positive, 0b1000);
  bus.expect_counted();
}

TEST(ProgramOnCore, AnEmergencyStopEndsItAndCannotBeOvertakenByARun) {
  CoreBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.load_and_run(to_and_fro(BUSHD_PROGRAM_WITHOUT_HOST)));
  bus.run_for(1);
  bus.master->resume_program(kMcu);
  bus.master->emergency_stop(BUSHD_STOP_RAMP);
  ASSERT_TRUE(bus.runs_until(BUSHD_PROGRAM_ENDED));
  EXPECT_EQ(bus.state().reason, BUSHD_PROGRAM_FAULT);
  bus.expect_counted();
}

}  // namespace
}  // namespace bushd::test
