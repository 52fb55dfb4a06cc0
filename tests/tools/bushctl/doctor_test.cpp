// What doctor makes of what was seen: each case is a lab with one thing wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools/bushctl/doctor/diagnosis.h"
#include "tools/bushctl/doctor/proc.h"

namespace bushctl::doctor {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

namespace api = bushd::api;

constexpr std::int64_t kNow = 1'790'000'000'000'000;
constexpr std::uint32_t kDialout = 20;
constexpr std::uint32_t kBushd = 990;

// One bus with two MCUs, all in order.
api::HealthSnapshot good_health() {
  api::HealthSnapshot health{.bus = "hall", .port_state = "open", .latency = {{1000, 200'000}}};
  for (const char* mcu : {"hall:1", "hall:2"}) {
    health.mcus.push_back({.mcu = mcu,
                           .unique_id = "0011223344556677",
                           .firmware_version = 4,
                           .reset_cause = "power-on"});
  }
  return health;
}

Observations good() {
  Observations seen;
  seen.asking = {.name = "anna", .uid = 1000, .groups = {1000, kBushd}};
  seen.serving = {.name = "bushd", .uid = 120, .groups = {kBushd, kDialout}};
  seen.configuration = {.path = "/etc/bushd/bushd.toml",
                        .exists = true,
                        .rights = {.uid = 0, .gid = 0, .mode = 0644, .group = "root"},
                        .extent = "2 motors on 2 MCUs and 1 bus",
                        .sha256 = "abc"};
  seen.ports = {{.bus = "hall",
                 .configured = "/dev/bushd/A1-00",
                 .path = "/dev/bushd/A1-00",
                 .target = "/dev/ttyUSB0",
                 .rights = {.uid = 0, .gid = kDialout, .mode = 0660, .group = "dialout"},
                 .latency_timer_ms = 1,
                 .holders = {{.pid = 77, .program = "bushd"}}}};
  seen.lcm = {.url = "udpm://239.255.76.67:7667?ttl=0",
              .address = "239.255.76.67",
              .port = 7667,
              .device = "lo",
              .largest_buffer = 4 << 20};
  seen.clock = {.unix_us = kNow, .synchronised = true};
  seen.folders = {{.what = "state",
                   .path = "/var/lib/bushd",
                   .exists = true,
                   .rights = {.uid = 120, .gid = kBushd, .mode = 0750, .group = "bushd"},
                   .free_bytes = 9ull << 30,
                   .free_files = 100'000}};
  seen.sockets = {
      {.path = "/run/bushd/control", .state = SocketSeen::State::kListens, .group = "bushd"}};
  seen.daemon = {.config_path = "/etc/bushd/bushd.toml", .config_sha256 = "abc", .unix_us = kNow};
  for (const char* name : {"hall:1", "hall:2"}) {
    bushd::lcm::StateMessage state;
    state.part.utime_us = kNow;
    state.snapshot = {.mcu = name,
                      .state = api::McuState::kReady,
                      .motors = {{.name = std::string("of ") + name}}};
    seen.daemon.status.states.push_back(state);
    seen.daemon.status.descriptions.push_back(
        {.part = {}, .snapshot = {.mcu = name, .address = 1}});
  }
  seen.daemon.status.healths = {{.part = {}, .snapshot = good_health()}};
  return seen;
}

// What is not in order: "error port: ... -> ...".
std::vector<std::string> complaints(const Observations& seen) {
  std::vector<std::string> out;
  for (const Finding& found : diagnose(seen)) {
    if (found.level == Level::kOk) continue;
    EXPECT_FALSE(found.remedy.empty()) << found.seen;
    out.push_back(std::string(word(found.level)) + " " + found.check + ": " + found.seen + " -> " +
                  found.remedy);
  }
  return out;
}

template <class Spoil>
std::vector<std::string> with(Spoil spoil) {
  Observations seen = good();
  spoil(seen);
  return complaints(seen);
}

api::HealthSnapshot& health(Observations& seen) {
  return seen.daemon.status.healths[0].snapshot;
}

TEST(Doctor, FindsNothingInAGoodLab) {
  EXPECT_THAT(complaints(good()), IsEmpty());
  EXPECT_FALSE(any_error(diagnose(good())));
  EXPECT_THAT(lines(diagnose(good())).back(), "0 errors, 0 warnings");
}

TEST(Doctor, ComputedAxesAreNoMcus) {
  EXPECT_THAT(with([](Observations& seen) {
                bushd::lcm::StateMessage axis;
                axis.part.utime_us = kNow;
                axis.snapshot = {.mcu = "hall:gap",
                                 .state = api::McuState::kOffline,
                                 .motors = {{.name = "gap", .trust = api::Trust::kUncertain}}};
                seen.daemon.status.states.push_back(axis);
                seen.daemon.status.descriptions.push_back({});
              }),
              IsEmpty());
}

TEST(Doctor, WithoutAConfigurationSetupIsTheRemedy) {
  EXPECT_THAT(with([](Observations& seen) {
                seen.configuration.exists = false;
                seen.ports.clear();
              }),
              ElementsAre(AllOf(HasSubstr("error configuration"), HasSubstr("bushctl setup"))));
}

TEST(Doctor, ErrorsOfConfigurationAndTablesAreThoseOfTheDaemon) {
  EXPECT_THAT(with([](Observations& seen) {
                seen.configuration.error = "bushd.toml:3:1: group[0].table: there is no table";
                seen.configuration.sha256.clear();
              }),
              ElementsAre(AllOf(HasSubstr("there is no table"), HasSubstr("--check-config"))));
}

TEST(Doctor, TheUserOfTheDaemonHasToReadTheConfiguration) {
  EXPECT_THAT(with([](Observations& seen) { seen.configuration.rights.mode = 0600; }),
              ElementsAre(AllOf(HasSubstr("user bushd may not read it (0600, group root)"),
                                HasSubstr("chmod 0644 /etc/bushd/bushd.toml"))));
}

TEST(Doctor, APortThatIsNotThereNamesThoseThatAre) {
  EXPECT_THAT(with([](Observations& seen) {
                seen.ports[0].path.clear();
                seen.adapters = {"/dev/serial/by-id/usb-B"};
              }),
              ElementsAre(AllOf(HasSubstr("error port: hall: /dev/bushd/A1-00 is not there"),
                                HasSubstr("/dev/serial/by-id/usb-B"))));
}

TEST(Doctor, TheUserOfTheDaemonNeedsRightsToThePort) {
  EXPECT_THAT(with([](Observations& seen) { seen.serving.groups = {kBushd}; }),
              ElementsAre(AllOf(HasSubstr("user bushd may not use /dev/bushd/A1-00 (0660, group "
                                          "dialout)"),
                                HasSubstr("usermod -aG dialout bushd"))));
  EXPECT_THAT(
      with([](Observations& seen) { seen.serving = {.name = "root", .uid = 0, .groups = {}}; }),
      IsEmpty());
}

TEST(Doctor, AnotherProgramOnThePortIsNamed) {
  EXPECT_THAT(with([](Observations& seen) {
                seen.ports[0].holders.push_back({.pid = 9, .program = "ModemManager"});
              }),
              ElementsAre(AllOf(HasSubstr("ModemManager (pid 9)"), HasSubstr("disable --now"))));
  EXPECT_THAT(with([](Observations& seen) {
                seen.ports[0].holders.push_back({.pid = 9, .program = "bushd"});
              }),
              ElementsAre(HasSubstr("2 daemons")));
}

TEST(Doctor, ASlowLatencyTimerIsTold) {
  EXPECT_THAT(with([](Observations& seen) { seen.ports[0].latency_timer_ms = 16; }),
              ElementsAre(AllOf(HasSubstr("16 ms"), HasSubstr("devices/ttyUSB0/latency_timer"))));
}

TEST(Doctor, LcmNeedsARouteThatFitsItsTtlAndRoom) {
  EXPECT_THAT(with([](Observations& seen) { seen.lcm.device.reset(); }),
              ElementsAre(AllOf(HasSubstr("no route for 239.255.76.67"), HasSubstr("ip route"))));
  EXPECT_THAT(with([](Observations& seen) { seen.lcm.ttl = 1; }),
              ElementsAre(HasSubstr("other PCs hear nothing")));
  EXPECT_THAT(with([](Observations& seen) { seen.lcm.device = "eth0"; }),
              ElementsAre(HasSubstr("leads to eth0")));
  EXPECT_THAT(with([](Observations& seen) { seen.lcm.largest_buffer = 212'992; }),
              ElementsAre(HasSubstr("net.core.rmem_max is 212992")));
  EXPECT_THAT(with([](Observations& seen) { seen.lcm.sockets = {{.port = 7667, .drops = 42}}; }),
              IsEmpty())
      << "bushd's own filter has refused them, or it was long ago";
  EXPECT_THAT(with([](Observations& seen) { seen.lcm.lost_meanwhile = 5; }),
              ElementsAre(HasSubstr("5 datagrams found no room at port 7667 while doctor looked")));
}

TEST(Doctor, AClockThatNobodySetsIsAWarningAndOneThatIsWrongAnError) {
  EXPECT_THAT(with([](Observations& seen) { seen.clock.synchronised = false; }),
              ElementsAre(HasSubstr("warning clock")));
  EXPECT_THAT(with([](Observations& seen) { seen.clock.unix_us = 12; }),
              ElementsAre(HasSubstr("error clock: this PC's clock is years behind")));
  EXPECT_THAT(with([](Observations& seen) { seen.clock.synchronised.reset(); }), IsEmpty());
  EXPECT_THAT(with([](Observations& seen) { seen.daemon.unix_us += 60'000'000; }),
              ElementsAre(HasSubstr("differs by 60 s")));
}

TEST(Doctor, TheStateFolderIsThereWritableAndHasRoom) {
  EXPECT_THAT(with([](Observations& seen) { seen.folders[0].exists = false; }),
              ElementsAre(HasSubstr("install -d -o bushd")));
  EXPECT_THAT(with([](Observations& seen) { seen.folders[0].rights.uid = 0; }),
              ElementsAre(AllOf(HasSubstr("user bushd may not write there"), HasSubstr("chown"))));
  EXPECT_THAT(with([](Observations& seen) { seen.folders[0].free_bytes = 100 << 20; }),
              ElementsAre(HasSubstr("warning disk: /var/lib/bushd (state): 100 MB free")));
  EXPECT_THAT(with([](Observations& seen) { seen.folders[0].free_bytes = 1 << 20; }),
              ElementsAre(HasSubstr("error disk")));
  EXPECT_THAT(with([](Observations& seen) { seen.folders[0].free_files = 3; }),
              ElementsAre(HasSubstr("3 files free")));
}

TEST(Doctor, AUserWithoutTheGroupIsToldAndThatLcmIsUsed) {
  const auto barred = [](Observations& seen) {
    seen.sockets[0].state = SocketSeen::State::kNoRight;
    seen.daemon.by_socket = false;
  };
  EXPECT_THAT(with(barred),
              ElementsAre(AllOf(HasSubstr("is for group bushd, and anna is not in it"),
                                HasSubstr("usermod -aG bushd anna")),
                          AllOf(HasSubstr("by LCM only"), HasSubstr("cannot command"))));
  EXPECT_THAT(with([&](Observations& seen) {
                barred(seen);
                seen.sockets[0].is_member_elsewhere = true;
              })[0],
              HasSubstr("log in again"));
  EXPECT_THAT(with([&](Observations& seen) {
                barred(seen);
                seen.sockets[0].group = "root";
              })[0],
              HasSubstr("set [control] group"));
}

TEST(Doctor, WithoutADaemonTheRestIsExamined) {
  const auto found = with([](Observations& seen) {
    seen.sockets[0].state = SocketSeen::State::kAbsent;
    seen.daemon = {.unreachable = "no bushd answers"};
    seen.ports[0].latency_timer_ms = 16;
  });
  EXPECT_THAT(found, ElementsAre(HasSubstr("latency_timer"), HasSubstr("no control socket"),
                                 AllOf(HasSubstr("no bushd answers"), HasSubstr("systemctl"))));
}

TEST(Doctor, AFileThatTheDaemonHasNotReadIsTold) {
  EXPECT_THAT(with([](Observations& seen) { seen.configuration.sha256 = "def"; }),
              ElementsAre(AllOf(HasSubstr("was changed since"), HasSubstr("restart bushd"))));
  EXPECT_THAT(with([](Observations& seen) { seen.daemon.config_path = "/home/x.toml"; }),
              ElementsAre(HasSubstr("--config /home/x.toml")));
}

TEST(Doctor, OfflineMcusHaveTheirReasonAndFaultsTheirs) {
  EXPECT_THAT(with([](Observations& seen) {
                auto& mcu = seen.daemon.status.states[1].snapshot;
                mcu.state = api::McuState::kOffline;
                mcu.detail = "no answer yet";
              }),
              ElementsAre(AllOf(HasSubstr("error mcu: hall:2 is offline: no answer yet"),
                                HasSubstr("bushctl scan"))));
  EXPECT_THAT(with([](Observations& seen) {
                auto& mcu = seen.daemon.status.states[1].snapshot;
                mcu.state = api::McuState::kOffline;
                mcu.detail = "speaks protocol version 3, bushd version 4";
              }),
              ElementsAre(HasSubstr("bushd-flash --check")));
  EXPECT_THAT(with([](Observations& seen) {
                auto& mcu = seen.daemon.status.states[0].snapshot;
                mcu.state = api::McuState::kFault;
                mcu.detail = "emergency input";
              }),
              ElementsAre(HasSubstr("bushctl clear")));
  EXPECT_THAT(with([](Observations& seen) { health(seen).mcus[1].firmware_version = 3; }),
              ElementsAre(HasSubstr("versions 3, 4")));
}

TEST(Doctor, NoiseAtOneMcuIsItsStubAndAtAllTheLine) {
  const auto one = with([](Observations& seen) { health(seen).mcus[1].crc_errors = 400; });
  EXPECT_THAT(one, ElementsAre(AllOf(HasSubstr("warning bus: hall:2: 400 frames"),
                                     HasSubstr("this MCU's part"))));
  const auto all = with([](Observations& seen) {
    health(seen).mcus[0].timeouts = 3000;
    health(seen).mcus[1].crc_errors = 9000;
  });
  EXPECT_THAT(all, ElementsAre(AllOf(HasSubstr("error bus: hall: all 2 MCUs hear a noisy bus; the "
                                               "worst, hall:2"),
                                     HasSubstr("120 ohm at both ends"))));
  EXPECT_THAT(with([](Observations& seen) { health(seen).crc_errors = 500; }),
              ElementsAre(HasSubstr("the PC's end")));
  EXPECT_THAT(with([](Observations& seen) { health(seen).mcus[0].crc_errors = 3; }), IsEmpty());
}

TEST(Doctor, ErrorsWhileItLooksAreCounted) {
  EXPECT_THAT(with([](Observations& seen) {
                health(seen).mcus[1].crc_errors = 400;
                seen.daemon.later = {health(seen)};
                seen.daemon.later[0].mcus[1].crc_errors = 407;
                seen.daemon.watched_s = 2.1;
              }),
              ElementsAre(HasSubstr("7 in 2 s of looking")));
}

TEST(Doctor, OfTheBusItToldWhatElseIsCounted) {
  EXPECT_THAT(with([](Observations& seen) { health(seen).port_state = "cannot be opened"; }),
              ElementsAre(HasSubstr("the port is not open: cannot be opened")));
  EXPECT_THAT(with([](Observations& seen) { health(seen).two_masters = true; }),
              ElementsAre(HasSubstr("another master")));
  EXPECT_THAT(with([](Observations& seen) { health(seen).recent_latency_us = 16'000; }),
              ElementsAre(HasSubstr("16.0 ms late")));
  EXPECT_THAT(with([](Observations& seen) { health(seen).mcus[0].ramp_downs = 2; }),
              ElementsAre(HasSubstr("ran out of ticks 2 times")));
  EXPECT_THAT(with([](Observations& seen) {
                health(seen).mcus[0].restarts = 2;
                health(seen).mcus[0].reset_cause = "brown-out";
              }),
              ElementsAre(HasSubstr("look at its supply")));
}

TEST(Doctor, PositionsThatNobodyVouchesForAreWarnings) {
  EXPECT_THAT(with([](Observations& seen) {
                auto& motor = seen.daemon.status.states[0].snapshot.motors[0];
                motor.trust = api::Trust::kRestored;
              }),
              ElementsAre(HasSubstr("bushctl confirm of hall:1")));
  EXPECT_THAT(with([](Observations& seen) {
                auto& motor = seen.daemon.status.states[0].snapshot.motors[0];
                motor.trust = api::Trust::kUncertain;
                motor.uncertain_reason = "it moved when the power went";
              }),
              ElementsAre(HasSubstr("is uncertain, it moved when the power went")));
}

TEST(Doctor, JsonHasEveryFindingAndTextsDoNotSteerTheTerminal) {
  Observations seen = good();
  seen.daemon.status.states[0].snapshot.state = api::McuState::kFault;
  seen.daemon.status.states[0].snapshot.detail = "\x1b[2J\xff";
  const auto found = diagnose(seen);
  const auto parsed = nlohmann::json::parse(json(found));
  EXPECT_EQ(parsed["errors"], 1);
  EXPECT_EQ(parsed["findings"].size(), found.size());
  EXPECT_EQ(parsed["findings"][0]["level"], "ok");
  EXPECT_TRUE(parsed["findings"][0]["remedy"].is_null());
  for (const std::string& line : lines(found)) EXPECT_EQ(line.find('\x1b'), std::string::npos);
}

TEST(Doctor, WhatManyHaveIsToldInOneLine) {
  Observations seen = good();
  auto& motors = seen.daemon.status.states[0].snapshot.motors;
  motors.clear();
  for (int i = 1; i <= 128; ++i) {
    motors.push_back({.name = "m" + std::to_string(i),
                      .trust = api::Trust::kUncertain,
                      .uncertain_reason = "it moved, last at " + std::to_string(i)});
  }
  const Findings found = diagnose(seen);
  const auto told = lines(found);
  const auto of_positions = std::ranges::find_if(
      told, [](const std::string& line) { return line.starts_with("warning  position"); });
  ASSERT_NE(of_positions, told.end());
  EXPECT_THAT(*of_positions, HasSubstr("128 motors are uncertain: m1, m2, m3 and 125 more. m1 is "
                                       "uncertain, it moved, last at 1"));
  EXPECT_THAT(of_positions[1],
              HasSubstr("find out where it stands and run 'bushctl set NAME --dial "
                        "POSITION'"));
  EXPECT_EQ(told.back(), "0 errors, 128 warnings");
  EXPECT_EQ(told.end() - of_positions, 3);
  EXPECT_EQ(nlohmann::json::parse(json(found))["warnings"], 128);
  motors.resize(3);
  EXPECT_THAT(lines(diagnose(seen)), testing::Contains(HasSubstr("m3 is uncertain")));
}

TEST(Doctor, OnlyWhatHasAHomeSwitchIsToBeHomed) {
  const auto remedy = [](std::vector<std::string> with_home) {
    return with([&](Observations& seen) {
      seen.configuration.with_home = with_home;
      auto& motor = seen.daemon.status.states[0].snapshot.motors[0];
      motor = {.name = "theta", .trust = api::Trust::kUncertain};
    });
  };
  EXPECT_THAT(remedy({}), ElementsAre(AllOf(HasSubstr("'bushctl set theta --dial POSITION'"),
                                            testing::Not(HasSubstr("home")))));
  EXPECT_THAT(remedy({"theta"}), ElementsAre(HasSubstr("run 'bushctl home theta', or")));
}

TEST(Proc, FiltersOfProgramsLoseNothing) {
  EXPECT_EQ(datagrams_without_room("Ip: Forwarding InErrors\nIp: 1 5\n"
                                   "Udp: InDatagrams InErrors RcvbufErrors\nUdp: 7595 3705 3510\n"
                                   "UdpLite: InDatagrams InErrors RcvbufErrors\nUdpLite: 1 2 3\n"),
            3510);
  EXPECT_EQ(datagrams_without_room(""), 0);
  EXPECT_EQ(datagrams_without_room("Udp: InDatagrams RcvbufErrors\nUdp: 5\n"), 0);
}

TEST(Proc, TheLongestPrefixIsTheRoute) {
  const std::string head = "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\n";
  const std::string any = "eth0\t00000000\t0102A8C0\t0003\t0\t0\t100\t00000000\t0\t0\t0\n";
  const std::string lcm = "lo\t434CFFEF\t00000000\t0005\t0\t0\t0\tFFFFFFFF\t0\t0\t0\n";
  EXPECT_EQ(route_to(head + any + lcm, "239.255.76.67"), "lo");
  EXPECT_EQ(route_to(head + lcm + any, "239.255.76.67"), "lo");
  EXPECT_EQ(route_to(head + lcm + any, "239.255.76.68"), "eth0");
  EXPECT_EQ(route_to(head + lcm, "239.255.76.68"), std::nullopt);
  EXPECT_EQ(route_to("", "239.255.76.67"), std::nullopt);
  EXPECT_EQ(route_to(head + "x y z\n" + lcm, "no address"), std::nullopt);
}

TEST(Proc, UdpSocketsTellTheirQueueAndWhatTheyLost) {
  const std::string text =
      "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout "
      "inode ref pointer drops\n"
      "  61: 00000000:1DF3 00000000:0000 07 00000000:00000500 00:00000000 00000000     0        0 "
      "2 2 0000000000000000 17\n"
      "  62: 00000000:0044 00000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 "
      "3 2 0000000000000000 9\n  63: broken\n";
  const auto sockets = udp_sockets(text, 7667);
  ASSERT_EQ(sockets.size(), 1u);
  EXPECT_EQ(sockets[0].queued_bytes, 0x500u);
  EXPECT_EQ(sockets[0].drops, 17u);
}

TEST(Proc, LocksNameTheirHolders) {
  const std::string text =
      "1: FLOCK  ADVISORY  WRITE 4711 00:05:90 0 EOF\n"
      "1: -> FLOCK  ADVISORY  WRITE 4712 00:05:90 0 EOF\n"
      "2: POSIX  ADVISORY  WRITE 99 fd:01:90 0 EOF\n";
  EXPECT_THAT(lock_holders(text, 0, 5, 90), ElementsAre(4711));
  EXPECT_THAT(lock_holders(text, 0xfd, 1, 90), ElementsAre(99));
  EXPECT_THAT(lock_holders("", 0, 5, 90), IsEmpty());
}

TEST(Proc, AUrlOfLcmHasItsDefaults) {
  const LcmSeen full = lcm_of("udpm://239.1.2.3:1234?recv_buf_size=5&ttl=2");
  EXPECT_EQ(full.address, "239.1.2.3");
  EXPECT_EQ(full.port, 1234u);
  EXPECT_EQ(full.ttl, 2);
  const LcmSeen bare = lcm_of("udpm://");
  EXPECT_EQ(bare.address, "239.255.76.67");
  EXPECT_EQ(bare.port, 7667u);
  EXPECT_EQ(bare.ttl, 0);
  EXPECT_FALSE(lcm_of("memq://").multicast);
}

}  // namespace
}  // namespace bushctl::doctor
