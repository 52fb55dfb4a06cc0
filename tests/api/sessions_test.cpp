#include "api/sessions.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace bushd::api {
namespace {

constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
using Seen = NumberWindow::Seen;

Reply result(const std::string& reason) {
  return Completed{.outcome = Outcome::kReached, .reason = reason, .detail = {}};
}

std::string reason_of(const std::optional<Reply>& reply) {
  if (!reply) return "no reply";
  if (const auto* refused = std::get_if<Refused>(&*reply)) return refused->reason;
  if (const auto* completed = std::get_if<Completed>(&*reply)) return completed->reason;
  return "accepted";
}

bool refused(const Sessions::Ruling& ruling) {
  return ruling.reply && std::holds_alternative<Refused>(*ruling.reply);
}

TEST(NumberWindow, TellsTheNewest1024Apart) {
  NumberWindow window;
  EXPECT_EQ(window.note(5000), Seen::kNew);
  EXPECT_EQ(window.note(5000), Seen::kBefore);
  EXPECT_EQ(window.note(5000 - 1023), Seen::kNew);
  EXPECT_EQ(window.note(5000 - 1023), Seen::kBefore);
  EXPECT_EQ(window.note(5000 - 1024), Seen::kTooOld);
  EXPECT_EQ(window.note(5001), Seen::kNew);
  EXPECT_EQ(window.note(5000 - 1023), Seen::kTooOld);
  EXPECT_EQ(window.note(5001 - 1023), Seen::kNew);
}

TEST(NumberWindow, AJumpForwardForgetsWhatLiesBelow) {
  for (const std::int64_t jump : {1023, 1024, 1025, 1'000'000}) {
    NumberWindow window;
    window.note(0);
    window.note(jump);
    EXPECT_EQ(window.look(0), jump < 1024 ? Seen::kBefore : Seen::kTooOld) << jump;
    EXPECT_EQ(window.look(jump - 1), Seen::kNew) << jump;
  }
}

TEST(NumberWindow, HoldsAtTheEndsOfTheNumbers) {
  NumberWindow low;
  EXPECT_EQ(low.note(kMin), Seen::kNew);
  EXPECT_EQ(low.note(kMin + 3), Seen::kNew);
  EXPECT_EQ(low.note(kMin), Seen::kBefore);
  EXPECT_EQ(low.note(kMax), Seen::kNew);
  EXPECT_EQ(low.note(kMin), Seen::kTooOld);
  EXPECT_EQ(low.note(kMin + 3), Seen::kTooOld);
  EXPECT_EQ(low.note(kMax), Seen::kBefore);
  EXPECT_EQ(low.note(kMax - 1023), Seen::kNew);
  EXPECT_EQ(low.note(kMax - 1024), Seen::kTooOld);
  EXPECT_EQ(low.note(0), Seen::kTooOld);
}

TEST(NumberWindow, AgreesWithASetThatForgetsNothing) {
  rc::check([] {
    NumberWindow window;
    std::set<std::int64_t> noted;
    const auto steps =
        *rc::gen::container<std::vector<std::int64_t>>(rc::gen::inRange<std::int64_t>(-2000, 2000));
    for (const std::int64_t number : steps) {
      const bool old = !noted.empty() && *noted.rbegin() - number >= 1024;
      const Seen expected = old                      ? Seen::kTooOld
                            : noted.contains(number) ? Seen::kBefore
                                                     : Seen::kNew;
      RC_ASSERT(window.look(number) == expected);
      RC_ASSERT(window.note(number) == expected);
      if (expected == Seen::kNew) noted.insert(number);
      if (!noted.empty()) RC_ASSERT(window.holds(*noted.rbegin()));
    }
  });
}

TEST(Sessions, AHelloRepeatedGetsTheSameSession) {
  Sessions sessions(1);
  const std::int64_t first = sessions.open("scan", 7);
  EXPECT_NE(first, 0);
  EXPECT_EQ(sessions.open("scan", 7), first);
  EXPECT_NE(sessions.open("scan", 8), first);
  EXPECT_NE(sessions.open("scan2", 7), first);
  EXPECT_EQ(sessions.count(), 3u);
  // Repeated after it has been used, too.
  EXPECT_TRUE(sessions.rule(first, "scan", 1, Move{}).carry_out);
  EXPECT_EQ(sessions.open("scan", 7), first);
  EXPECT_FALSE(sessions.rule(first, "scan", 1, Move{}).carry_out);
}

TEST(Sessions, ANewNumberIsCarriedOutAndASeenOneIsAnsweredAgain) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  const auto first = sessions.rule(session, "scan", 1, Move{});
  EXPECT_TRUE(first.carry_out);
  EXPECT_TRUE(first.record);
  EXPECT_FALSE(first.reply);
  // Repeated before anything was answered: that is still to come.
  const auto early = sessions.rule(session, "scan", 1, Move{});
  EXPECT_FALSE(early.carry_out);
  EXPECT_FALSE(early.reply);
  sessions.record(session, 1, Accepted{});
  EXPECT_EQ(reason_of(sessions.rule(session, "scan", 1, Move{}).reply), "accepted");
  sessions.record(session, 1, result("stands"));
  const auto late = sessions.rule(session, "scan", 1, Move{});
  EXPECT_FALSE(late.carry_out);
  EXPECT_EQ(reason_of(late.reply), "stands");
}

