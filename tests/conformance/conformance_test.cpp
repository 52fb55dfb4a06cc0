// The image of a real MCU beside a virtual one on one bus: what a master says to one it says to the
// other, and both must answer and move alike.
#include <cstdlib>
#include <string>

#include "conformance/targets.h"
#include "sim/bus_fixture.h"
#include "sim/random.h"

namespace bushd::sim {
namespace {

constexpr std::uint32_t kBaud = 500'000;
constexpr std::uint32_t kTickNs = 2'560'000;
constexpr std::uint8_t kVirtual = 1;
constexpr std::uint8_t kReal = 2;
constexpr Birth kBirth{kReal, 0x0102030405060708, 6};
constexpr std::uint32_t kUnitNs = 10'000;
constexpr std::uint16_t kCruise = 90;

std::vector<std::uint16_t> ramp() {
  std::vector<std::uint16_t> codes;
  for (std::uint16_t code = 400; code > kCruise; code = static_cast<std::uint16_t>(code * 9 / 10)) {
    codes.push_back(code);
  }
  return codes;
}

class Script : public testing::Test {
 protected:
  explicit Script(const Target& target)
      : real_(target.make()), bus_(kBaud, &recorder_), master_(bus_) {
    McuOptions like_it = real_->twin();
    like_it.address = kVirtual;
    bus_.add_mcu(like_it);
    bus_.add_mcu([this](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
      return real_->make(kBirth, index, driver, sink);
    });
    master_.patience_ns = 6'000'000;
    bus_.advance_to(250'000'000);  // a boot takes its time
  }

  void TearDown() override {
    real_->expect_unharmed();
    EXPECT_EQ(bus_.collisions(), 0u);
    EXPECT_EQ(master_.bad_frames, 0);
  }

  void make_ready(bushd_format format, const std::vector<std::uint8_t>& motors) {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(tick_ns_, format));
    ASSERT_NO_FATAL_FAILURE(give_tables(motors));
  }

  void give_tables(const std::vector<std::uint8_t>& motors) {
    for (const std::uint8_t address : {kVirtual, kReal}) {
      ASSERT_NO_FATAL_FAILURE(master_.upload_table(address, 0, kUnitNs, codes_, kCruise));
      for (const std::uint8_t motor : motors) {
        ASSERT_NO_FATAL_FAILURE(master_.assign(address, motor, 0));
      }
    }
  }

  void pass_ticks(int ticks) { bus_.advance_to(bus_.now_ns() + TimeNs{tick_ns_} * ticks); }

  // The same request to both; it is no question.
  void tell(bushd_type type, const Bytes& payload) {
    master_.send(kVirtual, static_cast<std::uint8_t>(type), payload);
    master_.send(kReal, static_cast<std::uint8_t>(type), payload);
  }

  bushd_table table() const {
    bushd_table view{};
    view.accel.code = view.decel.code = codes_.data();
    view.accel.count = view.decel.count = static_cast<std::uint32_t>(codes_.size());
    view.cruise = kCruise;
    view.time_unit_ns = kUnitNs;
    return view;
  }

  void run_by_table(std::uint32_t first, const std::vector<bushd_table_run_entry>& entries) {
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(bushd_encode_table_run(
        0, first, entries.data(), static_cast<std::uint8_t>(entries.size()), payload.data()));
    tell(BUSHD_MSG_TABLE_RUN, payload);
  }

