// The real bushctl against a daemon made up here, over real LCM. The program runs itself again
// within a network of its own (tests/tools/with-loopback-multicast), so nothing is needed of the
// machine and nothing else is heard.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lcm/codec.h"
#include "lcm/wire.h"
#include "source_path.h"
#include "tools/bushctl/run_bushctl.h"

namespace bushctl::test {
namespace {

using api::Outcome;
using testing::HasSubstr;
using testing::Not;

TEST(Bushctl, StatusAsJsonHasTheAgreedKeys) {
  FakeDaemon daemon(silent());
  const Ran ran = bushctl({"status", "--json"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const auto status = nlohmann::json::parse(ran.out);
  ASSERT_EQ(status["motors"].size(), 4u);
  const auto& theta = status["motors"][0];
  EXPECT_EQ(theta["name"], "theta");
  EXPECT_EQ(theta["mcu"], "hall:1");
  EXPECT_EQ(theta["output"], 0);
  EXPECT_EQ(theta["group"], "goniometer");
  EXPECT_EQ(theta["table"]["name"], "bushd2-constant");
  EXPECT_EQ(theta["table"]["revision"], 3);
  EXPECT_EQ(theta["table"]["hash"], "0a1b2c3d");
  EXPECT_EQ(theta["position_steps"], -12);
  EXPECT_EQ(theta["target_steps"], 400);
  EXPECT_EQ(theta["velocity_steps_per_s"], 2500.5);
  EXPECT_EQ(theta["moving"], true);
  EXPECT_EQ(theta["trust"], "known");
  EXPECT_EQ(status["motors"][3]["name"], "stop");
  EXPECT_EQ(status["motors"][3]["mcu"], "hall:2");
  EXPECT_EQ(status["motors"][3]["trust"], "uncertain");
  ASSERT_EQ(status["mcus"].size(), 2u);
  EXPECT_EQ(status["mcus"][1]["mcu"], "hall:2");
  EXPECT_EQ(status["mcus"][1]["state"], "READY");
  EXPECT_EQ(status["mcus"][1]["boot_number"], 42);
}

TEST(Bushctl, StatusIsATableOfMotorsAndMcus) {
  FakeDaemon daemon(silent());
  const Ran ran = bushctl({"status"});
  EXPECT_EQ(ran.code, 0);
  EXPECT_THAT(ran.out, HasSubstr("theta  hall:1       0  goniometer"));
  EXPECT_THAT(ran.out, HasSubstr("hall:2  READY    42"));
}

TEST(Bushctl, StatusThatIsNotCompleteSaysSo) {
  FakeDaemon daemon;
  daemon.lose_second_mcu();
  daemon.start();
  const Ran ran = bushctl({"status", "--timeout-s", "1"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.out, HasSubstr("theta  hall:1"));
  EXPECT_THAT(ran.out, Not(HasSubstr("hall:2")));
  EXPECT_THAT(ran.err, HasSubstr("incomplete: messages were lost, nothing of 1 of 2 MCUs"));
  EXPECT_THAT(ran.err, HasSubstr("rmem_max"));
  EXPECT_EQ(bushctl({"status", "--json", "--timeout-s", "1"}).code, 1);
}

// Linux holds packets with a TTL of 0 back only at devices where the group was joined.
TEST(Bushctl, WithATtlOf0NothingLeavesThisPcWhereverTheRouteLeads) {
  const auto shell = [](const std::string& command) {
    return std::system(("PATH=$PATH:/usr/sbin:/sbin; " + command).c_str());  // NOLINT: of ours
  };
  if (shell("ip link add leak0 type veth peer name leak1 && ip link set leak0 up && ip link set "
            "leak1 up && ip addr add 10.9.0.1/24 dev leak0") != 0) {
    GTEST_SKIP() << "no veth here";
  }
  FakeDaemon daemon(silent());
  ASSERT_EQ(bushctl({"status"}).code, 0);
  ASSERT_EQ(shell("ip route del 239.255.76.67/32; ip route add 239.255.76.67/32 dev leak0"), 0);
  const auto sent = [&] {
    const std::string file = testing::TempDir() + "leak0";
    shell(
        "ip -s -j link show leak0 | grep -o '\"tx\":{[^}]*\"packets\":[0-9]*' | grep -o '[0-9]*$' "
        ">" +
        file);
    long count = -1;
    std::ifstream(file) >> count;
    return count;
  };
  const long before = sent();
  // 30 states of two MCUs.
  const Ran watch = bushctl({"watch", "--count", "30"});
  EXPECT_EQ(watch.code, 0) << watch.err;
  // LCM itself tries its sockets by a packet, and Linux tells routers of who has joined.
  EXPECT_LT(sent() - before, 15);
  shell("ip link del leak0; ip route replace 239.255.76.67/32 dev lo");
}

TEST(Bushctl, WatchTellsOfLosses) {
  FakeDaemon daemon(silent());
  Program watch(with_program({"watch", "--count", "20"}));
  ASSERT_TRUE(watch.wait_for("theta"));
  daemon.lose(3);
  EXPECT_EQ(watch.finish(), 0);
  EXPECT_THAT(watch.err(), HasSubstr("messages of bushd were lost"));
}

TEST(Bushctl, StatusSurvivesHostileStates) {
  FakeDaemon daemon;
  auto cut = bushd::lcm::encode("STATE", bushd::lcm::StateMessage{}).value();
  auto huge = cut;
  cut.resize(20);
  huge[56] = 0x80;  // the length of `bus` becomes INT32_MIN + 1
  daemon.set_hostile_states({{}, cut, huge, std::vector<std::uint8_t>(65000, 0xFF)});
  daemon.start();
  EXPECT_EQ(bushctl({"status"}).code, 0);
}

// As a datagram on the wire, below what LCM's publish() can make.
class RawSender {
 public:
  ~RawSender() { close(socket_); }
  void send(const std::string& datagram) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(7667);
    to.sin_addr.s_addr = inet_addr("239.255.76.67");
    sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
  }

 private:
  int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

TEST(Bushctl, SurvivesDatagramsThatCrashLcm) {
  FakeDaemon daemon(always(Outcome::kReached));
  Program watch(with_program({"watch", "--count", "10"}));
  ASSERT_TRUE(watch.wait_for("theta"));
  const RawSender sender;
  for (char number = 0; number < 50; ++number) {
    // Sequence number, message of 100 bytes, fragment at 0xFFFFFF00 (so that its end wraps around),
    // second of two.
    const std::string first = std::string("LC03\0\0\0", 7) + number +
                              std::string("\0\0\0d\0\0\0\0\0\0\0\2BUSHD_STATE\0", 24);
    const std::string wrapping =
        std::string("LC03\0\0\0", 7) + number + std::string("\0\0\0d\xFF\xFF\xFF\0\0\1\0\2", 12);
    sender.send(first + std::string(20, 'x'));
    sender.send(wrapping + std::string(0x120, 'y'));
    sender.send(std::string("LC02\0\0\0\0", 8) +
                std::string(40, 'B'));  // a channel name that does not end
    sender.send("LC02");
    sender.send("");
    sender.send("junk");
  }
  EXPECT_EQ(watch.finish(), 0);
  EXPECT_EQ(bushctl({"move", "theta", "5", "--wait"}).code, 0);
}

TEST(Bushctl, NamesDoNotSteerTheTerminal) {
  FakeDaemon daemon;
  daemon.set_name("\x1b]0;owned\x07");
  daemon.start();
  EXPECT_THAT(bushctl({"status"}).out, Not(HasSubstr("\x1b")));
  EXPECT_EQ(nlohmann::json::parse(bushctl({"status", "--json"}).out)["motors"][0]["name"],
            "\x1b]0;owned\x07");
}

// An option begins with a printing character: CLI11 2.4 takes others for a name.
TEST(Bushctl, ItsOwnArgumentsDoNotSteerTheTerminal) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"mo\x1b[31mve"},
                                             {"status", "--x\x1b[31m"},
                                             {"move", "theta", "3\x1b[31m"},
                                             {"--socket", "/tmp/\x1b[31m", "status"}}) {
    const Ran ran = bushctl(arguments);
    EXPECT_NE(ran.code, 0);
    EXPECT_THAT(ran.err, HasSubstr("\\x1b[31m"));
    EXPECT_THAT(ran.out + ran.err, Not(HasSubstr("\x1b")));
  }
}

TEST(Bushctl, WithoutDaemonSaysSoAndFails) {
  const Ran status = bushctl({"status", "--timeout-s", "0.1"});
  EXPECT_EQ(status.code, 1);
  EXPECT_THAT(status.err, HasSubstr("no bushd answers"));
  EXPECT_THAT(status.err, HasSubstr("bushd --config FILE"));
  const Ran move = bushctl({"move", "theta", "5"});
  EXPECT_EQ(move.code, 1);
  EXPECT_THAT(move.err, HasSubstr("no bushd answers"));
}

// LCM is not asked, which would take seconds: a fake daemon that hears nothing shows it.
TEST(Bushctl, WithoutASocketEveryCommandSaysThatBushdIsNotRunning) {
  unsetenv("LCM_DEFAULT_URL");
  FakeDaemon daemon(silent());
  const std::string path = testing::TempDir() + "bushctl_e2e_test.csv";
  std::ofstream(path) << "theta\n0\n1\n";
  const std::string rows = testing::TempDir() + "bushctl_e2e_test_rows.csv";
  std::ofstream(rows) << "time_s, theta\n0, 0\n1, 1\n";
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"status"},
                                             {"status", "--json"},
                                             {"where"},
                                             {"watch"},
                                             {"health"},
                                             {"move", "theta", "5"},
                                             {"move", "theta", "5", "--wait"},
                                             {"arm", "theta", "5", "--delay-us", "75"},
                                             {"disarm"},
                                             {"stop"},
                                             {"stop", "theta", "--wait"},
                                             {"estop"},
                                             {"home", "theta"},
                                             {"set", "theta", "0"},
                                             {"compare", "theta", "5", "--width-us", "7"},
                                             {"path", "run", path},
                                             {"follow", rows},
                                             {"jog", "theta", "5"},
                                             {"jog", "theta", "0"},
                                             {"pause"},
                                             {"resume"},
                                             {"hold"},
                                             {"release"},
                                             {"enable"},
                                             {"disable"},
                                             {"clear"},
                                             {"confirm", "theta"},
                                             {"history", "theta"},
                                             {"config"},
                                             {"table", "list"},
                                             {"table", "reload"},
                                             {"camac", "1", "0", "0"}}) {
    const Ran ran = bushctl(arguments);
    EXPECT_EQ(ran.code, 1) << arguments[0];
    EXPECT_EQ(ran.out, "") << arguments[0];
    EXPECT_EQ(ran.err,
              "bushctl: no control socket at /nonexistent/control: bushd is not running. Start it "
              "with 'sudo systemctl start bushd', or 'bushd --config FILE'; for another daemon use "
              "--socket PATH ($BUSHD_CONTROL), or --lcm\n")
        << arguments[0];
  }
  EXPECT_TRUE(daemon.requests().empty());
  EXPECT_EQ(bushctl({"status", "--lcm"}).code, 0);
  use_lcm();
}

