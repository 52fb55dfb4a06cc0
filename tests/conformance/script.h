// The image of a real MCU beside its virtual twin on one bus: what a master says to one it says to
// the other, and both must answer and move alike.
#pragma once

#include <cstdlib>
#include <map>
#include <memory>
#include <string>

#include "conformance/targets.h"
#include "sim/bus_fixture.h"

namespace bushd::sim {

constexpr std::uint32_t kBaud = 500'000;
constexpr std::uint32_t kTickNs = 2'560'000;
constexpr std::uint8_t kVirtual = 1;
constexpr std::uint8_t kReal = 2;
constexpr Birth kBirth{kReal, 0x0102030405060708, 6};
constexpr std::uint32_t kUnitNs = 10'000;
constexpr std::uint16_t kCruise = 90;

inline std::vector<std::uint16_t> ramp() {
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
    bus_.advance_to(300'000'000);  // a boot takes its time
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

  // One that the MCU has, of sixteen: also of inputs.
  std::uint8_t own(int number) const {
    return static_cast<std::uint8_t>(number % real_->twin().motors);
  }

  // Inputs are looked at once a tick: they change for both in the same one.
  void to_inputs_time() { bus_.advance_to(bus_.node(0).next_event_ns() + TimeNs{kTickNs} * 3 / 4); }

  void pass_ticks(int ticks) { bus_.advance_to(bus_.now_ns() + TimeNs{tick_ns_} * ticks); }

  // The same request to both, and what both answer.
  template <class Message>
  void ask(const Message& message, bushd_status answer = BUSHD_OK) {
    const test::Request request = test::request_of(message);
    ASSERT_NO_FATAL_FAILURE(ask(request.type, request.payload, answer));
  }
  void ask(std::uint8_t type, const Bytes& payload, bushd_status answer = BUSHD_OK) {
    for (const std::uint8_t address : {kVirtual, kReal}) {
      ASSERT_EQ(master_.acknowledged(address, type, payload), answer);
    }
  }

  // What the pins of both say from now on.
  void set_inputs(bushd_inputs inputs) {
    for (const std::size_t mcu : {0, 1}) bus_.node(mcu).set_inputs(inputs);
  }

  // The same request to both; it is no question.
  void tell(std::uint8_t type, const Bytes& payload) {
    master_.send(kVirtual, type, payload);
    master_.send(kReal, type, payload);
  }

  // To both within one tick: from then on they go together.
  void home(const bushd_home& message) {
    bus_.advance_to(bus_.node(0).next_event_ns());
    for (const std::uint8_t address : {kVirtual, kReal}) {
      master_.post(address, BUSHD_MSG_HOME, test::request_of(message).payload);
      bus_.advance_to(bus_.now_ns() + 1'000'000);
    }
  }

  bushd_table table() const {
    bushd_table view{};
    view.accel.code = view.decel.code = codes_.data();
    view.accel.count = view.decel.count = static_cast<std::uint16_t>(codes_.size());
    view.cruise = kCruise;
    view.time_unit_ns = kUnitNs;
    return view;
  }

  void run_by_table(std::uint32_t first, const std::vector<bushd_table_run_entry>& entries) {
    tell(BUSHD_MSG_TABLE_RUN, payload_of([&](std::uint8_t* to) {
           return bushd_encode_table_run(0, first, entries.data(),
                                         static_cast<std::uint8_t>(entries.size()), to);
         }));
  }

  // A move streamed in frames of `count` ticks; of every three one is a state of the run.
  void stream(std::uint8_t motor, std::uint32_t first, std::uint32_t steps, int direction,
              bushd_format format) {
    const bushd_table view = table();
    bushd_run run;
    bushd_run_start(&run, &view, steps, direction, 0);
    std::uint8_t flags = BUSHD_TICKS_START;
    if (format == BUSHD_FORMAT_FINE) flags |= BUSHD_TICKS_FINE;
    constexpr std::uint8_t kCount = 12;
    for (int frame = 0; !bushd_run_done(&run); ++frame) {
      while (static_cast<std::int32_t>(first - master_.poll(kReal).tick) > 40) pass_ticks(4);
      const bushd_table_ticks_entry entry{motor, bushd_run_save(&run, tick_ns_, kCount)};
      std::vector<std::int16_t> displacements(kCount);
      if (format == BUSHD_FORMAT_FINE) {
        bushd_run_expand_fine(&run, tick_ns_, kCount, displacements.data(), 1);
      } else {
        Bytes coarse(kCount);
        bushd_run_expand_coarse(&run, tick_ns_, kCount, coarse.data(), 1);
        displacements.assign(coarse.begin(), coarse.end());
      }
      if (frame % 3 == 1 && (real_->twin().disabled_capabilities & BUSHD_CAN_TABLE_TICKS) == 0) {
        const auto state_flags = static_cast<std::uint8_t>(flags & ~BUSHD_TICKS_FINE);
        tell(BUSHD_MSG_TABLE_TICKS, payload_of([&](std::uint8_t* to) {
               return bushd_encode_table_ticks(0, state_flags, first, kCount, &entry, 1, to);
             }));
      } else {
        tell(BUSHD_MSG_TICKS,
             test::ticks_payload({.flags = flags,
                                  .first = first,
                                  .count = kCount,
                                  .mask = static_cast<std::uint16_t>(1u << motor),
                                  .displacements = displacements,
                                  .delays = {static_cast<std::uint16_t>(bushd_run_delay(&run))}}));
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
      if (is_active(edge) || !rises_only) out.push_back({edge.time_ns, edge.level, common_dir});
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

  // What drivers are to see; of MCUs that were told so.
  bool is_active(const Edge& edge) const {
    const std::uint16_t low =
        edge.signal == Signal::kStep ? levels_.step_low : levels_.direction_low;
    return edge.level != ((low >> edge.index & 1) != 0);
  }

  // Its pulses, each with the direction.
  struct Step {
    TimeNs time_ns;
    bool positive;
  };
  std::vector<Step> steps(std::size_t mcu, std::uint8_t motor) const {
    std::vector<Step> out;
    bool direction = false;
    for (const Edge& edge : recorder_.edges) {
      if (edge.mcu != mcu || edge.index != motor) continue;
      if (edge.signal == Signal::kDir) direction = is_active(edge);
      if (edge.signal == Signal::kStep && is_active(edge)) out.push_back({edge.time_ns, direction});
    }
    return out;
  }

  // Its pulses from a time on.
  std::vector<TimeNs> steps_since(std::size_t mcu, std::uint8_t motor, TimeNs begin_ns) const {
    std::vector<TimeNs> found = recorder_.times(mcu, Signal::kStep, motor, true);
    std::erase_if(found, [&](TimeNs at_ns) { return at_ns < begin_ns; });
    return found;
  }
  // Where they have led it. Precondition: no edges were taken out of the recorder.
  std::int64_t position(std::size_t mcu, std::uint8_t motor) {
    Shaft& shaft = shafts_[{mcu, motor}];
    for (; shaft.seen < recorder_.edges.size(); ++shaft.seen) {
      const Edge& edge = recorder_.edges[shaft.seen];
      if (edge.mcu != mcu || edge.index != motor) continue;
      if (edge.signal == Signal::kDir) shaft.positive = edge.level;
      if (edge.signal == Signal::kStep && edge.level) shaft.position += shaft.positive ? 1 : -1;
    }
    return shaft.position;
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

  // The slots are the same: what two steps in a row differ by is alike, to half a slot. One in a
  // wrong slot would be off by a whole one. From step to step clocks drift by less; between two
  // looks they may have been set.
  void expect_the_same_times(std::uint8_t motor) {
    const auto expected = steps(0, motor);
    const auto made = steps(1, motor);
    const TimeNs slot_ns = tick_ns_ / real_->twin().slots;
    std::size_t& seen = seen_[motor];
    const std::size_t count = std::min(made.size(), expected.size());
    TimeNs most_ns = 0;
    TimeNs most_apart_ns = 0;
    for (std::size_t i = seen; i < count; ++i) {
      const TimeNs off_ns = made[i].time_ns - expected[i].time_ns;
      const TimeNs before_ns = i == seen ? off_ns : made[i - 1].time_ns - expected[i - 1].time_ns;
      most_ns = std::max(most_ns, std::abs(off_ns));
      most_apart_ns = std::max(most_apart_ns, std::abs(off_ns - before_ns));
    }
    EXPECT_LE(most_apart_ns, slot_ns / 2);
    EXPECT_LE(most_ns, slot_ns);
    seen = made.size();
  }

  void expect_alike(const std::vector<std::uint8_t>& motors) {
    for (const std::uint8_t motor : motors) {
      expect_the_same_steps(motor, steps(0, motor).size());
      expect_the_same_times(motor);
    }
    expect_the_same_reports();
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
    EXPECT_EQ(report.ramp_downs, expected.ramp_downs);
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
  FrameMaster master_;
  bushd_set_outputs levels_{};                // of the outputs of both
  std::map<std::uint8_t, std::size_t> seen_;  // steps of a motor, at the last look

 private:
  struct Shaft {
    std::size_t seen = 0;  // edges
    bool positive = false;
    std::int64_t position = 0;
  };
  std::map<std::pair<std::size_t, std::uint8_t>, Shaft> shafts_;  // by MCU and motor
};

class TargetScript : public Script, public testing::WithParamInterface<Target> {
 protected:
  TargetScript() : Script(GetParam()) {}
};

}  // namespace bushd::sim