TEST(Sessions, NumbersAndAnswersOfOneAreNothingToAnother) {
  Sessions sessions(1);
  const std::int64_t a = sessions.open("a", 7);
  const std::int64_t b = sessions.open("b", 7);
  EXPECT_TRUE(sessions.rule(a, "a", 2000, Move{}).carry_out);
  sessions.record(a, 2000, result("for a"));
  EXPECT_TRUE(sessions.rule(b, "b", 1, Move{}).carry_out);
  EXPECT_TRUE(sessions.rule(b, "b", 2000, Move{}).carry_out);
  EXPECT_FALSE(sessions.rule(b, "b", 2000, Move{}).reply);
  EXPECT_EQ(reason_of(sessions.rule(a, "a", 2000, Move{}).reply), "for a");
}

TEST(Sessions, AnswersToWhatNobodyAskedAreIgnored) {
  Sessions sessions(1);
  sessions.record(5, 1, result("of no session"));
  const std::int64_t session = sessions.open("scan", 7);
  sessions.record(session, 1, result("of no request"));
  EXPECT_EQ(sessions.bytes(), 0u);
  EXPECT_TRUE(sessions.rule(session, "scan", 1, Move{}).carry_out);
}

TEST(Sessions, NumbersMayComeInAnyOrderWithinTheWindow) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  for (const std::int64_t number : {5000, 3977, 4500, 5001}) {
    EXPECT_TRUE(sessions.rule(session, "scan", number, Move{}).carry_out) << number;
  }
  const auto old = sessions.rule(session, "scan", 3977, Move{});
  EXPECT_FALSE(old.carry_out);
  EXPECT_TRUE(refused(old));
  EXPECT_NE(reason_of(old.reply).find("may have been carried out earlier"), std::string::npos);
}

TEST(Sessions, AnswersBelowTheWindowAreDropped) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  for (std::int64_t number = kMax - 3000; number < kMax; ++number) {
    ASSERT_TRUE(sessions.rule(session, "scan", number, Enable{}).carry_out);
  }
  EXPECT_EQ(sessions.bytes(), 1024 * Sessions::kBytesPerAnswer);
  EXPECT_TRUE(sessions.rule(session, "scan", kMax, Enable{}).carry_out);
  EXPECT_EQ(sessions.bytes(), 1024 * Sessions::kBytesPerAnswer);
  // Nothing lies above the largest number: the client has to open another session.
  EXPECT_TRUE(refused(sessions.rule(session, "scan", kMin, Enable{})));
}

TEST(Sessions, AnUnknownSessionIsRefused) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  for (const auto& [number, client] : std::map<std::int64_t, std::string>{
           {0, "scan"}, {session + 1, "scan"}, {session, "other"}}) {
    const auto ruling = sessions.rule(number, client, 1, Move{});
    EXPECT_FALSE(ruling.carry_out);
    EXPECT_TRUE(refused(ruling));
    EXPECT_NE(reason_of(ruling.reply).find("open a new session"), std::string::npos);
  }
}

TEST(Sessions, ARestartedDaemonRefusesWhatTheOneBeforeMayHaveDone) {
  Sessions before(1);
  const std::int64_t session = before.open("scan", 7);
  EXPECT_TRUE(before.rule(session, "scan", 1, Move{}).carry_out);
  Sessions after(2);
  EXPECT_NE(after.open("scan", 7), session);
  EXPECT_TRUE(refused(after.rule(session, "scan", 1, Move{})));
  EXPECT_TRUE(refused(after.rule(session, "scan", 2, Move{})));
}

TEST(Sessions, SessionsOfManyRunsDiffer) {
  std::set<std::int64_t> all;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Sessions sessions(seed);
    for (std::int64_t nonce = 0; nonce < 100; ++nonce) {
      EXPECT_TRUE(all.insert(sessions.open("scan", nonce)).second);
    }
  }
}