// In a network of its own again, without a route. LCM's library would say it in 14 lines.
TEST(Bushctl, LcmWithoutARouteIsOneSentence) {
  for (const char* command : {"status", "stop"}) {
    Program program({"/usr/bin/env", "unshare", "--net", BUSHCTL, "--lcm", command});
    EXPECT_EQ(program.finish(), 1);
    EXPECT_EQ(program.err(),
              "bushctl: LCM cannot use the URL \"udpm://239.255.76.67:7667?ttl=0\": the address is "
              "wrong or there is no route to it. For this machine only: ip route replace "
              "239.255.76.67/32 dev lo (as root)\n");
  }
}

TEST(Bushctl, ASocketThatIsNamedIsMeant) {
  FakeDaemon daemon(silent());
  const Ran ran = bushctl({"status", "--socket", "/nonexistent/control"});
  EXPECT_EQ(ran.code, 1);
  EXPECT_THAT(ran.err, HasSubstr("no control socket at /nonexistent/control"));
  EXPECT_EQ(bushctl({"status", "--lcm", "--socket", "/x"}).code, 2);
}

TEST(Bushctl, ListensOnTheGivenPrefixOnly) {
  FakeDaemon daemon(silent());
  EXPECT_EQ(bushctl({"--prefix", "LAB", "status", "--timeout-s", "0.2"}).code, 1);
  EXPECT_EQ(bushctl({"status", "--prefix", "BUSHD"}).code, 0);
}

