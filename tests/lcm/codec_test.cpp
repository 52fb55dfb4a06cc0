// What front ends and clients say to each other arrives as it was meant.
#include "lcm/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <string>

#include "lcm/all_messages.h"
#include "lcm/arrival.h"
#include "lcm/oracle.h"
#include "lcm/random_message.h"
#include "lcm/wire.h"
#include "results.h"

namespace bushd::lcm {
namespace {

using test::expect_arrives;
using test::good;
using test::kId;

// Nothing where the daemon's clients take it for no message of this kind.
template <class Message>
std::optional<Message> heard(const Packet& packet) {
  auto message = decode_daemon_message(packet.channel, packet.payload);
  auto* said = message ? std::get_if<Message>(&*message) : nullptr;
  return said != nullptr ? std::optional(std::move(*said)) : std::nullopt;
}
// As the daemon takes it.
template <class Content>
std::optional<Content> said(const Packet& packet) {
  auto message = decode_client_message(packet.channel, packet.payload);
  auto* content = message ? std::get_if<Content>(&message->content) : nullptr;
  return content != nullptr ? std::optional(std::move(*content)) : std::nullopt;
}

void expect_reply_arrives(const api::Reply& reply) {
  const auto packets = good(encode(12, kId, reply));
  ASSERT_EQ(packets.size(), 1u);
  const auto arrived = heard<ReplyMessage>(packets.front());
  ASSERT_TRUE(arrived);
  EXPECT_EQ(arrived->id, kId);
  EXPECT_EQ(arrived->reply, reply);
  const auto again = good(encode(12, arrived->id, arrived->reply));
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again.front().payload, packets.front().payload);
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
  EXPECT_EQ(encode(0, kId, api::Request(api::Move{})).value().channel, "MOVE");
  EXPECT_EQ(encode(0, kId, api::Request(api::SetTable{})).value().channel, "SET_TABLE");
  for (const api::Request& request : one_of_each(static_cast<api::Request::variant*>(nullptr))) {
    EXPECT_EQ(is_urgent_channel(encode(0, kId, request).value().channel), api::ends_motion(request))
        << api::name_of(request);
  }
}

TEST(Codec, MovesArriveAsTheyWereMeant) {
  expect_arrives(api::Move{.kind = api::Move::Kind::kAbsolute,
                           .motors = {{"theta", -400}, {"chi", api::UserUnits{2.5}}},
                           .dry_run = true});
}

TEST(Codec, OtherRequestsDoToo) {
  const std::vector<api::MotorAmount> both{{"a", 3}, {"b", api::UserUnits{-0.5}}};
  const std::vector<api::Configure::Change> changes{{"a", "offset", "2.5"}};
  const api::TableFile table{.content = {.name = "own",
                                         .time_unit_ns = 4000,
                                         .accel = {2500, 1200},
                                         .decel = std::vector<std::uint16_t>{1200, 2500},
                                         .cruise = std::uint16_t{900},
                                         .revision = 2}};
  const camac::Block block{.mode = camac::BlockMode::kScan,
                           .cycles = {{5, 15, 31, 0xFFFFFF}, {31, 0, 0, 7}},
                           .count = 9,
                           .last_station = 23,
                           .last_subaddress = 3};
  for (const api::Request& request : std::vector<api::Request>{
           api::Stop{{"a", "b"}},
           api::EmergencyStop{},
           api::Enable{{"a"}},
           api::Disable{},
           api::SetPosition{.motors = {{"a", 5}}},
           api::ClearFaults{{"a"}},
           api::UseTable{"group", "own@2"},
           api::ReloadTables{},
           api::Home{{"a"}},
           api::Home{.all = true},
           api::Arm{.edge = api::Edge::kFalling,
                    .delay_us = 100,
                    .motors = {{"a", 3}},
                    .while_connected = true},
           api::ArmLine{.edge = api::Edge::kFalling,
                        .delay_us = 77,
                        .kind = api::Move::Kind::kAbsolute,
                        .motors = both,
                        .speed = api::Speed{.per_s = 4, .in_steps = true},
                        .duration_s = 2.5,
                        .while_connected = true},
           api::ArmLine{.motors = {{"a", 3}}},
           api::Disarm{{"a"}},
           api::PositionCompare{.motor = "a",
                                .position = 9,
                                .arrivals = {.negative = true},
                                .delay_us = 5,
                                .width_us = 6},
           api::Confirm{{"a"}},
           api::GetHistory{.motor = "a", .most = 7},
           api::Camac{.crate = 62, .block = block},
           api::Configure{.motors = {"a"}},
           api::Configure{.changes = changes, .file_sha256 = "abc"},
           api::Configure{
               .kind = api::Configure::Kind::kChange, .changes = changes, .file_sha256 = "abc"},
           api::Configure{
               .kind = api::Configure::Kind::kSaved, .changes = changes, .file_sha256 = "abc"},
           api::MoveLine{.kind = api::Move::Kind::kAbsolute,
                         .motors = both,
                         .dry_run = true,
                         .speed = api::Speed{.per_s = 2.5},
                         .duration_s = 12.5,
                         .law = api::MoveLine::Law::kElementary,
                         .feed = api::Speed{.per_s = 7, .in_steps = true}},
           api::MoveLine{},
           api::MovePath{.motors = {"a"},
                         .rows = 3,
                         .first_row = 1,
                         .positions = {0.5, -2},
                         .speeds = {0, 2},
                         .corners = api::MovePath::Corners::kExact,
                         .dry_run = true,
                         .speed = api::Speed{.per_s = 2.5}},
           api::Follow{.part = api::Follow::Part::kLastRows,
                       .array = 7,
                       .motors = {"a", "b"},
                       .cubic = true,
                       .stretch = 1.5,
                       .time_s = {0, 0.5},
                       .positions = {1, 2, 3, 4.25}},
           api::Follow{.part = api::Follow::Part::kRun},
           api::Jog{.motor = "a", .per_s = -2.5, .keepalive_ms = 300, .steps_after = 7},
           api::Jog{.renew = true},
           api::ListTables{},
           api::GetTable{"own"},
           api::SetTable{.table = "own", .content = table, .expected_hash = "abc"}}) {
    expect_arrives(request);
  }
}

TEST(Codec, HelloSubscriptionAndStatusArrive) {
  const auto hello = said<Hello>(encode(1, Hello{.client_id = "scan", .nonce = -5}).value());
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->client_id, "scan");
  EXPECT_EQ(hello->nonce, -5);
  const auto wanted =
      said<Subscription>(encode(Subscription{.state = true, .health = true}).value());
  ASSERT_TRUE(wanted);
  EXPECT_TRUE(wanted->state);
  EXPECT_FALSE(wanted->description);
  const Packet status = encode(1, kId, GetStatus{}).value();
  const auto asked = decode_client_message(status.channel, status.payload);
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->id, kId);
  const auto welcome = heard<Welcome>(
      encode(1, Welcome{.hello = {.client_id = "scan", .nonce = -5}, .run = 3, .session = 4})
          .value());
  ASSERT_TRUE(welcome);
  EXPECT_EQ(welcome->session, 4);
  EXPECT_EQ(welcome->hello.nonce, -5);
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
  expect_reply_arrives(api::Accepted{});
  expect_reply_arrives(api::Refused{"why"});
  const api::TableRef table{.name = "own", .revision = 2, .hash = "0123abcd"};
  expect_reply_arrives(
      api::Completed{.outcome = api::Outcome::kLimit,
                     .reason = "theta: stopped",
                     .detail = std::vector<api::MotorResult>{
                         {"theta", api::Outcome::kLimit, 7, 1.75, -0.25, "mm", 2, table, "me"},
                         {"chi", api::Outcome::kReached, 9, 9, 9, "steps", 0, table}}});
}