  // A move streamed in frames of `count` ticks; of every three one is a state of the run.
  void stream(std::uint8_t motor, std::uint32_t first, std::uint32_t steps, int direction,
              bushd_format format) {
    const bushd_table view = table();
    bushd_run run;
    bushd_run_start(&run, &view, steps, direction);
    std::uint8_t flags = BUSHD_TICKS_START;
    if (format == BUSHD_FORMAT_FINE) flags |= BUSHD_TICKS_FINE;
    constexpr std::uint8_t kCount = 12;
    for (int frame = 0; !bushd_run_done(&run); ++frame) {
      while (static_cast<std::int32_t>(first - master_.poll(kReal).tick) > 40) pass_ticks(4);
      Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
      const bushd_table_ticks_entry entry{motor, bushd_run_save(&run, tick_ns_, kCount)};
      std::array<std::int16_t, kCount> fine;
      std::array<std::uint8_t, kCount> coarse;
      if (format == BUSHD_FORMAT_FINE) {
        bushd_run_expand_fine(&run, tick_ns_, kCount, fine.data(), 1);
      } else {
        bushd_run_expand_coarse(&run, tick_ns_, kCount, coarse.data(), 1);
      }
      if (frame % 3 == 1) {
        const auto state_flags = static_cast<std::uint8_t>(flags & ~BUSHD_TICKS_FINE);
        payload.resize(
            bushd_encode_table_ticks(0, state_flags, first, kCount, &entry, 1, payload.data()));
        tell(BUSHD_MSG_TABLE_TICKS, payload);
      } else {
        const std::uint16_t delay = bushd_run_delay(&run);
        std::size_t size = bushd_encode_ticks_head(0, flags, first, kCount,
                                                   static_cast<std::uint16_t>(1u << motor), &delay,
                                                   payload.data());
        for (std::size_t i = 0; i < kCount; ++i) {
          if (format == BUSHD_FORMAT_FINE) {
            bushd_put_i16(payload.data() + size, fine[i]);
            size += 2;
          } else {
            payload[size++] = coarse[i];
          }
        }
        payload.resize(size);
        tell(BUSHD_MSG_TICKS, payload);
      }
      first += kCount;
      flags = static_cast<std::uint8_t>(flags & ~BUSHD_TICKS_START);
    }
  }

  // When this output rises, or changes at all, each time with the common DIR.
  struct Change {
    TimeNs time_ns;
    bool level;
    bool common_dir;
  };
  std::vector<Change> changes(std::size_t mcu, std::uint8_t output, bool rises_only,
                              TimeNs from_ns) const {
    std::vector<Change> out;
    bool common_dir = false;
    for (const Edge& edge : recorder_.edges) {
      if (edge.mcu != mcu) continue;
      if (edge.signal == Signal::kCommonDir) common_dir = edge.level;
      if (edge.signal != Signal::kStep || edge.index != output) continue;
      if (edge.time_ns < from_ns) continue;
      if (edge.level || !rises_only) out.push_back({edge.time_ns, edge.level, common_dir});
    }
    return out;
  }

  // In the same slots: to one of them, and alike for all to half of one.
  void expect_the_same_changes(std::uint8_t output, bool rises_only, TimeNs from_ns) {
    SCOPED_TRACE("output " + std::to_string(output));
    const auto expected = changes(0, output, rises_only, from_ns);
    const auto made = changes(1, output, rises_only, from_ns);
    ASSERT_EQ(made.size(), expected.size());
    ASSERT_FALSE(made.empty());
    const TimeNs slot_ns = tick_ns_ / real_->twin().slots;
    TimeNs least_ns = kNever;
    TimeNs most_ns = -kNever;
    for (std::size_t i = 0; i < made.size(); ++i) {
      EXPECT_EQ(made[i].level, expected[i].level) << i;
      EXPECT_EQ(made[i].common_dir, expected[i].common_dir) << i;
      least_ns = std::min(least_ns, made[i].time_ns - expected[i].time_ns);
      most_ns = std::max(most_ns, made[i].time_ns - expected[i].time_ns);
    }
    EXPECT_LE(most_ns - least_ns, slot_ns / 2);
    EXPECT_LE(std::max(std::abs(most_ns), std::abs(least_ns)), slot_ns);
  }

  // Its pulses, each with the level of DIR.
  struct Step {
    TimeNs time_ns;
    bool positive;
  };
  std::vector<Step> steps(std::size_t mcu, std::uint8_t motor) const {
    std::vector<Step> out;
    bool direction = false;
    for (const Edge& edge : recorder_.edges) {
      if (edge.mcu != mcu || edge.index != motor) continue;
      if (edge.signal == Signal::kDir) direction = edge.level;
      if (edge.signal == Signal::kStep && edge.level) out.push_back({edge.time_ns, direction});
    }
    return out;
  }

  // In number and direction.
  void expect_the_same_steps(std::uint8_t motor, std::size_t count) {
    SCOPED_TRACE("motor " + std::to_string(motor));
    const auto expected = steps(0, motor);
    const auto made = steps(1, motor);
    ASSERT_EQ(expected.size(), count);
    ASSERT_EQ(made.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(made[i].positive, expected[i].positive) << "step " << i;
    }
  }

