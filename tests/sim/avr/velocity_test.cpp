// The velocity loop on the image for the ATmega1284P. velocity_image.py judges what is written here
// by a model of the document: BUSHD_VELOCITY_TRACE names the file.
//
//   tick NS, slots N, motor M LEAST MOST ACCELERATION
//   inputs TICK BITS          pins that the MCU reads from the tick TICK on, bit 2 FORWARD, 4
//   REVERSE,
//                             256 a limit at the positive end of motor 0
//   at TICK NS                when this tick begins, on the bus, by the MCU's clock
//   step MOTOR NS SIGN        an edge of STEP, with DIR; none where the motor is driven by phases
//   counted MOTOR STEPS       what it says in the end
#include <cstdlib>
#include <fstream>
#include <map>

#include "sim/avr/avr_fixture.h"

namespace bushd::sim::velocity_test {
namespace {

class VelocityOfTheImage : public Atmega1284pAlone {
 protected:
  static constexpr std::uint16_t kLimit = 1;  // input 0

  VelocityOfTheImage() {
    if (const char* path = std::getenv("BUSHD_VELOCITY_TRACE")) {
      out_.open(path, std::ios::app);
      EXPECT_TRUE(out_);
    }
  }

  void set_up(const std::vector<bushd_set_velocity>& motors) {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    give_settings(motors);
  }
  void give_settings(const std::vector<bushd_set_velocity>& motors) {
    out_ << "tick " << kTickNs << "\nslots 128\n";
    std::uint16_t mask = 0;
    for (const bushd_set_velocity& motor : motors) {
      ASSERT_EQ(master_.acknowledged(kAddress, motor), BUSHD_OK);
      mask |= static_cast<std::uint16_t>(1u << motor.motor);
      out_ << "motor " << int{motor.motor} << ' ' << motor.least << ' ' << motor.most << ' '
           << motor.acceleration << '\n';
    }
    bushd_set_inputs inputs{};
    inputs.limit_positive = kLimit;
    ASSERT_EQ(master_.acknowledged(kAddress, inputs), BUSHD_OK);
    ASSERT_EQ(master_.acknowledged(kAddress, bushd_local{mask, 0, 0}), BUSHD_OK);
    tick_0_ns_ = tick_0_ns();
    out_ << "at 0 " << tick_0_ns_ << '\n';
    for (const Edge& edge : recorder_.edges) follow(edge);
    recorder_.edges.clear();
  }

  // The beginning of tick 0 by the MCU's clock, which notes the end of a SYNC.
  TimeNs tick_0_ns() {
    TimeNs heard_ns = 0;
    bus_.on_mcu_byte = [&](std::size_t, std::uint8_t, TimeNs end_ns) { heard_ns = end_ns; };
    master_.sync({});
    bus_.on_mcu_byte = nullptr;
    const bushd_report report = master_.poll(kAddress);
    return heard_ns - report.sync_ns - TimeNs{report.sync_tick} * kTickNs;
  }

  // Inputs are read once a tick, early in it: they change in the middle of one.
  void hold(std::uint8_t system, std::uint16_t switches, int ticks) {
    const std::int64_t tick = (bus_.now_ns() - tick_0_ns_) / kTickNs + 1;
    bus_.advance_to(tick_0_ns_ + tick * kTickNs + kTickNs / 2);
    bus_.node(0).set_inputs({switches, system});
    out_ << "inputs " << tick + 1 << ' ' << (system | switches << 8) << '\n';
    pass(TimeNs{kTickNs} * ticks);
  }

  void follow(const Edge& edge) {
    if (edge.signal == Signal::kDir) positive_[edge.index] = edge.level;
  }