TEST(Bushctl, TakesTheUrlFromTheEnvironmentUnlessGiven) {
  setenv("LCM_DEFAULT_URL", "nonsense", 1);
  FakeDaemon daemon(silent());
  EXPECT_THAT(bushctl({"status"}).err, HasSubstr("nonsense"));
  EXPECT_EQ(bushctl({"status", "--url", "udpm://239.255.76.67:7667?ttl=0"}).code, 0);
  use_lcm();
}

TEST(Bushctl, MixedMovesAndWrongWordsAreUsageErrors) {
  const Ran mixed = bushctl({"move", "theta", "5", "chi", "--to", "6"});
  EXPECT_EQ(mixed.code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("one command is either"));
  EXPECT_EQ(bushctl({"move"}).code, 2);
  EXPECT_EQ(bushctl({"move", "theta"}).code, 2);
  EXPECT_EQ(bushctl({"move", "theta", "1.5", "--steps"}).code, 2);
  EXPECT_EQ(bushctl({"move", "theta", "1,5"}).code, 2);
  EXPECT_EQ(bushctl({"move", "theta", "5", "--wiat"}).code, 2);
  EXPECT_EQ(bushctl({"set", "theta", "x"}).code, 2);
  EXPECT_EQ(bushctl({"dance"}).code, 2);
}

