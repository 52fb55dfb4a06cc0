// Each member arrives under the name that the .lcm file gives it: lcm-gen's types read what lib/lcm
// has written. (That all names are there, the fingerprint says: wire_test.cpp. Two members of one
// type that had each other's names would pass there.)
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

using Strings = std::vector<std::string>;

TEST(FieldNames, HeadersOfRequestsAndAnswers) {
  const auto stop = heard<stop_t>(api::Stop{{"a", "b"}});
  EXPECT_EQ(stop.request.utime_us, 1);
  EXPECT_EQ(stop.request.session, 2);
  EXPECT_EQ(stop.request.client_id, "me");
  EXPECT_EQ(stop.request.number, 3);
  EXPECT_EQ(stop.motors, (Strings{"a", "b"}));
  const auto answer = heard<answer_t>(api::Detail{});
  EXPECT_EQ(answer.reply.utime_us, 1);
  EXPECT_EQ(answer.reply.session, 2);
  EXPECT_EQ(answer.reply.client_id, "me");
  EXPECT_EQ(answer.reply.number, 3);
  EXPECT_EQ(answer.reply.phase, reply_header_t::RESULT);
  EXPECT_EQ(answer.reply.outcome, "limit");
  EXPECT_EQ(answer.reply.reason, "why");
  EXPECT_EQ(answer.reply.part, 0);
  EXPECT_EQ(answer.reply.parts, 1);
  const auto refused = test::as<answer_t>(encode(1, kMine, api::Refused{"no"})->front().payload);
  EXPECT_EQ(refused.reply.phase, reply_header_t::REFUSED);
  EXPECT_EQ(refused.reply.reason, "no");
  const auto accepted = test::as<answer_t>(encode(1, kMine, api::Accepted{})->front().payload);
  EXPECT_EQ(accepted.reply.phase, reply_header_t::ACCEPTED);
  const auto hello = test::as<hello_t>(encode(1, Hello{.client_id = "me", .nonce = 2})->payload);
  EXPECT_EQ(hello.utime_us, 1);
  EXPECT_EQ(hello.client_id, "me");
  EXPECT_EQ(hello.nonce, 2);
  const Welcome welcome{.hello = {.client_id = "me", .nonce = 2}, .run = 3, .session = 4};
  const auto welcomed = test::as<welcome_t>(encode(1, welcome)->payload);
  EXPECT_EQ(welcomed.utime_us, 1);
  EXPECT_EQ(welcomed.run, 3);
  EXPECT_EQ(welcomed.client_id, "me");
  EXPECT_EQ(welcomed.nonce, 2);
  EXPECT_EQ(welcomed.session, 4);
  for (int which = 0; which < 3; ++which) {
    const Subscription wanted{.state = which == 0, .description = which == 1, .health = which == 2};
    const auto told = test::as<subscribe_t>(encode(wanted)->payload);
    EXPECT_EQ(told.state, which == 0);
    EXPECT_EQ(told.description, which == 1);
    EXPECT_EQ(told.health, which == 2);
  }
}