TEST(Sessions, StopsNeedNone) {
  Sessions sessions(1);
  for (const Request& stop : {Request(Stop{}), Request(EmergencyStop{})}) {
    const auto without = sessions.rule(0, "scan", 1, stop);
    EXPECT_TRUE(without.carry_out);
    EXPECT_FALSE(without.record);
    EXPECT_TRUE(sessions.rule(0, "scan", 1, stop).carry_out);
  }
}

TEST(Sessions, StopsAreCarriedOutUnlessTheirOwnAnswerIsKnown) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  EXPECT_TRUE(sessions.rule(session, "scan", 2000, Stop{}).record);
  sessions.record(session, 2000, Accepted{});
  EXPECT_FALSE(sessions.rule(session, "scan", 2000, Stop{}).carry_out);
  // A number too old, or used for something else: a mistake of the client's, but it says stop.
  EXPECT_TRUE(sessions.rule(session, "scan", 1, Stop{}).carry_out);
  EXPECT_TRUE(sessions.rule(session, "scan", 2001, Move{}).carry_out);
  EXPECT_TRUE(sessions.rule(session, "scan", 2001, EmergencyStop{}).carry_out);
  EXPECT_TRUE(sessions.rule(session, "scan", 2000, EmergencyStop{}).carry_out);
}

// Whatever ends motion: whoever can speak may end it.
TEST(Sessions, PausesHoldsDisarmingsAndJogsEndsNeedNoneEither) {
  Sessions sessions(1);
  for (const Request& request :
       {Request(Pause{}), Request(Hold{}), Request(Disarm{}), Request(Jog{.motor = "m"})}) {
    EXPECT_TRUE(sessions.rule(7, "scan", 1, request).carry_out) << name_of(request);
  }
  EXPECT_TRUE(refused(sessions.rule(7, "scan", 1, Jog{.motor = "m", .per_s = 1})));
  EXPECT_TRUE(refused(sessions.rule(7, "scan", 1, Resume{})));
}

// The network has changed their order.
TEST(Sessions, ALowerNumberThanThatOfAStopCameBeforeIt) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  const std::int64_t other = sessions.open("other", 7);
  EXPECT_EQ(sessions.rule(session, "scan", 10, Move{}, 3).after_stops, 3u);
  EXPECT_EQ(sessions.rule(session, "scan", 20, Stop{}, 3).after_stops, 3u);
  EXPECT_EQ(sessions.rule(session, "scan", 30, Pause{}, 5).after_stops, 5u);
  EXPECT_EQ(sessions.rule(session, "scan", 15, Move{}, 9).after_stops, 3u);
  EXPECT_EQ(sessions.rule(session, "scan", 25, Move{}, 9).after_stops, 5u);
  EXPECT_EQ(sessions.rule(session, "scan", 31, Move{}, 9).after_stops, 9u);
  EXPECT_EQ(sessions.rule(other, "other", 15, Move{}, 9).after_stops, 9u);
  // Ended or not, its answer is the same to each repetition.
  sessions.record(session, 15, result("stopped"));
  const auto again = sessions.rule(session, "scan", 15, Move{}, 12);
  EXPECT_FALSE(again.carry_out);
  EXPECT_EQ(reason_of(again.reply), "stopped");
}

TEST(Sessions, ALateRepetitionOfAStopIsNotCarriedOutThoughItsAnswerIsForgotten) {
  Sessions sessions(1, {.bytes_per_session = 2 * Sessions::kBytesPerAnswer});
  const std::int64_t session = sessions.open("scan", 7);
  EXPECT_TRUE(sessions.rule(session, "scan", 1, Stop{}).carry_out);
  for (std::int64_t number = 2; number < 10; ++number) {
    EXPECT_TRUE(sessions.rule(session, "scan", number, Move{}).carry_out);
  }
  const auto late = sessions.rule(session, "scan", 1, Stop{});
  EXPECT_FALSE(late.carry_out);
  EXPECT_NE(reason_of(late.reply).find("answer not kept"), std::string::npos);
}