TEST(Codec, PlansAndTablesDoToo) {
  const api::PastMotion motion{.utime_us = 1,
                               .what = "move",
                               .who = "w",
                               .from_steps = -2,
                               .to_steps = 3,
                               .outcome = "reached",
                               .reason = "r",
                               .from_text = "-2.0 mm",
                               .to_text = "3.0 mm"};
  for (const api::Detail& detail : std::vector<api::Detail>{
           api::MovePlan{
               .ticks = 5,
               .motors = {{.motor = "a", .steps = 3, .duration_us = 4, .peak_steps_per_s = 5}}},
           api::TableList{{{.name = "own", .fault = "f"}}}, api::MotionHistory{{motion, motion}},
           api::CamacResult{
               .block = {.responses = {{true, false, 0xFFFFFF}, {false, true, 0}}, .tally = 2},
               .requests = 1U << 22},
           api::Configuration{
               .path = "/etc/b.toml",
               .sha256 = "abc",
               .settings = {{.motor = "a", .key = "offset", .value = "2.5", .in_file = "0"}}},
           api::TableFile{.content = {.name = "own", .time_unit_ns = 4000, .accel = {2500, 1200}},
                          .hash = "abc"}}) {
    expect_reply_arrives(api::Completed{.reason = "r", .detail = detail});
  }
}