TEST(FieldNames, Moves) {
  const std::vector<api::MotorAmount> motors{{"a", std::int64_t{7}}, {"b", api::UserUnits{0.5}}};
  const auto move = heard<move_t>(api::Move{.kind = api::Move::Kind::kAbsolute,
                                            .motors = motors,
                                            .dry_run = true,
                                            .speed = api::Speed{.per_s = 2, .in_steps = true}});
  EXPECT_EQ(move.kind, move_t::ABSOLUTE);
  EXPECT_EQ(move.dry_run, 1);
  EXPECT_EQ(move.speed, 2);
  EXPECT_EQ(move.speed_in_steps, 1);
  EXPECT_EQ(move.motors.at(0).motor, "a");
  EXPECT_EQ(move.motors.at(0).in_steps, 1);
  EXPECT_EQ(move.motors.at(0).steps, 7);
  EXPECT_EQ(move.motors.at(1).in_steps, 0);
  EXPECT_EQ(move.motors.at(1).user, 0.5);
  const auto by = heard<move_t>(api::Move{.motors = motors});
  EXPECT_EQ(by.kind, move_t::RELATIVE);
  EXPECT_EQ(by.dry_run, 0);
  const auto line = heard<move_line_t>(api::MoveLine{.kind = api::Move::Kind::kAbsolute,
                                                     .motors = motors,
                                                     .speed = api::Speed{.per_s = 2},
                                                     .duration_s = 3,
                                                     .law = api::MoveLine::Law::kElementary,
                                                     .feed = api::Speed{4, true}});
  EXPECT_EQ(line.law, move_line_t::ELEMENTARY);
  EXPECT_EQ(line.feed, 4);
  EXPECT_EQ(line.feed_in_steps, 1);
  EXPECT_EQ(heard<move_line_t>(api::MoveLine{}).law, move_line_t::LEADING);
  EXPECT_EQ(line.kind, move_line_t::ABSOLUTE);
  EXPECT_EQ(line.speed, 2);
  EXPECT_EQ(line.speed_in_steps, 0);
  EXPECT_EQ(line.duration_s, 3);
  const auto path = heard<move_path_t>(api::MovePath{.motors = {"a"},
                                                     .rows = 9,
                                                     .first_row = 4,
                                                     .positions = {1, 2},
                                                     .speeds = {3},
                                                     .corners = api::MovePath::Corners::kExact,
                                                     .feed = api::Speed{5}});
  EXPECT_EQ(path.feed, 5);
  EXPECT_EQ(path.feed_in_steps, 0);
  EXPECT_EQ(path.rows, 9);
  EXPECT_EQ(path.first_row, 4);
  EXPECT_EQ(path.corners, move_path_t::EXACT);
  EXPECT_EQ(path.motors, Strings{"a"});
  EXPECT_EQ(path.positions, (std::vector<double>{1, 2}));
  EXPECT_EQ(path.speeds, std::vector<double>{3});
  const auto rows = heard<follow_t>(api::Follow{.part = api::Follow::Part::kLastRows,
                                                .array = 5,
                                                .motors = {"a"},
                                                .stretch = 2,
                                                .time_s = {0, 1},
                                                .positions = {3, 4}});
  EXPECT_EQ(rows.part, follow_t::LAST_ROWS);
  EXPECT_EQ(rows.array, 5);
  EXPECT_EQ(rows.cubic, 0);
  EXPECT_EQ(rows.stretch, 2);
  EXPECT_EQ(rows.time_s, (std::vector<double>{0, 1}));
  EXPECT_EQ(rows.positions, (std::vector<double>{3, 4}));
  EXPECT_EQ(heard<follow_t>(api::Follow{.part = api::Follow::Part::kRun, .cubic = true}).cubic, 1);
}