  // After the motors have come to rest.
  void end(const std::vector<std::uint8_t>& motors, bool pulses = true) {
    pass(20'000'000);
    const bushd_report report = master_.poll(kAddress);
    EXPECT_EQ(report.moving, 0);
    EXPECT_EQ(report.faults, 0);
    EXPECT_LT(std::abs(tick_0_ns() - tick_0_ns_), 20'000) << "a tick was late";
    std::map<int, std::int64_t> steps;
    for (const Edge& edge : recorder_.edges) {
      follow(edge);
      if (!pulses || edge.signal != Signal::kStep || !edge.level) continue;
      const int sign = positive_[edge.index] ? 1 : -1;
      steps[edge.index] += sign;
      out_ << "step " << int{edge.index} << ' ' << edge.time_ns << ' ' << sign << '\n';
    }
    for (const std::uint8_t motor : motors) {
      if (pulses) {
        EXPECT_EQ(report.motor[motor].position_steps, steps[motor]);
      }
      out_ << "counted " << int{motor} << ' ' << report.motor[motor].position_steps << '\n';
    }
    out_ << "end\n";
  }

  TimeNs tick_0_ns_ = 0;
  std::map<int, bool> positive_;
  std::ofstream out_;
};

constexpr std::uint8_t kForward = BUSHD_INPUT_FORWARD;
constexpr std::uint8_t kReverse = BUSHD_INPUT_REVERSE;

// Both motors at once: held, released, pressed again on the ramp, turned by way of zero.
TEST_F(VelocityOfTheImage, MakesThePulsesOfTheDocument) {
  ASSERT_NO_FATAL_FAILURE(set_up({{0, 200 * 64, 3000 * 64, 6000}, {1, 150 * 64, 900 * 64, 1700}}));
  hold(kForward, 0, 330);
  hold(0, 0, 40);
  hold(kForward, 0, 60);
  hold(kReverse, 0, 520);
  hold(0, 0, 90);
  hold(kForward, 0, 150);
  hold(0, 0, 400);
  end({0, 1});
}

// So fast that a tick holds steps of both directions when it turns.
TEST_F(VelocityOfTheImage, TurnsAtATick) {
  ASSERT_NO_FATAL_FAILURE(set_up({{0, 4000 * 64, 6000 * 64, 40000}}));
  for (int i = 0; i < 6; ++i) {
    hold(kForward, 0, 100 + i);
    hold(kReverse, 0, 100);
  }
  hold(0, 0, 200);
  end({0});
}

// As fast as the image takes it, with both, and no faster.
TEST_F(VelocityOfTheImage, KeepsUpWithWhatItTakes) {
  constexpr std::int32_t kMost = 6000 * 64;
  ASSERT_NO_FATAL_FAILURE(set_up({{0, 200 * 64, kMost, 20000}, {1, 200 * 64, kMost, 20000}}));
  hold(kForward, 0, 300);
  hold(kReverse, 0, 400);
  hold(0, 0, 300);
  end({0, 1});
  EXPECT_EQ(master_.acknowledged(kAddress, bushd_set_velocity{0, 200 * 64, kMost + 1, 20000}),
            BUSHD_E_CAPACITY);
}

// The limit of motor 0, with the button held; then back from it. Motor 1 goes on.
TEST_F(VelocityOfTheImage, ALimitBrakesAlongTheRamp) {
  ASSERT_NO_FATAL_FAILURE(set_up({{0, 200 * 64, 2500 * 64, 5000}, {1, 150 * 64, 900 * 64, 1700}}));
  hold(kForward, 0, 350);
  hold(kForward, kLimit, 300);
  hold(0, kLimit, 100);
  hold(kReverse, kLimit, 60);
  hold(kReverse, 0, 100);
  hold(0, 0, 400);
  end({0, 1});
}

// Driven by phases, with the chopper: half steps are counted, and no tick is late.
TEST_F(VelocityOfTheImage, KeepsItsTicksBesideTheChopper) {
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
  ASSERT_NO_FATAL_FAILURE(emit_phases(BUSHD_PHASES_HALF));
  ASSERT_EQ(master_.acknowledged(kAddress, bushd_currents{0, BUSHD_DECAY_FAST, 1500, 1000, 300}),
            BUSHD_OK);
  ASSERT_NO_FATAL_FAILURE(
      give_settings({{0, 200 * 64, 3000 * 64, 8000}, {1, 200 * 64, 3000 * 64, 8000}}));
  hold(kForward, 0, 400);
  hold(kReverse, 0, 400);
  hold(0, 0, 300);
  end({0, 1}, false);
}

}  // namespace
}  // namespace bushd::sim::velocity_test