  // The slots are the same: what steps differ by is alike for all, to half a slot.
  void expect_the_same_times(std::uint8_t motor) {
    const auto expected = steps(0, motor);
    const auto made = steps(1, motor);
    const TimeNs slot_ns = tick_ns_ / real_->twin().slots;
    TimeNs least_ns = kNever;
    TimeNs most_ns = -kNever;
    for (std::size_t i = 0; i < std::min(made.size(), expected.size()); ++i) {
      least_ns = std::min(least_ns, made[i].time_ns - expected[i].time_ns);
      most_ns = std::max(most_ns, made[i].time_ns - expected[i].time_ns);
    }
    EXPECT_LE(most_ns - least_ns, slot_ns / 2);
    EXPECT_LE(std::max(std::abs(most_ns), std::abs(least_ns)), slot_ns);
  }

  void expect_the_same_reports() {
    const bushd_report expected = master_.poll(kVirtual);
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(report.state, expected.state);
    EXPECT_EQ(report.faults, expected.faults);
    EXPECT_EQ(report.flags, expected.flags);
    EXPECT_EQ(report.epoch, expected.epoch);
    EXPECT_EQ(report.moving, expected.moving);
    EXPECT_EQ(report.running, expected.running);
    EXPECT_EQ(report.inputs, expected.inputs);
    EXPECT_EQ(report.bad_frames, expected.bad_frames);
    EXPECT_EQ(report.rejected_frames, expected.rejected_frames);
    EXPECT_EQ(report.last_rejection, expected.last_rejection);
    EXPECT_EQ(report.run_downs, expected.run_downs);
    EXPECT_EQ(report.motor_count, expected.motor_count);
    for (std::size_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      EXPECT_EQ(report.motor[m].position_steps, expected.motor[m].position_steps) << "motor " << m;
    }
  }

  const std::unique_ptr<McuUnderTest> real_;
  const std::vector<std::uint16_t> codes_ = ramp();
  std::uint32_t tick_ns_ = kTickNs;
  Recorder recorder_;
  Bus bus_;
  Master master_;
};

class Conformance : public Script, public testing::WithParamInterface<Target> {
 protected:
  Conformance() : Script(GetParam()) {}
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Conformance);
INSTANTIATE_TEST_SUITE_P(Of, Conformance, testing::ValuesIn(targets()),
                         [](auto& target) { return target.param.name; });

TEST_P(Conformance, TellsWhoItIs) {
  const auto identity_of = [this](std::uint8_t address) {
    bushd_identity identity{};
    const auto reply = master_.identify(address);
    if (!reply || bushd_decode_identity(reply->payload.data(), reply->payload.size(), &identity) !=
                      BUSHD_OK) {
      ADD_FAILURE() << "no identity of " << int{address};
    }
    return identity;
  };
  const bushd_identity expected = identity_of(kVirtual);
  const bushd_identity identity = identity_of(kReal);
  EXPECT_EQ(identity.protocol_version, BUSHD_PROTOCOL_VERSION);
  EXPECT_EQ(identity.motors, 16);
  EXPECT_EQ(identity.boot_number, 7);
  EXPECT_EQ(identity.slots, expected.slots);
  EXPECT_EQ(identity.queue_ticks, expected.queue_ticks);
  EXPECT_EQ(identity.table_codes, expected.table_codes);
  EXPECT_EQ(identity.capabilities, expected.capabilities & ~real_->lacks());
  EXPECT_EQ(identity.unique_id[0], 8);
  EXPECT_EQ(identity.unique_id[7], 1);
}

TEST_P(Conformance, KeepsItsNewAddressOverAReset) {
  bushd_set_address message{{8, 7, 6, 5, 4, 3, 2, 1}, 77};
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_set_address(&message, payload.data()));
  master_.send(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SET_ADDRESS, payload);
  EXPECT_TRUE(master_.identify(77));
  pass_ticks(40);
  bus_.reboot(1);
  pass_ticks(100);
  const auto reply = master_.identify(77);
  ASSERT_TRUE(reply);
  EXPECT_EQ(bushd_get_u16(reply->payload.data() + 4), 8) << "the next boot";
}