TEST(FieldNames, OtherRequests) {
  const auto home = heard<home_t>(api::Home{.motors = {"a"}, .speed = api::Speed{3, true}});
  EXPECT_EQ(home.speed, 3);
  EXPECT_EQ(home.speed_in_steps, 1);
  EXPECT_EQ(home.all, 0);
  EXPECT_EQ(heard<home_t>(api::Home{.all = true}).all, 1);
  const auto arm = heard<arm_t>(api::Arm{.edge = api::Edge::kFalling, .delay_us = 5});
  EXPECT_EQ(arm.edge, arm_t::FALLING);
  EXPECT_EQ(arm.delay_us, 5);
  EXPECT_EQ(arm.while_connected, 0);
  EXPECT_EQ(heard<arm_t>(api::Arm{.while_connected = true}).while_connected, 1);
  const auto line = heard<arm_line_t>(api::ArmLine{.edge = api::Edge::kFalling,
                                                   .delay_us = 5,
                                                   .speed = api::Speed{.per_s = 6},
                                                   .duration_s = 7,
                                                   .while_connected = true});
  EXPECT_EQ(line.edge, arm_line_t::FALLING);
  EXPECT_EQ(line.kind, arm_line_t::RELATIVE);
  EXPECT_EQ(line.delay_us, 5);
  EXPECT_EQ(line.speed, 6);
  EXPECT_EQ(line.speed_in_steps, 0);
  EXPECT_EQ(line.duration_s, 7);
  EXPECT_EQ(line.while_connected, 1);
  const auto compare =
      heard<position_compare_t>(api::PositionCompare{.motor = "a",
                                                     .position = std::int64_t{4},
                                                     .arrivals = {.negative = true},
                                                     .delay_us = 5,
                                                     .width_us = 6});
  EXPECT_EQ(compare.position.motor, "a");
  EXPECT_EQ(compare.position.steps, 4);
  EXPECT_EQ(compare.arrivals, position_compare_t::NEGATIVE);
  EXPECT_EQ(compare.delay_us, 5);
  EXPECT_EQ(compare.width_us, 6);
  const auto set = heard<set_position_t>(api::SetPosition{.motors = {{"a", 1}}, .dial = true});
  EXPECT_EQ(set.dial, 1);
  EXPECT_EQ(set.motors.at(0).motor, "a");
  const auto use = heard<use_table_t>(api::UseTable{.group = "g", .table = "t"});
  EXPECT_EQ(use.group, "g");
  EXPECT_EQ(use.table, "t");
  const auto history = heard<get_history_t>(api::GetHistory{.motor = "a", .most = 7});
  EXPECT_EQ(history.motor, "a");
  EXPECT_EQ(history.most, 7);
  const auto jog = heard<jog_t>(api::Jog{.motor = "a", .per_s = -2, .keepalive_ms = 60});
  EXPECT_EQ(jog.motor, "a");
  EXPECT_EQ(jog.speed, -2);
  EXPECT_EQ(jog.speed_in_steps, 0);
  EXPECT_EQ(jog.keepalive_ms, 60);
  EXPECT_EQ(jog.renew, 0);
  EXPECT_EQ(jog.steps_after, -1);
  EXPECT_EQ(heard<jog_t>(api::Jog{.renew = true}).renew, 1);
  const auto change = heard<configure_t>(api::Configure{.kind = api::Configure::Kind::kSaved,
                                                        .motors = {"m"},
                                                        .changes = {{"a", "offset", "2"}},
                                                        .file_sha256 = "f"});
  EXPECT_EQ(change.kind, configure_t::SAVED);
  EXPECT_EQ(change.motors, Strings{"m"});
  EXPECT_EQ(change.changes.at(0).motor, "a");
  EXPECT_EQ(change.changes.at(0).key, "offset");
  EXPECT_EQ(change.changes.at(0).value, "2");
  EXPECT_EQ(change.file_sha256, "f");
  const auto cycles = heard<camac_request_t>(
      api::Camac{.crate = 4,
                 .block = {.mode = camac::BlockMode::kScan,
                           .cycles = {{.station = 5, .subaddress = 6, .function = 7, .data = 8}},
                           .count = 9,
                           .last_station = 10,
                           .last_subaddress = 11}});
  EXPECT_EQ(cycles.crate, 4);
  EXPECT_EQ(cycles.mode, camac_request_t::SCAN);
  EXPECT_EQ(cycles.cycles.at(0).station, 5);
  EXPECT_EQ(cycles.cycles.at(0).subaddress, 6);
  EXPECT_EQ(cycles.cycles.at(0).function, 7);
  EXPECT_EQ(cycles.cycles.at(0).data, 8);
  EXPECT_EQ(cycles.count, 9);
  EXPECT_EQ(cycles.last_station, 10);
  EXPECT_EQ(cycles.last_subaddress, 11);
}

const api::TableFile kTable{.content = {.name = "own",
                                        .time_unit_ns = 4000,
                                        .accel = {2500, 1200},
                                        .decel = std::vector<std::uint16_t>{1300, 2600},
                                        .cruise = std::uint16_t{900},
                                        .description = "d",
                                        .revision = 2},
                            .hash = "abc"};

void expect_table(const table_t& table) {
  EXPECT_EQ(table.name, "own");
  EXPECT_EQ(table.description, "d");
  EXPECT_EQ(table.revision, 2);
  EXPECT_EQ(table.hash, "abc");
  EXPECT_EQ(table.time_unit_ns, 4000);
  EXPECT_EQ(table.cruise, 900);
  EXPECT_EQ(table.accel, (std::vector<std::int32_t>{2500, 1200}));
  EXPECT_EQ(table.decel, (std::vector<std::int32_t>{1300, 2600}));
}

TEST(FieldNames, Tables) {
  const auto set =
      heard<set_table_t>(api::SetTable{.table = "t", .content = kTable, .expected_hash = "h"});
  EXPECT_EQ(set.table, "t");
  EXPECT_EQ(set.expected_hash, "h");
  expect_table(set.content);
  expect_table(heard<table_answer_t>(kTable).tables.at(0));
  EXPECT_EQ(heard<get_table_t>(api::GetTable{"t"}).table, "t");
  const auto list = heard<table_answer_t>(
      api::TableList{{{.name = "n",
                       .fault = "f",
                       .table = {.name = "own", .revision = 2, .hash = "abcd"},
                       .codes = 3,
                       .start_steps_per_s = 4,
                       .max_steps_per_s = 5}}});
  const table_entry_t& entry = list.entries.at(0);
  EXPECT_EQ(entry.name, "n");
  EXPECT_EQ(entry.fault, "f");
  EXPECT_EQ(entry.table.name, "own");
  EXPECT_EQ(entry.table.revision, 2);
  EXPECT_EQ(entry.table.hash, "abcd");
  EXPECT_EQ(entry.codes, 3);
  EXPECT_EQ(entry.start_steps_per_s, 4);
  EXPECT_EQ(entry.max_steps_per_s, 5);
}