// Bounded; what is forgotten makes no request later than it was.
TEST(Sessions, OfManyStopsNoneMakesAnEarlierRequestALaterOne) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  for (std::int64_t i = 1; i <= 400; ++i) {
    sessions.rule(session, "scan", 2 * i, Stop{}, static_cast<std::uint64_t>(i));
  }
  for (std::int64_t i = 1; i <= 400; ++i) {
    const auto ruling = sessions.rule(session, "scan", 2 * i - 1, Move{}, 1000);
    EXPECT_LE(ruling.after_stops, static_cast<std::uint64_t>(i)) << i;
    if (i <= 400 - static_cast<std::int64_t>(Sessions::kMostStops) + 1) continue;
    EXPECT_EQ(ruling.after_stops, static_cast<std::uint64_t>(i)) << "still known";
  }
}

TEST(Sessions, AStopWhoseAnswerWasARefusalIsAnsweredAgain) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  EXPECT_TRUE(sessions.rule(session, "scan", 1, Stop{{"nobody"}}).carry_out);
  sessions.record(session, 1, Refused{"there is no motor \"nobody\""});
  EXPECT_FALSE(sessions.rule(session, "scan", 1, Stop{{"nobody"}}).carry_out);
}

TEST(Sessions, WhatOnlyReadsIsAlwaysCarriedOutAndNotKept) {
  Sessions sessions(1);
  for (int i = 0; i < 3; ++i) {
    const auto ruling = sessions.rule(0, "scan", 1, GetTable{"own"});
    EXPECT_TRUE(ruling.carry_out);
    EXPECT_FALSE(ruling.record);
  }
  EXPECT_EQ(sessions.bytes(), 0u);
}

TEST(Sessions, ANumberOfAnotherRequestIsRefused) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 7);
  EXPECT_TRUE(sessions.rule(session, "scan", 1, Move{}).carry_out);
  sessions.record(session, 1, result("stands"));
  const auto ruling = sessions.rule(session, "scan", 1, Home{});
  EXPECT_FALSE(ruling.carry_out);
  EXPECT_TRUE(refused(ruling));
}