TEST_P(Conformance, IsSilentAndAliveAfterNoise) {
  for (int i = 0; i < 2000; ++i) {
    const auto byte = static_cast<std::uint8_t>(i * 7919 >> 3);
    bus_.master_send(Bytes{byte}, bus_.now_ns());
  }
  master_.drain();
  EXPECT_TRUE(master_.identify(kReal));
}

TEST_P(Conformance, RunsATableToTheSlot) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {9}));
  run_by_table(master_.poll(kReal).tick + 24, {{9, 0, -1, 110}});
  pass_ticks(160);
  expect_the_same_steps(9, 110);
  expect_the_same_times(9);
  expect_the_same_reports();
}

TEST_P(Conformance, RunsFourTablesAtOnceToTheSlot) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {0, 5, 9, 15}));
  const std::uint32_t first = master_.poll(kReal).tick + 60;
  run_by_table(first, {{0, 0, 1, 200}});
  run_by_table(first, {{5, 0, 1, 150}});
  run_by_table(first, {{9, 0, -1, 110}});
  run_by_table(first, {{15, 0, -1, 180}});
  pass_ticks(300);
  for (const auto& [motor, count] : {std::pair{0, 200}, {5, 150}, {9, 110}, {15, 180}}) {
    expect_the_same_steps(static_cast<std::uint8_t>(motor), static_cast<std::size_t>(count));
    expect_the_same_times(static_cast<std::uint8_t>(motor));
  }
  expect_the_same_reports();
}

class ConformanceOfStreams : public Script,
                             public testing::WithParamInterface<std::tuple<Target, bushd_format>> {
 protected:
  ConformanceOfStreams() : Script(std::get<Target>(GetParam())) {}
  bushd_format format() const { return std::get<bushd_format>(GetParam()); }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ConformanceOfStreams);
INSTANTIATE_TEST_SUITE_P(Of, ConformanceOfStreams,
                         testing::Combine(testing::ValuesIn(targets()),
                                          testing::Values(BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE)),
                         [](auto& test) {
                           const bool fine =
                               std::get<bushd_format>(test.param) == BUSHD_FORMAT_FINE;
                           return std::get<Target>(test.param).name + (fine ? "Fine" : "Coarse");
                         });

TEST_P(ConformanceOfStreams, MakesTheStepsOfTheVirtualOne) {
  ASSERT_NO_FATAL_FAILURE(make_ready(format(), {3}));
  stream(3, master_.poll(kReal).tick + 32, 120, 1, format());
  pass_ticks(80);
  stream(3, master_.poll(kReal).tick + 32, 80, -1, format());
  pass_ticks(80);
  expect_the_same_steps(3, 200);
  expect_the_same_reports();
}

// Sixteen motors at any speeds, to and fro, up to the fastest: in the very slots.
TEST_P(ConformanceOfStreams, StepsOfAllMotorsFallIntoTheSlotsOfTheVirtualOne) {
  const bool fine = format() == BUSHD_FORMAT_FINE;
  tick_ns_ = real_->full_tick_ns(format());
  std::vector<std::uint8_t> motors;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) motors.push_back(m);
  ASSERT_NO_FATAL_FAILURE(make_ready(format(), motors));
  Random random(7, 0);
  const std::uint32_t start = master_.poll(kReal).tick + 24;
  const TimeNs begin_ns = bus_.now_ns();
  std::array<std::uint16_t, BUSHD_MOTORS_PER_MCU> delays;
  constexpr std::uint8_t kCount = 2;
  constexpr std::uint32_t kFrames = 30;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    delays.fill(frame + 1 < kFrames ? kCruise : 0);
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    const auto flags = static_cast<std::uint8_t>((frame == 0 ? BUSHD_TICKS_START : 0) |
                                                 (fine ? BUSHD_TICKS_FINE : 0));
    std::size_t size = bushd_encode_ticks_head(0, flags, start + frame * kCount, kCount, 0xFFFF,
                                               delays.data(), payload.data());
    for (std::size_t i = 0; i < kCount * motors.size(); ++i) {
      const auto steps = static_cast<std::uint8_t>(random.below(128));
      const bool back = random.below(2) == 0;
      if (fine) {
        int size_256 = steps * 256;
        if (random.below(3) != 0) size_256 = static_cast<int>(random.below(32'513));
        bushd_put_i16(payload.data() + size,
                      static_cast<std::int16_t>(back ? -size_256 : size_256));
        size += 2;
      } else {
        payload[size++] = static_cast<std::uint8_t>(steps | (back ? 0 : BUSHD_COARSE_DIRECTION));
      }
    }
    payload.resize(size);
    for (const std::uint8_t address : {kVirtual, kReal}) {
      master_.post(address, BUSHD_MSG_TICKS, payload);
    }
    bus_.advance_to(begin_ns + TimeNs{tick_ns_} * kCount * (frame + 1));
  }
  pass_ticks(60);
  for (const std::uint8_t motor : motors) {
    EXPECT_GT(steps(0, motor).size(), 1000u);
    expect_the_same_steps(motor, steps(0, motor).size());
    expect_the_same_times(motor);
  }
  expect_the_same_reports();
}