TEST(FieldNames, ResultsAndPlans) {
  const auto answer =
      heard<answer_t>(std::vector<api::MotorResult>{{.motor = "a", .table = {.name = "own"}},
                                                    {.motor = "b",
                                                     .outcome = api::Outcome::kReached,
                                                     .position_steps = 3,
                                                     .user = 4,
                                                     .dial = 5,
                                                     .unit = "mm",
                                                     .precision = 6,
                                                     .table = {.name = "other"},
                                                     .who = "w",
                                                     .legs = 2,
                                                     .most_steps_per_s = 7}});
  EXPECT_EQ(answer.motors.at(0).motor, "a");
  const motor_result_t& result = answer.motors.at(1);
  EXPECT_EQ(result.motor, "b");
  EXPECT_EQ(result.outcome, "reached");
  EXPECT_EQ(result.position_steps, 3);
  EXPECT_EQ(result.user_position, 4);
  EXPECT_EQ(result.dial_position, 5);
  EXPECT_EQ(result.unit, "mm");
  EXPECT_EQ(result.precision, 6);
  EXPECT_EQ(result.table.name, "other");
  EXPECT_EQ(result.asked_by, "w");
  EXPECT_EQ(result.legs, 2);
  EXPECT_EQ(result.most_steps_per_s, 7);
  const auto planned = heard<answer_t>(
      api::MovePlan{.duration_us = 1,
                    .ticks = 2,
                    .traffic = api::MovePlan::Traffic{.frames = 3, .bytes = 4},
                    .limited_by = "l",
                    .motors = {{.motor = "a", .steps = 5, .duration_us = 6, .peak_steps_per_s = 7}},
                    .points_us = {8}});
  const move_plan_t& plan = planned.plan.at(0);
  EXPECT_EQ(plan.duration_us, 1);
  EXPECT_EQ(plan.ticks, 2);
  EXPECT_EQ(plan.frames, 3);
  EXPECT_EQ(plan.bytes, 4);
  EXPECT_EQ(plan.limited_by, "l");
  EXPECT_EQ(plan.motors.at(0).motor, "a");
  EXPECT_EQ(plan.motors.at(0).steps, 5);
  EXPECT_EQ(plan.motors.at(0).duration_us, 6);
  EXPECT_EQ(plan.motors.at(0).peak_steps_per_s, 7);
  EXPECT_EQ(plan.points_us, std::vector<std::int64_t>{8});
}

TEST(FieldNames, OtherAnswers) {
  const auto history = heard<history_answer_t>(api::MotionHistory{{{.utime_us = 1,
                                                                    .what = "move",
                                                                    .who = "w",
                                                                    .from_steps = 2,
                                                                    .to_steps = 3,
                                                                    .outcome = "reached",
                                                                    .reason = "r",
                                                                    .from_text = "2 mm",
                                                                    .to_text = "3 mm"}}});
  const past_motion_t& motion = history.motions.at(0);
  EXPECT_EQ(motion.utime_us, 1);
  EXPECT_EQ(motion.what, "move");
  EXPECT_EQ(motion.who, "w");
  EXPECT_EQ(motion.from_steps, 2);
  EXPECT_EQ(motion.to_steps, 3);
  EXPECT_EQ(motion.outcome, "reached");
  EXPECT_EQ(motion.reason, "r");
  EXPECT_EQ(motion.from_text, "2 mm");
  EXPECT_EQ(motion.to_text, "3 mm");
  const auto configuration = heard<configuration_answer_t>(api::Configuration{
      .path = "p",
      .sha256 = "s",
      .settings = {{.motor = "a", .key = "offset", .value = "1", .in_file = "2"}}});
  EXPECT_EQ(configuration.path, "p");
  EXPECT_EQ(configuration.sha256, "s");
  const motor_setting_t& setting = configuration.settings.at(0);
  EXPECT_EQ(setting.motor, "a");
  EXPECT_EQ(setting.key, "offset");
  EXPECT_EQ(setting.value, "1");
  EXPECT_EQ(setting.value_in_file, "2");
  const auto crate = heard<camac_reply_t>(api::CamacResult{
      .block = {.responses = {{.x = true, .q = false, .data = 6}}, .tally = 4}, .requests = 5});
  EXPECT_EQ(crate.tally, 4);
  EXPECT_EQ(crate.requests, 5);
  EXPECT_EQ(crate.responses.at(0).x, 1);
  EXPECT_EQ(crate.responses.at(0).q, 0);
  EXPECT_EQ(crate.responses.at(0).data, 6);
  const auto lam = test::as<camac_lam_t>(
      encode(1, api::CamacLam{.crate = 2, .raised = 3, .requests = 4, .demand = true})->payload);
  EXPECT_EQ(lam.utime_us, 1);
  EXPECT_EQ(lam.crate, 2);
  EXPECT_EQ(lam.raised, 3);
  EXPECT_EQ(lam.requests, 4);
  EXPECT_EQ(lam.demand, 1);
}

