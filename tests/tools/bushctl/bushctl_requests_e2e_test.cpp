// What the real bushctl asks a daemon for: moves and all the others, over real LCM.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <future>
#include <string>
#include <vector>

#include "tools/bushctl/run_bushctl.h"

namespace bushctl::test {
namespace {

using api::Outcome;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Bushctl, MoveOfSeveralMotorsIsOneCommand) {
  FakeDaemon daemon(always(Outcome::kReached));
  const Ran ran = bushctl({"move", "theta", "-400", "chi", "20", "--wait"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "accepted\ntheta: reached, stands at 7 by bushd2-constant@3 (0a1b2c3d)\n"
            "chi: reached, stands at 7 by bushd2-constant@3 (0a1b2c3d)\n");
  const auto move = only<api::Move>(daemon);
  EXPECT_EQ(move.kind, api::Move::Kind::kRelative);
  EXPECT_EQ(move.motors, user({{"theta", -400}, {"chi", 20}}));
  EXPECT_THAT(daemon.client_ids().at(0), HasSubstr("bushctl@"));
}

TEST(Bushctl, ArmedMovesNameTheirEdgeAndDelay) {
  FakeDaemon daemon(always(Outcome::kReached));
  const Ran ran = bushctl(
      {"arm", "theta", "-400", "chi", "20", "--edge", "falling", "--delay-us", "75", "--wait"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  const auto arm = only<api::Arm>(daemon);
  EXPECT_EQ(arm.motors, user({{"theta", -400}, {"chi", 20}}));
  EXPECT_EQ(arm.edge, api::Edge::kFalling);
  EXPECT_EQ(arm.delay_us, 75);
  EXPECT_EQ(bushctl({"arm", "theta", "5"}).code, 2) << "no delay";
  EXPECT_EQ(bushctl({"arm", "theta", "5", "--delay-us", "49"}).code, 2);
}

TEST(Bushctl, MoveToPositionsAndMotorsCalledLikeCommands) {
  FakeDaemon daemon(always(Outcome::kReached));
  EXPECT_EQ(bushctl({"move", "--wait", "stop", "--to", "-5", "phi", "--to=6"}).code, 0);
  const auto move = only<api::Move>(daemon);
  EXPECT_EQ(move.kind, api::Move::Kind::kAbsolute);
  EXPECT_EQ(move.motors, user({{"stop", -5}, {"phi", 6}}));
}

TEST(Bushctl, WithoutWaitingAcceptedIsEnough) {
  FakeDaemon daemon([](const api::Request&, int) { return Replies{api::Accepted{}}; });
  const Ran ran = bushctl({"move", "theta", "5"});
  EXPECT_EQ(ran.code, 0);
  EXPECT_EQ(ran.out, "accepted\n");
}

TEST(Bushctl, EveryResultButReachedFails) {
  for (const Outcome outcome :
       {Outcome::kLimit, Outcome::kStopped, Outcome::kLink, Outcome::kFault}) {
    FakeDaemon daemon(always(outcome));
    const Ran ran = bushctl({"move", "theta", "5", "--wait"});
    EXPECT_EQ(ran.code, 1) << word(outcome);
    EXPECT_THAT(ran.err, HasSubstr(std::string(word(outcome)) + " for a reason"));
  }
}

TEST(Bushctl, RefusedPrintsTheReason) {
  FakeDaemon daemon(
      [](const api::Request&, int) { return Replies{api::Refused{"theta is moving"}}; });
  const Ran ran = bushctl({"move", "theta", "5"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("theta is moving"));
}

TEST(Bushctl, RepeatsACommandThatGotLost) {
  FakeDaemon daemon([](const api::Request& command, int times) {
    return times < 3 ? Replies{} : Replies{api::Accepted{}, result(command, Outcome::kReached)};
  });
  EXPECT_EQ(bushctl({"move", "theta", "5", "--wait"}).code, 0);
  EXPECT_EQ(daemon.requests().size(), 1u);
}

TEST(Bushctl, AsksAgainForALostResult) {
  FakeDaemon daemon([](const api::Request& command, int times) {
    return times < 2 ? Replies{api::Accepted{}}
                     : Replies{api::Accepted{}, result(command, Outcome::kReached)};
  });
  EXPECT_EQ(bushctl({"move", "theta", "5", "--wait"}).code, 0);
}

TEST(Bushctl, DoesNotRepeatAMoveToARestartedDaemon) {
  FakeDaemon daemon([](const api::Request&, int) { return Replies{api::Accepted{}}; });
  Program move(with_program({"move", "theta", "5", "--wait"}));
  ASSERT_TRUE(move.wait_for("accepted"));
  daemon.restart();
  EXPECT_EQ(move.finish(), 1);
  EXPECT_THAT(move.err(), HasSubstr("restarted"));
}

TEST(Bushctl, AnEmergencyStopSucceedsIfItIsDoneEverywhere) {
  FakeDaemon daemon([](const api::Request&, int) {
    return Replies{api::Accepted{},
                   api::Completed{.outcome = Outcome::kDone, .reason = "done", .detail = {}}};
  });
  EXPECT_EQ(bushctl({"estop"}).code, 0);
}

template <class Request>
constexpr bool kOnlyNamesMotors = requires(Request request) {
  request.motors = api::MotorNames{};
} && sizeof(Request) == sizeof(api::MotorNames);

// The subcommand has the first word of its name.
template <class Request>
void expect_subcommand() {
  if constexpr (kOnlyNamesMotors<Request>) {
    const std::string name(Request::kName.substr(0, Request::kName.find(' ')));
    SCOPED_TRACE(name);
    FakeDaemon daemon(always(Outcome::kDone));
    EXPECT_EQ(bushctl({name, "theta", "phi"}).code, 0);
    EXPECT_THAT(only<Request>(daemon).motors, ElementsAre("theta", "phi"));
  }
}

template <class... Request>
void expect_subcommands(const std::variant<Request...>* /*requests*/) {
  (expect_subcommand<Request>(), ...);
}

TEST(Bushctl, EachRequestThatOnlyNamesMotorsHasASubcommand) {
  expect_subcommands(static_cast<const api::Request::variant*>(nullptr));
}

TEST(Bushctl, OtherCommandsSayWhatTheyAre) {
  FakeDaemon daemon(always(Outcome::kDone));
  EXPECT_EQ(bushctl({"stop"}).code, 0);
  EXPECT_EQ(bushctl({"stop", "theta", "--wait"}).code, 0);
  EXPECT_EQ(bushctl({"disable"}).code, 0);
  EXPECT_EQ(bushctl({"confirm"}).code, 2) << "of no motor";
  EXPECT_EQ(bushctl({"set", "theta", "-100"}).code, 0);
  EXPECT_EQ(bushctl({"estop"}).code, 1) << "done for a reason: not everywhere";
  EXPECT_EQ(bushctl({"compare", "theta", "-5", "--width-us", "7"}).code, 0);
  const auto requests = daemon.requests();
  ASSERT_EQ(requests.size(), 6u);
  EXPECT_TRUE(std::get<api::Stop>(requests[0]).motors.empty());
  EXPECT_THAT(std::get<api::Stop>(requests[1]).motors, ElementsAre("theta"));
  EXPECT_TRUE(std::get<api::Disable>(requests[2]).motors.empty());
  EXPECT_EQ(std::get<api::SetPosition>(requests[3]).motors, user({{"theta", -100}}));
  EXPECT_TRUE(std::holds_alternative<api::EmergencyStop>(requests[4]));
  const auto compare = std::get<api::PositionCompare>(requests[5]);
  EXPECT_EQ(compare.position, api::Amount(api::UserUnits{-5}));
  EXPECT_EQ(compare.width_us, 7);
}

TEST(Bushctl, SetFailsWhenTheMcuDidNotTakeIt) {
  FakeDaemon daemon(always(Outcome::kFault));
  EXPECT_EQ(bushctl({"set", "theta", "0"}).code, 1);
}

TEST(Bushctl, CtrlCRampsDownAndSaysWhereTheMotorStands) {
  FakeDaemon daemon;
  std::atomic<bool> stopped{false};
  daemon.start([&stopped](const api::Request& request, int) -> Replies {
    if (std::holds_alternative<api::Stop>(request)) {
      stopped = true;
      return {api::Accepted{}};
    }
    if (!stopped) return {api::Accepted{}};
    return {result(request, Outcome::kStopped)};
  });
  Program move(with_program({"move", "theta", "5", "--wait"}));
  ASSERT_TRUE(move.wait_for("accepted"));
  move.send_signal(SIGINT);
  EXPECT_EQ(move.finish(), 130);
  EXPECT_THAT(move.err(), HasSubstr("ramping down"));
  EXPECT_THAT(move.out(), HasSubstr("theta: stopped, stands at 7"));
  const auto requests = daemon.requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(std::get<api::Stop>(requests[1]).motors, api::MotorNames{"theta"});
}

TEST(Bushctl, AfterASecondCtrlCNothingIsWaitedFor) {
  FakeDaemon daemon;
  std::promise<void> stopped;
  daemon.start([&stopped](const api::Request& request, int times) {
    if (std::holds_alternative<api::Stop>(request) && times == 1) stopped.set_value();
    return Replies{api::Accepted{}};
  });
  Program move(with_program({"move", "theta", "5", "--wait"}));
  ASSERT_TRUE(move.wait_for("accepted"));
  move.send_signal(SIGINT);
  stopped.get_future().wait();
  move.send_signal(SIGINT);
  EXPECT_EQ(move.finish(), 130);
  EXPECT_THAT(move.err(), HasSubstr("the stop was sent"));
}

TEST(Bushctl, AMoveWhoseProgramIsEndedGoesOn) {
  FakeDaemon daemon([](const api::Request&, int) { return Replies{api::Accepted{}}; });
  Program move(with_program({"move", "theta", "5", "--wait"}));
  ASSERT_TRUE(move.wait_for("accepted"));
  move.send_signal(SIGTERM);
  EXPECT_EQ(move.finish(), 130);
  EXPECT_THAT(move.err(), HasSubstr("the move goes on"));
  EXPECT_EQ(daemon.requests().size(), 1u);
}

}  // namespace
}  // namespace bushctl::test