struct Mode {
  std::string name;
  std::uint16_t needs;
  bushd_emission settings;
};

class ConformanceOfEmission : public Script,
                              public testing::WithParamInterface<std::tuple<Target, Mode>> {
 protected:
  ConformanceOfEmission() : Script(std::get<Target>(GetParam())) {}
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ConformanceOfEmission);

std::vector<Mode> modes() {
  const auto mode = [](bushd_emission_mode of) {
    bushd_emission settings{};
    settings.mode = of;
    settings.step_us = 600;
    settings.settle_us = 60;
    settings.sequence = BUSHD_PHASES_HALF;
    settings.hold_current = true;
    return settings;
  };
  return {{"Burst", BUSHD_CAN_BURST, mode(BUSHD_EMISSION_BURST)},
          {"CommonDir", BUSHD_CAN_COMMON_DIR, mode(BUSHD_EMISSION_COMMON_DIR)},
          {"Staggered", BUSHD_CAN_STAGGERED, mode(BUSHD_EMISSION_STAGGERED)},
          {"Phases", BUSHD_CAN_PHASES, mode(BUSHD_EMISSION_PHASES)}};
}

void PrintTo(const Mode& mode, std::ostream* out) {
  *out << mode.name;
}

INSTANTIATE_TEST_SUITE_P(Of, ConformanceOfEmission,
                         testing::Combine(testing::ValuesIn(targets()), testing::ValuesIn(modes())),
                         [](auto& test) {
                           return std::get<Target>(test.param).name +
                                  std::get<Mode>(test.param).name;
                         });

// Four motors to and fro, in streams, where every output changes at the same slots.
TEST_P(ConformanceOfEmission, ChangesOutputsInTheSlotsOfTheVirtualOne) {
  const Mode& mode = std::get<Mode>(GetParam());
  const bool phases = mode.settings.mode == BUSHD_EMISSION_PHASES;
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(tick_ns_, BUSHD_FORMAT_COARSE));
  for (const std::uint8_t address : {kVirtual, kReal}) {
    const bool refuses = address == kReal && (real_->lacks() & mode.needs) != 0;
    EXPECT_EQ(master_.acknowledged(address, BUSHD_MSG_EMISSION, bushd_encode_emission,
                                   mode.settings) == BUSHD_OK,
              !refuses);
    if (refuses) return;
  }
  ASSERT_NO_FATAL_FAILURE(give_tables({0, 1, 2, 3}));
  // Windings are on by now.
  const TimeNs begin_ns = bus_.now_ns();
  const std::uint32_t first = master_.poll(kReal).tick + 40;
  constexpr std::uint8_t kCount = 8;
  const std::array<std::uint16_t, 4> at_rest{};
  for (std::uint32_t frame = 0; frame < 4; ++frame) {
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(bushd_encode_ticks_head(0, BUSHD_TICKS_START, first + 12 * frame, kCount, 0xF,
                                           at_rest.data(), payload.data()));
    for (std::uint32_t i = 0; i < kCount * 4u; ++i) {
      const std::uint32_t motor = i % 4;
      const bool forward = (motor + frame) % 2 == 0;
      payload.push_back(static_cast<std::uint8_t>((1 + (i + frame) % 2) |
                                                  (forward ? BUSHD_COARSE_DIRECTION : 0)));
    }
    tell(BUSHD_MSG_TICKS, payload);
  }
  pass_ticks(120);
  for (std::uint8_t output = 0; output < (phases ? 16 : 4); ++output) {
    expect_the_same_changes(output, !phases, begin_ns);
  }
  expect_the_same_reports();
}

}  // namespace
}  // namespace bushd::sim