const Part kPart{.utime_us = 1, .run = 2, .sequence = 3, .part = 4, .parts = 5};

void expect_part(const auto& message) {
  EXPECT_EQ(message.utime_us, 1);
  EXPECT_EQ(message.run, 2);
  EXPECT_EQ(message.sequence, 3);
  EXPECT_EQ(message.part, 4);
  EXPECT_EQ(message.parts, 5);
}

TEST(FieldNames, State) {
  using Motor = api::MotorState;
  const auto told = [](const Motor& motor) {
    const api::StateSnapshot state{.bus = "b",
                                   .mcu = "m",
                                   .state = api::McuState::kFault,
                                   .detail = "d",
                                   .inputs = "i",
                                   .program = "p",
                                   .boot = 6,
                                   .tick = 7,
                                   .motors = {motor}};
    return test::as<mcu_state_t>(encode(kPart, 11, state)->payload);
  };
  const auto state = told({.name = "n",
                           .position_steps = 1,
                           .user = 2,
                           .dial = 3,
                           .target_steps = 4,
                           .user_target = 5,
                           .velocity_steps_per_s = 6,
                           .activity = api::Activity::kHoming,
                           .inputs = "home",
                           .inhibited = {.negative = true},
                           .trust = api::Trust::kStale,
                           .uncertain_reason = "u",
                           .heard_utime_us = 8,
                           .armed_by = "a",
                           .line = Motor::Line{.fraction = 0.5, .left_us = 2'000'000}});
  expect_part(state);
  EXPECT_EQ(state.dropped_messages, 11);
  EXPECT_EQ(state.bus, "b");
  EXPECT_EQ(state.mcu, "m");
  EXPECT_EQ(state.state, "FAULT");
  EXPECT_EQ(state.detail, "d");
  EXPECT_EQ(state.inputs, "i");
  EXPECT_EQ(state.program, "p");
  EXPECT_EQ(state.boot_number, 6);
  EXPECT_EQ(state.tick, 7);
  const motor_t& motor = state.motors.at(0);
  EXPECT_EQ(motor.name, "n");
  EXPECT_EQ(motor.position_steps, 1);
  EXPECT_EQ(motor.user_position, 2);
  EXPECT_EQ(motor.dial_position, 3);
  EXPECT_EQ(motor.target_steps, 4);
  EXPECT_EQ(motor.user_target, 5);
  EXPECT_EQ(motor.velocity_steps_per_s, 6);
  EXPECT_EQ(motor.activity, "home");
  EXPECT_EQ(motor.inputs, "home");
  EXPECT_EQ(motor.inhibited, "negative");
  EXPECT_EQ(motor.trust, "stale");
  EXPECT_EQ(motor.uncertain_reason, "u");
  EXPECT_EQ(motor.heard_utime_us, 8);
  EXPECT_EQ(motor.armed_by, "a");
  EXPECT_EQ(motor.on_line, 1);
  EXPECT_EQ(motor.line_fraction, 0.5);
  EXPECT_EQ(motor.line_left_s, 2);
  EXPECT_EQ(told(Motor{}).motors.at(0).on_line, 0);
  // Each of the five that are true or false, alone.
  const std::vector<std::pair<bool Motor::*, std::int8_t motor_t::*>> flags{
      {&Motor::moving, &motor_t::moving},
      {&Motor::enabled, &motor_t::enabled},
      {&Motor::input, &motor_t::input},
      {&Motor::paused, &motor_t::paused},
      {&Motor::held, &motor_t::held}};
  for (const auto& [sent, unused] : flags) {
    Motor one;
    one.*sent = true;
    const auto heard = told(one);
    for (const auto& [member, name] : flags) {
      EXPECT_EQ(heard.motors.at(0).*name, member == sent ? 1 : 0);
    }
  }
}