// Its parts, decoded in this order of their indices and put together, are this reply.
void expect_put_together(const api::Reply& reply, const std::vector<std::size_t>& order) {
  const auto packets = good(encode(1, kId, reply));
  ReplyParts parts;
  std::optional<api::Reply> whole;
  for (const std::size_t part : order) {
    EXPECT_FALSE(whole);
    const Packet& packet = packets.at(part);
    EXPECT_LE(packet.payload.size(), kMaxMessageBytes);
    const auto message = heard<ReplyMessage>(packet);
    ASSERT_TRUE(message);
    EXPECT_EQ(message->id, kId);
    EXPECT_EQ(message->parts, static_cast<std::int32_t>(packets.size()));
    whole = parts.add(*message);
  }
  ASSERT_TRUE(whole);
  EXPECT_TRUE(*whole == reply) << "of so many motors that they are not printed";
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
  const std::size_t parts = encode(1, kId, reply).value().size();
  ASSERT_GE(parts, 5u);
  std::vector<std::size_t> order{4, 2, 2, 1, 3, 4};
  for (std::size_t part = 5; part < parts; ++part) order.push_back(part);
  order.push_back(0);
  expect_put_together(reply, order);
}

TEST(Codec, APlanOf2048MotorsComesInParts) {
  api::MovePlan plan{.duration_us = 5, .ticks = 6, .traffic = api::MovePlan::Traffic{7, 8}};
  for (int i = 0; i < 2048; ++i) {
    plan.motors.push_back({.motor = "motor" + std::to_string(i), .steps = i, .duration_us = 2 * i});
  }
  expect_put_together(api::Completed{.reason = "r", .detail = plan}, {1, 0});
}

TEST(Codec, AListOfManyTablesComesInParts) {
  api::TableList list;
  for (int i = 0; i < 5000; ++i) list.entries.push_back({.name = std::string(60, 'x')});
  const api::Completed reply{.reason = "all tables", .detail = list};
  std::vector<std::size_t> order(encode(1, kId, reply).value().size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = order.size() - 1 - i;
  EXPECT_GT(order.size(), 5u);
  expect_put_together(reply, order);
}

TEST(Codec, LongBlocksOfACrateComeInParts) {
  api::CamacResult crate{.block = {.tally = 20'000}, .requests = 5};
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    crate.block.responses.push_back({.x = i % 2 == 0, .q = i % 3 == 0, .data = i});
  }
  expect_put_together(api::Completed{.reason = "r", .detail = crate}, {1, 0});
}

TEST(Codec, LamArrives) {
  const api::CamacLam lam{.crate = 3, .raised = 16, .requests = 1U << 22 | 16, .demand = true};
  const auto packet = encode(77, lam);
  ASSERT_TRUE(packet);
  EXPECT_EQ(packet->channel, "CAMAC_LAM");
  const auto message = heard<CamacLamMessage>(*packet);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->lam, lam);
  EXPECT_EQ(message->utime_us, 77);
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
  const Packet often = encode(part, 11, state).value();
  EXPECT_EQ(often.channel, "STATE");
  const auto message = heard<StateMessage>(often);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->snapshot, state);
  EXPECT_EQ(message->dropped_messages, 11);
  EXPECT_EQ(message->part.sequence, 3);
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
  const Packet rare = encode(part, description).value();
  EXPECT_EQ(rare.channel, "DESCRIPTION");
  const auto described = heard<DescriptionMessage>(rare);
  ASSERT_TRUE(described);
  EXPECT_EQ(described->snapshot, description);
  const api::HealthSnapshot health{.bus = "hall",
                                   .port_state = "open",
                                   .latency = {{1000, 7}, {INT64_MAX, 1}},
                                   .mcus = {{.mcu = "hall:1", .ramp_downs = 3}}};
  const Packet sick = encode(part, health).value();
  EXPECT_EQ(sick.channel, "HEALTH");
  const auto told = heard<HealthMessage>(sick);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->snapshot, health);
}

TEST(Codec, TheStateOfSixteenMotorsFitsAnEthernetFrameTwice) {
  api::StateSnapshot state{.bus = "hall", .mcu = "hall:1"};
  for (int i = 0; i < 16; ++i) state.motors.push_back({.name = "motor" + std::to_string(i)});
  EXPECT_LT(encode(Part{}, 0, state).value().payload.size(), 2 * 1400u);
}

// Whatever decodes can be encoded, and a request arrives then as it is.
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
        const auto* request = std::get_if<api::Request>(&message->content);
        if (request == nullptr) continue;
        const auto packet = encode(0, message->id, *request);
        ASSERT_TRUE(packet);
        // What cannot be said, as a code of a table that has none, has become nothing by then.
        const auto again = said<api::Request>(*packet);
        ASSERT_TRUE(again);
        expect_arrives(*again);
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