TEST(Sessions, AnswersAreForgottenByTheBytesOldestFirst) {
  Sessions sessions(1, {.bytes_per_session = 10'000});
  const std::int64_t session = sessions.open("scan", 7);
  for (std::int64_t number = 1; number <= 20; ++number) {
    EXPECT_TRUE(sessions.rule(session, "scan", number, Move{}).carry_out);
    sessions.record(session, number, result(std::string(2000, 'x')));
    EXPECT_LE(sessions.bytes(), 10'000u);
  }
  EXPECT_EQ(reason_of(sessions.rule(session, "scan", 20, Move{}).reply), std::string(2000, 'x'));
  const auto forgotten = sessions.rule(session, "scan", 1, Move{});
  EXPECT_FALSE(forgotten.carry_out);
  EXPECT_NE(reason_of(forgotten.reply).find("carried out earlier, answer not kept"),
            std::string::npos);
}

TEST(Sessions, AnAnswerLargerThanAllThatIsKeptIsNotKept) {
  Sessions sessions(1, {.bytes_per_session = 1000});
  const std::int64_t session = sessions.open("scan", 7);
  EXPECT_TRUE(sessions.rule(session, "scan", 1, Move{}).carry_out);
  sessions.record(session, 1, result(std::string(5000, 'x')));
  EXPECT_EQ(sessions.bytes(), 0u);
  EXPECT_FALSE(sessions.rule(session, "scan", 1, Move{}).carry_out);
  // Its number has been forgotten as one that waits: a later answer changes nothing.
  sessions.record(session, 1, result("late"));
  EXPECT_EQ(sessions.bytes(), 0u);
}

TEST(Sessions, WhoKeepsMostPaysForAll) {
  Sessions sessions(1, {.bytes_per_session = 40'000, .bytes = 50'000});
  const std::int64_t modest = sessions.open("modest", 1);
  EXPECT_TRUE(sessions.rule(modest, "modest", 1, Move{}).carry_out);
  sessions.record(modest, 1, result("stands"));
  for (int greedy = 0; greedy < 5; ++greedy) {
    const std::string name = "greedy" + std::to_string(greedy);
    const std::int64_t session = sessions.open(name, 1);
    for (std::int64_t number = 1; number <= 30; ++number) {
      EXPECT_TRUE(sessions.rule(session, name, number, Move{}).carry_out);
      sessions.record(session, number, result(std::string(2000, 'x')));
      ASSERT_LE(sessions.bytes(), 50'000u);
    }
  }
  EXPECT_EQ(reason_of(sessions.rule(modest, "modest", 1, Move{}).reply), "stands");
}

TEST(Sessions, AFloodOfHellosForgetsNobodyWhoWorks) {
  Sessions sessions(1, {.sessions = 8, .idle_sessions = 4});
  const std::int64_t works = sessions.open("works", 1);
  EXPECT_TRUE(sessions.rule(works, "works", 1, Move{}).carry_out);
  sessions.record(works, 1, result("stands"));
  for (int i = 0; i < 100'000; ++i) sessions.open("flood" + std::to_string(i), i);
  EXPECT_EQ(sessions.count(), 5u);
  EXPECT_EQ(reason_of(sessions.rule(works, "works", 1, Move{}).reply), "stands");
}

TEST(Sessions, AFloodOfClientsForgetsTheLongestSilentAndRunsNothingTwice) {
  Sessions sessions(1, {.sessions = 8, .idle_sessions = 4});
  const std::int64_t silent = sessions.open("silent", 1);
  EXPECT_TRUE(sessions.rule(silent, "silent", 1, Move{}).carry_out);
  std::vector<std::int64_t> opened;
  for (int i = 0; i < 8; ++i) {
    const std::string name = "flood" + std::to_string(i);
    opened.push_back(sessions.open(name, 1));
    EXPECT_TRUE(sessions.rule(opened.back(), name, 1, Move{}).carry_out);
  }
  EXPECT_EQ(sessions.count(), 8u);
  EXPECT_TRUE(refused(sessions.rule(silent, "silent", 1, Move{})));
  // An answer to it that comes now is nobody's.
  const std::size_t bytes = sessions.bytes();
  sessions.record(silent, 1, result("late"));
  EXPECT_EQ(sessions.bytes(), bytes);
  for (int i = 0; i < 8; ++i) {
    EXPECT_FALSE(
        sessions.rule(opened[static_cast<std::size_t>(i)], "flood" + std::to_string(i), 1, Move{})
            .carry_out);
  }
}

// Requests 6 and 7 are lost and repeated after 10: what comes late is older than both stops.
TEST(Sessions, AStopThatComesLateHidesNoLaterOne) {
  Sessions sessions(1);
  const std::int64_t session = sessions.open("scan", 1);
  EXPECT_EQ(sessions.rule(session, "scan", 10, Stop{{"a"}}, 4).after_stops, 4u);
  EXPECT_EQ(sessions.rule(session, "scan", 7, Stop{{"b"}}, 5).after_stops, 4u);
  EXPECT_EQ(sessions.rule(session, "scan", 6, Move{}, 6).after_stops, 4u);
  EXPECT_EQ(sessions.rule(session, "scan", 8, Move{}, 6).after_stops, 4u);
  EXPECT_EQ(sessions.rule(session, "scan", 11, Move{}, 6).after_stops, 6u);
}

TEST(Sessions, ForgottenSessionsLeaveNoBytesBehind) {
  Sessions sessions(1, {.sessions = 2, .idle_sessions = 1});
  for (int i = 0; i < 100; ++i) {
    const std::string name = "client" + std::to_string(i);
    const std::int64_t session = sessions.open(name, 1);
    EXPECT_TRUE(sessions.rule(session, name, 1, Move{}).carry_out);
    sessions.record(session, 1, result(std::string(1000, 'x')));
  }
  EXPECT_LE(sessions.bytes(), 2 * (Sessions::kBytesPerAnswer + 1000 + 1000));
}

// Lost, repeated, reordered and forgotten as chance has it: no request is carried out twice.
TEST(Sessions, NothingIsCarriedOutTwice) {
  rc::check([] {
    Sessions sessions(
        *rc::gen::arbitrary<std::uint64_t>(),
        {.sessions = 3, .idle_sessions = 2, .bytes_per_session = 2000, .bytes = 3000});
    std::map<std::string, std::int64_t> current;
    std::set<std::pair<std::int64_t, std::int64_t>> done;
    const auto length = *rc::gen::inRange(0, 200);
    for (int i = 0; i < length; ++i) {
      const std::string name = "c" + std::to_string(*rc::gen::inRange(0, 6));
      if (!current.contains(name) || *rc::gen::inRange(0, 10) == 0) {
        current[name] = sessions.open(name, *rc::gen::inRange(0, 3));
      }
      const std::int64_t session = current[name];
      const std::int64_t number = *rc::gen::inRange(0, 2000);
      const auto ruling = sessions.rule(session, name, number, Move{});
      if (ruling.carry_out) RC_ASSERT(done.insert({session, number}).second);
      if (*rc::gen::inRange(0, 2) == 0) {
        sessions.record(session, number, result(std::string(300, 'x')));
      }
      RC_ASSERT(sessions.bytes() <= 3000u);
      RC_ASSERT(sessions.count() <= 5u);
    }
  });
}

}  // namespace
}  // namespace bushd::api
