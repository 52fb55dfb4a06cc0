// What front ends and clients say to each other arrives as it was meant.
#include "lcm/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "lcm/all_messages.h"
#include "lcm/oracle.h"
#include "lcm/random_message.h"
#include "lcm/wire.h"

namespace bushd::lcm {
namespace {

const RequestId kId{.session = -7, .client_id = "scan-hall-4711", .number = 1};

// By way of the messages: encoded, decoded and encoded again it is the same.
ClientMessage over_the_wire(const api::Request& request) {
  const auto packet = encode(12, kId, request);
  EXPECT_TRUE(packet) << packet.error().text();
  const auto message = decode_client_message(packet->channel, packet->payload);
  EXPECT_TRUE(message);
  EXPECT_EQ(message->id, kId);
  const auto again = encode(12, message->id, std::get<api::Request>(message->content));
  EXPECT_EQ(again->payload, packet->payload);
  EXPECT_EQ(again->channel, packet->channel);
  return *message;
}

template <class T>
T request_over_the_wire(const T& request) {
  return std::get<T>(std::get<api::Request>(over_the_wire(request).content));
}

ReplyMessage reply_over_the_wire(const api::Reply& reply) {
  const auto packets = encode(12, kId, reply);
  EXPECT_TRUE(packets) << packets.error().text();
  EXPECT_EQ(packets->size(), 1u);
  const Packet& packet = packets->front();
  const auto message = decode_daemon_message(packet.channel, packet.payload);
  EXPECT_TRUE(message);
  auto out = std::get<ReplyMessage>(*message);
  EXPECT_EQ(out.id, kId);
  EXPECT_EQ(encode(12, out.id, out.reply)->front().payload, packet.payload);
  return out;
}

template <class... Content>
std::vector<api::Request> one_of_each(const std::variant<Content...>* /*requests*/) {
  return {api::Request(Content{})...};
}

TEST(Codec, EveryRequestHasAChannelOfItsOwn) {
  EXPECT_EQ(client_channels().size(), std::variant_size_v<api::Request::variant> + 3);
  for (const std::string_view channel : client_channels()) {
    EXPECT_EQ(std::ranges::count(client_channels(), channel), 1) << channel;
  }
  EXPECT_EQ(encode(0, kId, api::Request(api::Move{}))->channel, "MOVE");
  EXPECT_EQ(encode(0, kId, api::Request(api::SetTable{}))->channel, "SET_TABLE");
  for (const api::Request& request : one_of_each(static_cast<api::Request::variant*>(nullptr))) {
    EXPECT_EQ(is_urgent_channel(encode(0, kId, request)->channel), api::ends_motion(request))
        << api::name_of(request);
  }
}

TEST(Codec, MovesArriveAsTheyWereMeant) {
  const auto move =
      request_over_the_wire(api::Move{.kind = api::Move::Kind::kAbsolute,
                                      .motors = {{"theta", -400}, {"chi", api::UserUnits{2.5}}},
                                      .dry_run = true});
  EXPECT_EQ(move.kind, api::Move::Kind::kAbsolute);
  EXPECT_EQ(move.motors,
            (std::vector<api::MotorAmount>{{"theta", -400}, {"chi", api::UserUnits{2.5}}}));
  EXPECT_TRUE(move.dry_run);
}

TEST(Codec, OtherRequestsDoToo) {
  EXPECT_EQ(request_over_the_wire(api::Stop{{"a", "b"}}).motors, (api::MotorNames{"a", "b"}));
  request_over_the_wire(api::EmergencyStop{});
  EXPECT_EQ(request_over_the_wire(api::Enable{{"a"}}).motors, api::MotorNames{"a"});
  EXPECT_EQ(request_over_the_wire(api::Disable{}).motors, api::MotorNames{});
  EXPECT_EQ(request_over_the_wire(api::SetPosition{.motors = {{"a", 5}}}).motors.front().amount,
            api::Amount(std::int64_t{5}));
  EXPECT_EQ(request_over_the_wire(api::ClearFaults{{"a"}}).motors, api::MotorNames{"a"});
  EXPECT_EQ(request_over_the_wire(api::UseTable{"group", "own@2"}).table, "own@2");
  request_over_the_wire(api::ReloadTables{});
  EXPECT_EQ(request_over_the_wire(api::Home{{"a"}}).motors, api::MotorNames{"a"});
  const auto arm = request_over_the_wire(api::Arm{
      .edge = api::Edge::kFalling, .delay_us = 100, .motors = {{"a", 3}}, .while_connected = true});
  EXPECT_TRUE(arm.while_connected);
  EXPECT_EQ(arm.edge, api::Edge::kFalling);
  EXPECT_EQ(arm.delay_us, 100);
  const auto armed =
      request_over_the_wire(api::ArmLine{.edge = api::Edge::kFalling,
                                         .delay_us = 77,
                                         .kind = api::Move::Kind::kAbsolute,
                                         .motors = {{"a", 3}, {"b", api::UserUnits{-0.5}}},
                                         .speed = api::Speed{.per_s = 4, .in_steps = true},
                                         .duration_s = 2.5,
                                         .while_connected = true});
  EXPECT_TRUE(armed.while_connected);
  EXPECT_EQ(armed.edge, api::Edge::kFalling);
  EXPECT_EQ(armed.delay_us, 77);
  EXPECT_EQ(armed.kind, api::Move::Kind::kAbsolute);
  EXPECT_EQ(armed.motors, (std::vector<api::MotorAmount>{{"a", 3}, {"b", api::UserUnits{-0.5}}}));
  EXPECT_EQ(armed.speed, (api::Speed{.per_s = 4, .in_steps = true}));
  EXPECT_EQ(armed.duration_s, 2.5);
  EXPECT_FALSE(request_over_the_wire(api::ArmLine{.motors = {{"a", 3}}}).duration_s);
  EXPECT_EQ(request_over_the_wire(api::Disarm{{"a"}}).motors, api::MotorNames{"a"});
  const auto compare = request_over_the_wire(api::PositionCompare{
      .motor = "a", .position = 9, .arrivals = {.negative = true}, .delay_us = 5, .width_us = 6});
  EXPECT_FALSE(compare.arrivals.positive);
  EXPECT_TRUE(compare.arrivals.negative);
  EXPECT_EQ(compare.width_us, 6);
  EXPECT_EQ(request_over_the_wire(api::Confirm{{"a"}}).motors, api::MotorNames{"a"});
  const auto history = request_over_the_wire(api::GetHistory{.motor = "a", .most = 7});
  EXPECT_EQ(history.motor, "a");
  EXPECT_EQ(history.most, 7);
  EXPECT_TRUE(request_over_the_wire(api::Home{.all = true}).all);
  const camac::Block block{.mode = camac::BlockMode::kScan,
                           .cycles = {{5, 15, 31, 0xFFFFFF}, {31, 0, 0, 7}},
                           .count = 9,
                           .last_station = 23,
                           .last_subaddress = 3};
  const auto cycles = request_over_the_wire(api::Camac{.crate = 62, .block = block});
  EXPECT_EQ(cycles.crate, 62);
  EXPECT_EQ(cycles.block, block);
  using Kind = api::Configure::Kind;
  EXPECT_EQ(request_over_the_wire(api::Configure{.motors = {"a"}}).motors, api::MotorNames{"a"});
  for (const Kind kind : {Kind::kShow, Kind::kChange, Kind::kSaved}) {
    const auto configure = request_over_the_wire(
        api::Configure{.kind = kind, .changes = {{"a", "offset", "2.5"}}, .file_sha256 = "abc"});
    EXPECT_EQ(configure.kind, kind);
    EXPECT_EQ(configure.changes, (std::vector<api::Configure::Change>{{"a", "offset", "2.5"}}));
    EXPECT_EQ(configure.file_sha256, "abc");
  }
  const auto line = request_over_the_wire(
      api::MoveLine{.kind = api::Move::Kind::kAbsolute,
                    .motors = {{"a", std::int64_t{4}}, {"b", api::UserUnits{-0.5}}},
                    .dry_run = true,
                    .speed = api::Speed{.per_s = 2.5},
                    .duration_s = 12.5,
                    .law = api::MoveLine::Law::kElementary,
                    .feed = api::Speed{.per_s = 7, .in_steps = true}});
  EXPECT_EQ(line.law, api::MoveLine::Law::kElementary);
  EXPECT_EQ(line.feed, (api::Speed{.per_s = 7, .in_steps = true}));
  EXPECT_FALSE(request_over_the_wire(api::MoveLine{}).feed);
  EXPECT_EQ(line.kind, api::Move::Kind::kAbsolute);
  EXPECT_EQ(line.motors,
            (std::vector<api::MotorAmount>{{"a", std::int64_t{4}}, {"b", api::UserUnits{-0.5}}}));
  EXPECT_TRUE(line.dry_run);
  EXPECT_EQ(line.speed, (api::Speed{.per_s = 2.5}));
  EXPECT_EQ(line.duration_s, 12.5);
  EXPECT_FALSE(request_over_the_wire(api::MoveLine{}).duration_s);
  const auto path = request_over_the_wire(api::MovePath{.motors = {"a"},
                                                        .rows = 3,
                                                        .first_row = 1,
                                                        .positions = {0.5, -2},
                                                        .speeds = {0, 2},
                                                        .corners = api::MovePath::Corners::kExact,
                                                        .dry_run = true,
                                                        .speed = api::Speed{.per_s = 2.5}});
  EXPECT_EQ(path.motors, api::MotorNames{"a"});
  EXPECT_EQ(path.rows, 3);
  EXPECT_EQ(path.first_row, 1);
  EXPECT_EQ(path.positions, (std::vector<double>{0.5, -2}));
  EXPECT_EQ(path.speeds, (std::vector<double>{0, 2}));
  EXPECT_EQ(path.corners, api::MovePath::Corners::kExact);
  EXPECT_TRUE(path.dry_run);
  EXPECT_EQ(path.speed, (api::Speed{.per_s = 2.5}));
  const api::Follow rows{.part = api::Follow::Part::kLastRows,
                         .array = 7,
                         .motors = {"a", "b"},
                         .cubic = true,
                         .stretch = 1.5,
                         .time_s = {0, 0.5},
                         .positions = {1, 2, 3, 4.25}};
  const auto follow = request_over_the_wire(rows);
  EXPECT_EQ(follow.part, rows.part);
  EXPECT_EQ(follow.array, 7);
  EXPECT_EQ(follow.motors, rows.motors);
  EXPECT_TRUE(follow.cubic);
  EXPECT_EQ(follow.stretch, 1.5);
  EXPECT_EQ(follow.time_s, rows.time_s);
  EXPECT_EQ(follow.positions, rows.positions);
  EXPECT_EQ(request_over_the_wire(api::Follow{.part = api::Follow::Part::kRun}).part,
            api::Follow::Part::kRun);
  const auto jog = request_over_the_wire(
      api::Jog{.motor = "a", .per_s = -2.5, .keepalive_ms = 300, .steps_after = 7});
  EXPECT_EQ(jog.motor, "a");
  EXPECT_EQ(jog.per_s, -2.5);
  EXPECT_EQ(jog.keepalive_ms, 300);
  EXPECT_EQ(jog.steps_after, 7);
  EXPECT_FALSE(request_over_the_wire(api::Jog{.renew = true}).steps_after);
  request_over_the_wire(api::ListTables{});
  EXPECT_EQ(request_over_the_wire(api::GetTable{"own"}).table, "own");
  const auto set = request_over_the_wire(
      api::SetTable{.table = "own",
                    .content = {{.name = "own",
                                 .time_unit_ns = 4000,
                                 .accel = {2500, 1200},
                                 .decel = std::vector<std::uint16_t>{1200, 2500},
                                 .cruise = std::uint16_t{900},
                                 .revision = 2}},
                    .expected_hash = "abc"});
  EXPECT_EQ(set.expected_hash, "abc");
  EXPECT_EQ(set.content.content.accel, (std::vector<std::uint16_t>{2500, 1200}));
  EXPECT_EQ(set.content.content.cruise, 900);
  EXPECT_EQ(set.content.content.revision, 2u);
}

TEST(Codec, HelloSubscriptionAndStatusArrive) {
  const auto hello = encode(1, Hello{.client_id = "scan", .nonce = -5});
  const auto said = decode_client_message(hello->channel, hello->payload);
  EXPECT_EQ(std::get<Hello>(said->content).nonce, -5);
  const auto subscribe = encode(Subscription{.state = true, .health = true});
  const auto wanted = decode_client_message(subscribe->channel, subscribe->payload);
  EXPECT_TRUE(std::get<Subscription>(wanted->content).state);
  EXPECT_FALSE(std::get<Subscription>(wanted->content).description);
  const auto status = encode(1, kId, GetStatus{});
  EXPECT_EQ(decode_client_message(status->channel, status->payload)->id, kId);
  const auto welcome =
      encode(1, Welcome{.hello = {.client_id = "scan", .nonce = -5}, .run = 3, .session = 4});
  const auto answer = decode_daemon_message(welcome->channel, welcome->payload);
  EXPECT_EQ(std::get<Welcome>(*answer).session, 4);
  EXPECT_EQ(std::get<Welcome>(*answer).hello.nonce, -5);
}

TEST(Codec, WhatNoMessageMeansIsRefused) {
  EXPECT_FALSE(decode_client_message("COMMAND", {}));
  EXPECT_FALSE(decode_client_message("", {}));
  EXPECT_FALSE(decode_daemon_message("MOVE", {}));
  move_t move{};
  move.kind = 3;
  EXPECT_FALSE(decode_client_message("MOVE", test::bytes_of(move)));
  arm_t arm{};
  arm.edge = 0;
  EXPECT_FALSE(decode_client_message("ARM", test::bytes_of(arm)));
  arm_line_t line{};
  line.edge = arm_line_t::RISING;
  EXPECT_FALSE(decode_client_message("ARM_LINE", test::bytes_of(line)));
  line.kind = arm_line_t::ABSOLUTE;
  EXPECT_TRUE(decode_client_message("ARM_LINE", test::bytes_of(line)));
  line.edge = 3;
  EXPECT_FALSE(decode_client_message("ARM_LINE", test::bytes_of(line)));
  configure_t configure{};
  configure.kind = 4;
  EXPECT_FALSE(decode_client_message("CONFIGURE", test::bytes_of(configure)));
  camac_request_t cycles{};
  cycles.mode = 5;
  EXPECT_FALSE(decode_client_message("CAMAC", test::bytes_of(cycles)));
  position_compare_t compare{};
  compare.arrivals = 4;
  EXPECT_FALSE(decode_client_message("POSITION_COMPARE", test::bytes_of(compare)));
}

TEST(Codec, RepliesArriveAsTheyWereMeant) {
  EXPECT_TRUE(std::holds_alternative<api::Accepted>(reply_over_the_wire(api::Accepted{}).reply));
  EXPECT_EQ(std::get<api::Refused>(reply_over_the_wire(api::Refused{"why"}).reply).reason, "why");
  const api::TableRef table{.name = "own", .revision = 2, .hash = "0123abcd"};
  const auto moved = std::get<api::Completed>(
      reply_over_the_wire(
          api::Completed{
              .outcome = api::Outcome::kLimit,
              .reason = "theta: stopped",
              .detail =
                  std::vector<api::MotorResult>{
                      {"theta", api::Outcome::kLimit, 7, 1.75, -0.25, "mm", 2, table, "me"},
                      {"chi", api::Outcome::kReached, 9, 9, 9, "steps", 0, table}}})
          .reply);
  EXPECT_EQ(moved.outcome, api::Outcome::kLimit);
  const auto& motors = std::get<std::vector<api::MotorResult>>(moved.detail);
  EXPECT_EQ(motors.at(1).motor, "chi");
  EXPECT_EQ(motors.at(1).table, table);
  EXPECT_EQ(motors.at(0).position_steps, 7);
  EXPECT_EQ(motors.at(0).user, 1.75);
  EXPECT_EQ(motors.at(0).dial, -0.25);
  EXPECT_EQ(motors.at(0).unit, "mm");
  EXPECT_EQ(motors.at(0).precision, 2);
  EXPECT_EQ(motors.at(0).who, "me");
}

TEST(Codec, PlansAndTablesDoToo) {
  api::MovePlan plan;
  plan.ticks = 5;
  plan.motors.push_back({.motor = "a", .steps = 3, .duration_us = 4, .peak_steps_per_s = 5});
  const auto planned = std::get<api::Completed>(
      reply_over_the_wire(api::Completed{.reason = "r", .detail = plan}).reply);
  EXPECT_FALSE(std::get<api::MovePlan>(planned.detail).traffic);
  EXPECT_EQ(std::get<api::MovePlan>(planned.detail).motors.front().steps, 3);
  const auto list = std::get<api::Completed>(
      reply_over_the_wire(
          api::Completed{.reason = "r", .detail = api::TableList{{{.name = "own", .fault = "f"}}}})
          .reply);
  EXPECT_EQ(std::get<api::TableList>(list.detail).entries.front().fault, "f");
  const api::PastMotion motion{.utime_us = 1,
                               .what = "move",
                               .who = "w",
                               .from_steps = -2,
                               .to_steps = 3,
                               .outcome = "reached",
                               .reason = "r",
                               .from_text = "-2.0 mm",
                               .to_text = "3.0 mm"};
  const auto history = std::get<api::Completed>(
      reply_over_the_wire(
          api::Completed{.reason = "r", .detail = api::MotionHistory{{motion, motion}}})
          .reply);
  EXPECT_EQ(std::get<api::MotionHistory>(history.detail).motions,
            std::vector<api::PastMotion>({motion, motion}));
  const api::CamacResult crate{
      .block = {.responses = {{true, false, 0xFFFFFF}, {false, true, 0}}, .tally = 2},
      .requests = 1U << 22};
  const auto answered = std::get<api::Completed>(
      reply_over_the_wire(api::Completed{.reason = "r", .detail = crate}).reply);
  EXPECT_EQ(std::get<api::CamacResult>(answered.detail), crate);
  const api::Configuration configuration{
      .path = "/etc/b.toml",
      .sha256 = "abc",
      .settings = {{.motor = "a", .key = "offset", .value = "2.5", .in_file = "0"}}};
  const auto configured = std::get<api::Configuration>(
      std::get<api::Completed>(
          reply_over_the_wire(api::Completed{.reason = "r", .detail = configuration}).reply)
          .detail);
  EXPECT_EQ(configured.path, configuration.path);
  EXPECT_EQ(configured.sha256, configuration.sha256);
  EXPECT_EQ(configured.settings, configuration.settings);
  const api::TableFile own{.content = {.name = "own", .time_unit_ns = 4000, .accel = {2500, 1200}},
                           .hash = "abc"};
  const auto content = std::get<api::Completed>(
      reply_over_the_wire(api::Completed{.reason = "r", .detail = own}).reply);
  EXPECT_EQ(std::get<api::TableFile>(content.detail), own);
}

// Decodes the parts of a reply in this order of their indices, and puts them together.
api::Completed put_together(const api::Reply& reply, const std::vector<std::size_t>& order) {
  const auto packets = encode(1, kId, reply);
  EXPECT_TRUE(packets);
  ReplyParts parts;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Packet& packet = packets->at(order[i]);
    EXPECT_LE(packet.payload.size(), kMaxMessageBytes);
    const auto message =
        std::get<ReplyMessage>(*decode_daemon_message(packet.channel, packet.payload));
    EXPECT_EQ(message.id, kId);
    EXPECT_EQ(message.parts, static_cast<std::int32_t>(packets->size()));
    const auto whole = parts.add(message);
    EXPECT_EQ(whole.has_value(), i + 1 == order.size());
    if (whole) return std::get<api::Completed>(*whole);
  }
  return {};
}

TEST(Codec, ResultsOf2048MotorsComeInParts) {
  std::vector<api::MotorResult> motors;
  for (int i = 0; i < 2048; ++i) {
    const std::string name =
        "motor" + std::to_string(i) + std::string(static_cast<std::size_t>(i) % 50, 'x');
    motors.push_back(
        {.motor = name,
         .outcome = i % 3 == 0 ? api::Outcome::kLink : api::Outcome::kReached,
         .position_steps = 1000 - i,
         .user = 0.5 * i,
         .dial = -0.5 * i,
         .unit = std::string(static_cast<std::size_t>(i) % 64, 'u'),
         .precision = i % 7,
         .table = {.name = i % 2 == 0 ? "own" : "other", .revision = 7, .hash = "89abcdef"}});
  }
  const api::Completed reply{.outcome = api::Outcome::kLink, .reason = "r", .detail = motors};
  // Out of order, and some of them twice; the first comes last, before anybody could be done.
  const std::size_t parts = encode(1, kId, reply)->size();
  ASSERT_GE(parts, 5u);
  std::vector<std::size_t> order{4, 2, 2, 1, 3, 4};
  for (std::size_t part = 5; part < parts; ++part) order.push_back(part);
  order.push_back(0);
  const auto whole = put_together(reply, order);
  EXPECT_EQ(whole.outcome, api::Outcome::kLink);
  EXPECT_EQ(whole.reason, "r");
  const auto& arrived = std::get<std::vector<api::MotorResult>>(whole.detail);
  ASSERT_EQ(arrived.size(), motors.size());
  for (std::size_t i = 0; i < motors.size(); ++i) {
    EXPECT_EQ(arrived[i].motor, motors[i].motor);
    EXPECT_EQ(arrived[i].outcome, motors[i].outcome);
    EXPECT_EQ(arrived[i].position_steps, motors[i].position_steps);
    EXPECT_EQ(arrived[i].user, motors[i].user);
    EXPECT_EQ(arrived[i].dial, motors[i].dial);
    EXPECT_EQ(arrived[i].unit, motors[i].unit);
    EXPECT_EQ(arrived[i].precision, motors[i].precision);
    EXPECT_EQ(arrived[i].table, motors[i].table);
  }
}

TEST(Codec, APlanOf2048MotorsComesInParts) {
  api::MovePlan plan{.duration_us = 5, .ticks = 6, .traffic = api::MovePlan::Traffic{7, 8}};
  for (int i = 0; i < 2048; ++i) {
    plan.motors.push_back({.motor = "motor" + std::to_string(i), .steps = i, .duration_us = 2 * i});
  }
  const auto whole = put_together(api::Completed{.reason = "r", .detail = plan}, {1, 0});
  const auto& arrived = std::get<api::MovePlan>(whole.detail);
  EXPECT_EQ(arrived.ticks, 6);
  EXPECT_EQ(arrived.traffic->bytes, 8);
  ASSERT_EQ(arrived.motors.size(), 2048u);
  for (int i = 0; i < 2048; ++i) EXPECT_EQ(arrived.motors[static_cast<std::size_t>(i)].steps, i);
}

TEST(Codec, AListOfManyTablesComesInParts) {
  api::TableList list;
  for (int i = 0; i < 5000; ++i) list.entries.push_back({.name = std::string(60, 'x')});
  const api::Completed reply{.reason = "all tables", .detail = list};
  std::vector<std::size_t> order(encode(1, kId, reply)->size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = order.size() - 1 - i;
  EXPECT_GT(order.size(), 5u);
  const auto whole = put_together(reply, order);
  EXPECT_EQ(std::get<api::TableList>(whole.detail).entries.size(), 5000u);
  EXPECT_EQ(whole.reason, "all tables");
}

TEST(Codec, LongBlocksOfACrateComeInParts) {
  api::CamacResult crate{.block = {.tally = 20'000}, .requests = 5};
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    crate.block.responses.push_back({.x = i % 2 == 0, .q = i % 3 == 0, .data = i});
  }
  const auto whole = put_together(api::Completed{.reason = "r", .detail = crate}, {1, 0});
  EXPECT_EQ(std::get<api::CamacResult>(whole.detail), crate);
}

TEST(Codec, LamArrives) {
  const api::CamacLam lam{.crate = 3, .raised = 16, .requests = 1U << 22 | 16, .demand = true};
  const auto packet = encode(77, lam);
  ASSERT_TRUE(packet);
  EXPECT_EQ(packet->channel, "CAMAC_LAM");
  const auto heard = decode_daemon_message(packet->channel, packet->payload);
  EXPECT_EQ(std::get<CamacLamMessage>(*heard).lam, lam);
  EXPECT_EQ(std::get<CamacLamMessage>(*heard).utime_us, 77);
}

// Nobody can make a client keep more than a reply.
TEST(Codec, PartsThatCannotBeAreNoReply) {
  ReplyParts parts;
  for (int part = 0; part < 1000; ++part) {
    EXPECT_FALSE(parts.add({.id = kId, .reply = api::Completed{}, .part = part, .parts = 1000}));
  }
  EXPECT_TRUE(parts.add({.id = kId, .reply = api::Completed{}}));
}

TEST(Codec, SnapshotsArriveAsTheyAre) {
  const Part part{.utime_us = 1, .run = 2, .sequence = 3, .part = 4, .parts = 5};
  const api::StateSnapshot state{.bus = "hall",
                                 .mcu = "hall:1",
                                 .state = api::McuState::kRunning,
                                 .detail = "d",
                                 .inputs = "forward",
                                 .boot = 6,
                                 .tick = 7,
                                 .motors = {{.name = "theta",
                                             .position_steps = -8,
                                             .user = 1.5,
                                             .dial = -1.5,
                                             .target_steps = 9,
                                             .user_target = 2.5,
                                             .velocity_steps_per_s = 10.5,
                                             .activity = api::Activity::kMoving,
                                             .moving = true,
                                             .input = true,
                                             .inputs = "positive home",
                                             .inhibited = {.positive = true},
                                             .trust = api::Trust::kStale,
                                             .uncertain_reason = "lost",
                                             .heard_utime_us = 4711,
                                             .armed_by = "command 7 of panel"}}};
  const auto packet = encode(part, 11, state);
  const auto message = std::get<StateMessage>(*decode_daemon_message("STATE", packet->payload));
  EXPECT_EQ(message.snapshot, state);
  EXPECT_EQ(message.dropped_messages, 11);
  EXPECT_EQ(message.part.sequence, 3);
  const api::Description description{.bus = "hall",
                                     .mcu = "hall:1",
                                     .address = 1,
                                     .tick_ns = 2'560'000,
                                     .emergency_stop = api::StopMode::kImmediate,
                                     .port = "/dev/ttyUSB1",
                                     .motors = {{.name = "theta",
                                                 .output = 15,
                                                 .group = "g",
                                                 .table = {"own", 2, "abc"},
                                                 .text = "first circle",
                                                 .scale = {"deg", {1000, 3}, true, -90.5, 4},
                                                 .soft_limits = units::SoftLimits{-180, 180}},
                                                {.name = "chi", .scale = {.decimals = 0}}}};
  const auto rare = encode(part, description);
  EXPECT_EQ(
      std::get<DescriptionMessage>(*decode_daemon_message("DESCRIPTION", rare->payload)).snapshot,
      description);
  const api::HealthSnapshot health{.bus = "hall",
                                   .port_state = "open",
                                   .latency = {{1000, 7}, {INT64_MAX, 1}},
                                   .mcus = {{.mcu = "hall:1", .ramp_downs = 3}}};
  const auto sick = encode(part, health);
  const auto heard = std::get<HealthMessage>(*decode_daemon_message("HEALTH", sick->payload));
  EXPECT_EQ(heard.snapshot.latency.at(1).answers, 1u);
  EXPECT_EQ(heard.snapshot.mcus.at(0).ramp_downs, 3u);
  EXPECT_FALSE(heard.snapshot.mcus.at(0).low_water_ticks);
}

TEST(Codec, TheStateOfSixteenMotorsFitsAnEthernetFrameTwice) {
  api::StateSnapshot state{.bus = "hall", .mcu = "hall:1"};
  for (int i = 0; i < 16; ++i) state.motors.push_back({.name = "motor" + std::to_string(i)});
  EXPECT_LT(encode(Part{}, 0, state)->payload.size(), 2 * 1400u);
}

// Whatever decodes can be encoded.
template <class... Pair>
std::vector<std::vector<std::uint8_t>> random_payloads(test::Random& random,
                                                       const std::tuple<Pair...>* /*all*/) {
  return {encode("TEST", test::random_message<typename Pair::Message>(random)).value()...};
}

TEST(Codec, RandomMessagesOfEveryChannelDoNoHarm) {
  test::Random random(20040518);
  for (int i = 0; i < 100; ++i) {
    for (const auto& payload : random_payloads(random, static_cast<test::AllMessages*>(nullptr))) {
      for (const std::string_view channel : client_channels()) {
        const auto message = decode_client_message(channel, payload);
        if (!message) continue;
        if (const auto* request = std::get_if<api::Request>(&message->content)) {
          EXPECT_TRUE(encode(0, message->id, *request));
        }
      }
      for (const std::string_view channel : daemon_channels()) {
        const auto message = decode_daemon_message(channel, payload);
        if (!message) continue;
        if (const auto* reply = std::get_if<ReplyMessage>(&*message)) {
          EXPECT_TRUE(encode(0, reply->id, reply->reply));
        }
      }
    }
  }
}

}  // namespace
}  // namespace bushd::lcm
