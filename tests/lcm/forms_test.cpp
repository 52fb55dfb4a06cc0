// What forms, and variables that stand for members, make of them, as lcm-gen's types read it.
// (Names, order and types: wire_test.cpp. Which member has which name: field_names_test.py.)
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "lcm/all_messages.h"
#include "lcm/codec.h"
#include "lcm/oracle.h"

namespace bushd::lcm {
namespace {

const RequestId kMine{.session = 2, .client_id = "me", .number = 3};

template <class Oracle>
Oracle heard(const api::Request& request) {
  return test::as<Oracle>(encode(1, kMine, request).value().payload);
}

template <class Oracle>
Oracle heard(const api::Detail& detail) {
  const api::Completed reply{.outcome = api::Outcome::kLimit, .reason = "why", .detail = detail};
  return test::as<Oracle>(encode(1, kMine, reply).value().front().payload);
}

TEST(Forms, HeadersOfRequestsAndAnswers) {
  const auto stop = heard<stop_t>(api::Stop{{"a", "b"}});
  EXPECT_EQ(stop.request.utime_us, 1);
  EXPECT_EQ(stop.request.session, 2);
  EXPECT_EQ(stop.request.client_id, "me");
  EXPECT_EQ(stop.request.number, 3);
  EXPECT_EQ(stop.motors, (std::vector<std::string>{"a", "b"}));
  const auto answer = heard<answer_t>(api::Detail{});
  EXPECT_EQ(answer.reply.number, 3);
  EXPECT_EQ(answer.reply.phase, reply_header_t::RESULT);
  EXPECT_EQ(answer.reply.outcome, "limit");
  EXPECT_EQ(answer.reply.reason, "why");
  EXPECT_EQ(answer.reply.parts, 1);
  const auto refused = test::as<answer_t>(encode(1, kMine, api::Refused{"no"})->front().payload);
  EXPECT_EQ(refused.reply.phase, reply_header_t::REFUSED);
  EXPECT_EQ(refused.reply.reason, "no");
  const auto accepted = test::as<answer_t>(encode(1, kMine, api::Accepted{})->front().payload);
  EXPECT_EQ(accepted.reply.phase, reply_header_t::ACCEPTED);
}

TEST(Forms, EnumerationsHaveTheirConstants) {
  using Kind = api::Move::Kind;
  EXPECT_EQ(heard<move_t>(api::Move{.kind = Kind::kRelative}).kind, move_t::RELATIVE);
  EXPECT_EQ(heard<move_t>(api::Move{.kind = Kind::kAbsolute}).kind, move_t::ABSOLUTE);
  using Law = api::MoveLine::Law;
  EXPECT_EQ(heard<move_line_t>(api::MoveLine{.law = Law::kLeading}).law, move_line_t::LEADING);
  EXPECT_EQ(heard<move_line_t>(api::MoveLine{.law = Law::kElementary}).law,
            move_line_t::ELEMENTARY);
  using Corners = api::MovePath::Corners;
  EXPECT_EQ(heard<move_path_t>(api::MovePath{.corners = Corners::kContinuous}).corners,
            move_path_t::CONTINUOUS);
  EXPECT_EQ(heard<move_path_t>(api::MovePath{.corners = Corners::kExact}).corners,
            move_path_t::EXACT);
  using Part = api::Follow::Part;
  EXPECT_EQ(heard<follow_t>(api::Follow{.part = Part::kRows}).part, follow_t::ROWS);
  EXPECT_EQ(heard<follow_t>(api::Follow{.part = Part::kLastRows}).part, follow_t::LAST_ROWS);
  EXPECT_EQ(heard<follow_t>(api::Follow{.part = Part::kRun}).part, follow_t::RUN);
  EXPECT_EQ(heard<arm_t>(api::Arm{.edge = api::Edge::kRising}).edge, arm_t::RISING);
  EXPECT_EQ(heard<arm_t>(api::Arm{.edge = api::Edge::kFalling}).edge, arm_t::FALLING);
  using Change = api::Configure::Kind;
  EXPECT_EQ(heard<configure_t>(api::Configure{.kind = Change::kShow}).kind, configure_t::SHOW);
  EXPECT_EQ(heard<configure_t>(api::Configure{.kind = Change::kChange}).kind, configure_t::CHANGE);
  EXPECT_EQ(heard<configure_t>(api::Configure{.kind = Change::kSaved}).kind, configure_t::SAVED);
  const auto mode = [](camac::BlockMode its) {
    return heard<camac_request_t>(api::Camac{.block = {.mode = its}}).mode;
  };
  EXPECT_EQ(mode(camac::BlockMode::kSingle), camac_request_t::SINGLE);
  EXPECT_EQ(mode(camac::BlockMode::kRepeat), camac_request_t::REPEAT);
  EXPECT_EQ(mode(camac::BlockMode::kQStop), camac_request_t::Q_STOP);
  EXPECT_EQ(mode(camac::BlockMode::kScan), camac_request_t::SCAN);
  const auto arrivals = [](api::Directions its) {
    return heard<position_compare_t>(api::PositionCompare{.arrivals = its}).arrivals;
  };
  EXPECT_EQ(arrivals({.positive = true}), position_compare_t::POSITIVE);
  EXPECT_EQ(arrivals({.negative = true}), position_compare_t::NEGATIVE);
  EXPECT_EQ(arrivals({}), 0);
}

TEST(Forms, AmountsAndSpeeds) {
  const auto move =
      heard<move_t>(api::Move{.motors = {{"a", std::int64_t{7}}, {"b", api::UserUnits{0.5}}},
                              .speed = api::Speed{.per_s = 2, .in_steps = true}});
  EXPECT_EQ(move.speed, 2);
  EXPECT_EQ(move.speed_in_steps, 1);
  EXPECT_EQ(move.motors.at(0).motor, "a");
  EXPECT_EQ(move.motors.at(0).in_steps, 1);
  EXPECT_EQ(move.motors.at(0).steps, 7);
  EXPECT_EQ(move.motors.at(1).in_steps, 0);
  EXPECT_EQ(move.motors.at(1).user, 0.5);
  const auto line = heard<move_line_t>(api::MoveLine{.feed = api::Speed{4, true}});
  EXPECT_EQ(line.speed, 0);
  EXPECT_EQ(line.feed, 4);
  EXPECT_EQ(line.feed_in_steps, 1);
  const auto compare =
      heard<position_compare_t>(api::PositionCompare{.motor = "a", .position = std::int64_t{4}});
  EXPECT_EQ(compare.position.motor, "a");
  EXPECT_EQ(compare.position.steps, 4);
}

TEST(Forms, WhatHasNoValue) {
  EXPECT_EQ(heard<move_line_t>(api::MoveLine{}).duration_s, 0);
  EXPECT_EQ(heard<move_line_t>(api::MoveLine{.duration_s = 3}).duration_s, 3);
  EXPECT_EQ(heard<jog_t>(api::Jog{}).steps_after, -1);
  EXPECT_EQ(heard<jog_t>(api::Jog{.steps_after = 5}).steps_after, 5);
  EXPECT_EQ(heard<answer_t>(api::MovePlan{}).plan.at(0).frames, -1);
  const auto counted =
      heard<answer_t>(api::MovePlan{.traffic = api::MovePlan::Traffic{.frames = 3, .bytes = 4}});
  EXPECT_EQ(counted.plan.at(0).frames, 3);
  EXPECT_EQ(counted.plan.at(0).bytes, 4);
  const auto health = test::as<health_t>(
      encode(Part{}, api::HealthSnapshot{.mcus = {{.low_water_ticks = 12}, {}}})->payload);
  EXPECT_EQ(health.mcus.at(0).low_water_ticks, 12);
  EXPECT_EQ(health.mcus.at(1).low_water_ticks, -1);
}

TEST(Forms, TablesHaveTheirCodes) {
  const api::TableFile own{.content = {.name = "own",
                                       .accel = {2500, 1200},
                                       .decel = std::vector<std::uint16_t>{1300, 2600},
                                       .cruise = std::uint16_t{900}}};
  const auto told = heard<table_answer_t>(own).tables.at(0);
  EXPECT_EQ(told.cruise, 900);
  EXPECT_EQ(told.accel, (std::vector<std::int32_t>{2500, 1200}));
  EXPECT_EQ(told.decel, (std::vector<std::int32_t>{1300, 2600}));
  EXPECT_EQ(heard<table_answer_t>(api::TableFile{}).tables.at(0).cruise, 0);
}

TEST(Forms, StateOfAMotor) {
  const auto told = [](const api::MotorState& motor) {
    const auto packet = encode(Part{.sequence = 3}, 11, api::StateSnapshot{.motors = {motor}});
    const auto state = test::as<mcu_state_t>(packet->payload);
    EXPECT_EQ(state.sequence, 3);
    EXPECT_EQ(state.dropped_messages, 11);
    return state.motors.at(0);
  };
  const auto motor = told({.activity = api::Activity::kHoming,
                           .inhibited = {.negative = true},
                           .trust = api::Trust::kStale,
                           .heard_utime_us = 8,
                           .line = api::MotorState::Line{.fraction = 0.5, .left_us = 2'000'000}});
  EXPECT_EQ(motor.activity, "home");
  EXPECT_EQ(motor.inhibited, "negative");
  EXPECT_EQ(motor.trust, "stale");
  EXPECT_EQ(motor.heard_utime_us, 8);
  EXPECT_EQ(motor.on_line, 1);
  EXPECT_EQ(motor.line_fraction, 0.5);
  EXPECT_EQ(motor.line_left_s, 2);
  EXPECT_EQ(told({}).on_line, 0);
  EXPECT_EQ(told({}).heard_utime_us, 0);
}

TEST(Forms, ScaleOfAMotorWithItsLimitsOnBothScales) {
  const auto description = test::as<mcu_description_t>(
      encode(Part{}, api::Description{.emergency_stop = api::StopMode::kImmediate,
                                      .motors = {{.output = 15,
                                                  .scale = {"deg", {1000, 3}, true, -90.5, 4},
                                                  .soft_limits = units::SoftLimits{-180, 170}}}})
          ->payload);
  EXPECT_EQ(description.emergency_stop, "immediate");
  const motor_description_t& motor = description.motors.at(0);
  EXPECT_EQ(motor.output, 15);
  EXPECT_EQ(motor.unit, "deg");
  EXPECT_EQ(motor.steps_per_unit, "1000/3");
  EXPECT_EQ(motor.negative, 1);
  EXPECT_EQ(motor.offset, -90.5);
  EXPECT_EQ(motor.precision, 4);
  EXPECT_EQ(motor.soft_limits, 1);
  EXPECT_EQ(motor.dial_low, -180);
  EXPECT_EQ(motor.dial_high, 170);
  EXPECT_EQ(motor.user_low, -260.5);  // -90.5 - 170
  EXPECT_EQ(motor.user_high, 89.5);
}

}  // namespace
}  // namespace bushd::lcm