TEST(Bushctl, ACommandThatIsNoneIsNamedWithTheNearest) {
  const Ran ran = bushctl({"movee", "theta", "5"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("there is no command \"movee\" (did you mean \"move\"?)"));
  const Ran nested = bushctl({"--lcm", "table", "uze"});
  EXPECT_EQ(nested.code, 2);
  EXPECT_THAT(nested.err, HasSubstr("there is no command \"uze\" (did you mean \"use\"?)"));
  const Ran far = bushctl({"--prefix", "move", "dance"});
  EXPECT_EQ(far.code, 2);
  EXPECT_THAT(far.err, HasSubstr("there is no command \"dance\" ('bushctl --help'"));
}

TEST(Bushctl, HelpOfACommandWithoutAWordOfItsOwnTellsTheExitCodes) {
  const Ran ran = bushctl({"enable", "--help"});
  EXPECT_EQ(ran.code, 0);
  EXPECT_THAT(ran.out, HasSubstr("Exit codes: 0 done, 1 refused"));
}

TEST(Bushctl, NotANumberIsNoTime) {
  const Ran ran = bushctl({"status", "--timeout-s", "nan"});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("nan is not a number"));
}

TEST(Bushctl, SaysItsVersion) {
  const Ran ran = bushctl({"--version"});
  EXPECT_EQ(ran.code, 0);
  EXPECT_THAT(ran.out, testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(Bushctl, TwoDashesBeforeANegativeNumberChangeNothing) {
  FakeDaemon daemon(always(Outcome::kReached));
  EXPECT_EQ(bushctl({"move", "theta", "--", "-400", "--wait"}).code, 0);
  const auto requests = daemon.requests();
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(std::get<api::Move>(requests[0]).motors, user({{"theta", -400}}));
}

TEST(Bushctl, WatchInAPipePrintsALineForWhatChanged) {
  FakeDaemon daemon(silent());
  const Ran ran = bushctl({"watch", "--count", "3"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "hall:1 READY boot 41\n"
            "theta position -12 target 400 velocity 2500.5 moving\n"
            "chi position 0 target 0 velocity 0.0 at rest uncertain\n"
            "hall:2 READY boot 42\n"
            "phi position -12 target 400 velocity 2500.5 moving\n"
            "stop position 0 target 0 velocity 0.0 at rest uncertain\n");
}

TEST(Bushctl, WatchEndsOnInterrupt) {
  FakeDaemon daemon(silent());
  Program watch(with_program({"watch"}));
  ASSERT_TRUE(watch.wait_for("theta"));
  watch.send_signal(SIGINT);
  EXPECT_EQ(watch.finish(), 0);
}

TEST(Bushctl, WatchLeavesTheTerminalAsItWas) {
  FakeDaemon daemon(silent());
  Program watch(with_program({"watch"}), true);
  ASSERT_TRUE(watch.wait_for("q ends"));
  watch.send_signal(SIGTERM);
  EXPECT_EQ(watch.finish(), 0);
  EXPECT_THAT(watch.out(), testing::StartsWith("\x1b[?1049h"));
  EXPECT_THAT(watch.out(), testing::EndsWith("\x1b[?7h\x1b[?25h\x1b[?1049l"));
}

TEST(Examples, MoveAndWaitInCpp) {
  FakeDaemon daemon(always(Outcome::kReached));
  Program example({EXAMPLE_MOVE_AND_WAIT, "theta", "-400", "chi", "5"});
  EXPECT_EQ(example.finish(), 0) << example.err();
  EXPECT_THAT(example.out(), HasSubstr("chi: reached, stands at 7"));
  EXPECT_EQ(only<api::Move>(daemon).motors, user({{"theta", -400}, {"chi", 5}}));
}

TEST(Examples, MoveAndWaitInPython) {
  FakeDaemon daemon(always(Outcome::kReached));
  const std::string script = bushd::test::source_path("tools/examples/python/move_and_wait.py");
  Program example({"/usr/bin/env", "PYTHONPATH=" EXAMPLE_PYTHON_PATH, "python3", "-B", script,
                   "theta", "-400", "chi", "5"});
  EXPECT_EQ(example.finish(), 0) << example.err();
  EXPECT_THAT(example.out(), HasSubstr("chi: reached, stands at 7"));
  EXPECT_EQ(only<api::Move>(daemon).motors, user({{"theta", -400}, {"chi", 5}}));
}

}  // namespace
}  // namespace bushctl::test

int main(int argc, char** argv) {
  std::vector<char*> again(argv, argv + argc + 1);
  testing::InitGoogleTest(&argc, argv);
  if (!testing::GTEST_FLAG(list_tests) && std::getenv("BUSHCTL_TEST_IN_NAMESPACE") == nullptr) {
    setenv("BUSHCTL_TEST_IN_NAMESPACE", "yes", 1);
    // A daemon of this machine, if there is one, is not meant.
    setenv("BUSHD_CONTROL", "/nonexistent/control", 1);
    bushctl::test::use_lcm();
    std::string helper = bushd::test::source_path("tests/tools/with-loopback-multicast");
    again.insert(again.begin(), helper.data());
    execv(helper.c_str(), again.data());
    return 1;
  }
  return RUN_ALL_TESTS();
}