TEST(FieldNames, Description) {
  const auto description = test::as<mcu_description_t>(
      encode(kPart, api::Description{.bus = "b",
                                     .mcu = "m",
                                     .address = 6,
                                     .tick_ns = 7,
                                     .emergency_stop = api::StopMode::kImmediate,
                                     .port = "p",
                                     .motors = {{.name = "n",
                                                 .output = 15,
                                                 .group = "g",
                                                 .table = {.name = "own"},
                                                 .text = "d",
                                                 .scale = {"deg", {1000, 3}, true, -90.5, 4},
                                                 .soft_limits = units::SoftLimits{-180, 170}}}})
          ->payload);
  expect_part(description);
  EXPECT_EQ(description.bus, "b");
  EXPECT_EQ(description.mcu, "m");
  EXPECT_EQ(description.address, 6);
  EXPECT_EQ(description.tick_ns, 7);
  EXPECT_EQ(description.emergency_stop, "immediate");
  EXPECT_EQ(description.port, "p");
  const motor_description_t& motor = description.motors.at(0);
  EXPECT_EQ(motor.name, "n");
  EXPECT_EQ(motor.output, 15);
  EXPECT_EQ(motor.group, "g");
  EXPECT_EQ(motor.table.name, "own");
  EXPECT_EQ(motor.description, "d");
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

TEST(FieldNames, Health) {
  const auto health = test::as<health_t>(
      encode(kPart, api::HealthSnapshot{.bus = "b",
                                        .port_state = "open",
                                        .two_masters = true,
                                        .crc_errors = 6,
                                        .stray_frames = 7,
                                        .recent_latency_us = 8,
                                        .start_margin_us = 15,
                                        .line_bytes = 16,
                                        .line_bytes_per_s = 17,
                                        .latency = {{.below_us = 9, .answers = 10}},
                                        .mcus = {{.mcu = "m",
                                                  .address = 1,
                                                  .unique_id = "id",
                                                  .firmware_version = 2,
                                                  .boot = 3,
                                                  .reset_cause = "watchdog",
                                                  .current = 4,
                                                  .crc_errors = 5,
                                                  .rejected_frames = 6,
                                                  .ramp_downs = 7,
                                                  .timeouts = 8,
                                                  .repeats = 9,
                                                  .missed_ticks = 10,
                                                  .restarts = 11,
                                                  .low_water_ticks = 12,
                                                  .rate_ppm = 13,
                                                  .clock_offset_us = 14}}})
          ->payload);
  expect_part(health);
  EXPECT_EQ(health.bus, "b");
  EXPECT_EQ(health.port_state, "open");
  EXPECT_EQ(health.two_masters, 1);
  EXPECT_EQ(health.crc_errors, 6);
  EXPECT_EQ(health.stray_frames, 7);
  EXPECT_EQ(health.recent_latency_us, 8);
  EXPECT_EQ(health.start_margin_us, 15);
  EXPECT_EQ(health.line_bytes, 16);
  EXPECT_EQ(health.line_bytes_per_s, 17);
  EXPECT_EQ(health.latency.at(0).below_us, 9);
  EXPECT_EQ(health.latency.at(0).answers, 10);
  const mcu_health_t& mcu = health.mcus.at(0);
  EXPECT_EQ(mcu.mcu, "m");
  EXPECT_EQ(mcu.address, 1);
  EXPECT_EQ(mcu.unique_id, "id");
  EXPECT_EQ(mcu.firmware_version, 2);
  EXPECT_EQ(mcu.boot_number, 3);
  EXPECT_EQ(mcu.reset_cause, "watchdog");
  EXPECT_EQ(mcu.current, 4);
  EXPECT_EQ(mcu.crc_errors, 5);
  EXPECT_EQ(mcu.rejected_frames, 6);
  EXPECT_EQ(mcu.ramp_downs, 7);
  EXPECT_EQ(mcu.timeouts, 8);
  EXPECT_EQ(mcu.repeats, 9);
  EXPECT_EQ(mcu.missed_ticks, 10);
  EXPECT_EQ(mcu.restarts, 11);
  EXPECT_EQ(mcu.low_water_ticks, 12);
  EXPECT_EQ(mcu.rate_ppm, 13);
  EXPECT_EQ(mcu.clock_offset_us, 14);
  EXPECT_EQ(mcu.two_masters, 0);
}

}  // namespace
}  // namespace bushd::lcm
