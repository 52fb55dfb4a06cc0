// Keys of a jog panel: what the bytes of a terminal, and the time between them, ask of a motor.
#include "tools/bushctl/jog_keys.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace bushctl {
namespace {

using std::chrono::milliseconds;
using Course = JogKeys::Course;
using Time = JogKeys::Time;

constexpr std::string_view kLeft = "\x1b[D";
constexpr std::string_view kRight = "\x1b[C";
constexpr std::string_view kUp = "\x1b[A";
constexpr std::string_view kDown = "\x1b[B";

std::string times(int count, std::string_view key) {
  std::string bytes;
  for (int i = 0; i < count; ++i) bytes += key;
  return bytes;
}

// At a time that the test tells.
class JogKeysTest : public testing::Test {
 protected:
  // All of it at once.
  Course read(std::string_view bytes) {
    keys_.read(now_, bytes);
    return keys_.course();
  }
  Course later(int ms, std::string_view bytes = {}) {
    now_ += milliseconds(ms);
    return read(bytes);
  }
  void rests(bool as_asked = true) { keys_.rests(now_, as_asked); }

  JogKeys keys_;
  Time now_{1'000'000};
};

TEST_F(JogKeysTest, ArrowsJogAndMakeSteps) {
  for (const auto& [bytes, course] :
       std::vector<std::pair<std::string, Course>>{{"\x1b[A", Course::kUp},
                                                   {"\x1b[B", Course::kDown},
                                                   {"\x1b[C", Course::kRight},
                                                   {"\x1b[D", Course::kLeft},
                                                   {"\x1bOA", Course::kUp},
                                                   {"\x1bOB", Course::kDown},
                                                   {"\x1bOC", Course::kRight},
                                                   {"\x1bOD", Course::kLeft}}) {
    EXPECT_EQ(read(bytes), course);
    rests();
    EXPECT_EQ(keys_.course(), Course::kRest);
  }
}

TEST_F(JogKeysTest, AnyOtherKeyStops) {
  for (const std::string& key : std::vector<std::string>{
           " ", "x", "\r", "\x7f", "0", "[", "C", "\x1bx", "\x1b[5~", "\x1b[1;5C", "\x1b[Z",
           "\x1bOP", "\xc3\xa4", std::string(1, '\0'), "\x1b[" + std::string(40, '1') + "C"}) {
    read(kRight);
    EXPECT_EQ(read(key), Course::kStopping) << key;
    rests();
    EXPECT_EQ(read(key), Course::kRest) << "nothing to stop: " << key;
  }
}

TEST_F(JogKeysTest, TheOppositeKeyStopsAndDoesNotTurnRound) {
  for (const auto& [key, other] :
       std::vector<std::pair<std::string_view, std::string_view>>{{kRight, kLeft},
                                                                  {kLeft, kRight},
                                                                  {kUp, kDown},
                                                                  {kDown, kUp},
                                                                  {kRight, kUp},
                                                                  {kUp, kLeft}}) {
    read(key);
    EXPECT_EQ(read(other), Course::kStopping);
    EXPECT_EQ(later(10, other), Course::kStopping) << "it ramps down";
    rests();
    EXPECT_EQ(keys_.course(), Course::kRest) << "what came meanwhile is forgotten";
  }
}

TEST_F(JogKeysTest, AStopCountsBeforeAllThatWasReadWithIt) {
  for (const std::string& stop : std::vector<std::string>{" ", std::string(kLeft)}) {
    for (const std::string& bytes : {times(500, kRight) + stop, stop + times(500, kRight),
                                     times(250, kRight) + stop + times(250, kRight)}) {
      EXPECT_EQ(read(bytes), Course::kRest) << "nothing has begun";
      read(kRight);
      EXPECT_EQ(read(bytes), Course::kStopping);
      rests();
      EXPECT_EQ(later(5000), Course::kRest) << "nothing is left";
    }
  }
}

TEST_F(JogKeysTest, FiveHundredRepeatsAreOneKey) {
  EXPECT_EQ(read(times(500, kUp)), Course::kUp);
  rests();
  EXPECT_EQ(later(5000), Course::kRest) << "one step, not 500";
  EXPECT_EQ(read(times(500, kRight)), Course::kRight);
  EXPECT_EQ(read(" "), Course::kStopping);
  rests();
  read(times(500, "+") + times(300, "/"));
  EXPECT_EQ(keys_.take_speed_change(), 1);
  EXPECT_EQ(keys_.take_step_change(), -1);
  EXPECT_EQ(keys_.take_speed_change(), 0) << "once";
}

TEST_F(JogKeysTest, StepsDoNotQueue) {
  read(kUp);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(later(40, kUp), Course::kUp);
  rests();
  EXPECT_EQ(keys_.course(), Course::kRest);
  EXPECT_EQ(later(40, kUp), Course::kUp) << "it is held still";
}

TEST_F(JogKeysTest, AHeldArrowJogsUntilItIsLetGo) {
  read(kRight);
  EXPECT_EQ(later(660, kRight), Course::kRight) << "X begins to repeat after so long";
  for (int i = 0; i < 100; ++i) EXPECT_EQ(later(40, kRight), Course::kRight);
  EXPECT_EQ(keys_.wake(), now_ + JogKeys::kLetGo);
  EXPECT_EQ(later(599), Course::kRight);
  EXPECT_EQ(later(1), Course::kStopping);
}

TEST_F(JogKeysTest, AnArrowPressedOnceJogsUntilAnotherKey) {
  read(kLeft);
  EXPECT_EQ(keys_.wake(), Time::max());
  EXPECT_EQ(later(100'000), Course::kLeft);
  EXPECT_EQ(read("x"), Course::kStopping);
}

// A burst comes of a connection that stood still, or of this program: whether the key is still held
// shows soon.
TEST_F(JogKeysTest, WhatComesInABurstWasHeld) {
  EXPECT_EQ(read(times(20, kRight)), Course::kRight);
  EXPECT_EQ(later(599), Course::kRight);
  EXPECT_EQ(later(1), Course::kStopping);
}

TEST_F(JogKeysTest, BothArrowsAtOnceBeginNothing) {
  EXPECT_EQ(read(std::string(kLeft) + std::string(kRight)), Course::kRest);
  EXPECT_EQ(read(std::string(kUp) + std::string(kLeft) + std::string(kDown)), Course::kRest);
}

TEST_F(JogKeysTest, AHeldKeyBeginsNothingAfterOthersHaveEndedItsMotion) {
  for (const std::string_view key : {kRight, kUp}) {
    read(key);
    EXPECT_EQ(later(40, key), read(""));
    rests(false);
    for (int i = 0; i < 50; ++i) EXPECT_EQ(later(40, key), Course::kRest);
    EXPECT_EQ(later(599, key), Course::kRest);
    EXPECT_NE(later(600, key), Course::kRest) << "it was let go, and pressed again";
    rests(false);
    EXPECT_NE(later(1, key == kUp ? kDown : kLeft), Course::kRest) << "the way back is free";
    read(" ");
    rests();
  }
}

TEST_F(JogKeysTest, WhoHasStoppedItMayBeginAgainAtOnce) {
  read(kRight);
  read(" ");
  rests(false);  // told as the stop of somebody else, which came first
  EXPECT_EQ(later(100, kRight), Course::kRight);
}

TEST_F(JogKeysTest, SequencesComeInPieces) {
  EXPECT_EQ(read("\x1b"), Course::kRest);
  EXPECT_EQ(keys_.wake(), now_ + JogKeys::kEscape);
  EXPECT_EQ(later(49, "["), Course::kRest);
  EXPECT_EQ(later(49, "C"), Course::kRight);
  EXPECT_EQ(keys_.wake(), Time::max());
  EXPECT_EQ(read("\x1b[C\x1b"), Course::kRight) << "a repeat, and the beginning of another";
  EXPECT_EQ(later(10, "[C\x1b["), Course::kRight);
  EXPECT_EQ(later(10, "D"), Course::kStopping);
}

TEST_F(JogKeysTest, EscIsAKeyThatStops) {
  read(kRight);
  EXPECT_EQ(read("\x1b"), Course::kRight);
  EXPECT_EQ(later(50), Course::kStopping);
  rests();
  read(kRight);
  EXPECT_EQ(read("\x1b\x1b[C"), Course::kStopping) << "Esc, and a repeat behind it";
}

TEST_F(JogKeysTest, EverySplitOfABurstMeansTheSame) {
  const std::string bytes = times(3, kRight) + "+" + times(2, "\x1bOC") + "*";
  for (std::size_t at = 0; at <= bytes.size(); ++at) {
    JogKeys keys;
    keys.read(now_, bytes.substr(0, at));
    keys.read(now_, bytes.substr(at));
    EXPECT_EQ(keys.course(), Course::kRight) << at;
    EXPECT_EQ(keys.take_speed_change(), 1) << at;
    EXPECT_EQ(keys.take_step_change(), 1) << at;
    EXPECT_EQ(keys.wake(), now_ + JogKeys::kLetGo) << at;
  }
}

// Whatever a terminal sends, in whatever pieces: what was read with a stop moves nothing, a course
// ends only by rests(), and after q nothing begins.
TEST_F(JogKeysTest, AnyBytesKeepTheRules) {
  const std::vector<std::string> pieces = {"\x1b",   "[",      "O",      "A",       "C",    "D",
                                           "\x1b[C", "\x1bOD", "\x1b[A", "\x1b[5~", "+",    "-",
                                           "*",      "/",      " ",      "1;",      "\xff", "\x1a"};
  for (unsigned seed = 1; seed <= 300; ++seed) {
    std::mt19937 random(seed);
    JogKeys keys;
    Time now{0};
    Course before = Course::kRest;
    const auto quits_at = random() % 200;
    for (std::size_t i = 0; i < 200; ++i) {
      now += milliseconds(random() % 700);
      std::string bytes;
      for (auto n = random() % 4; n > 0; --n) bytes += pieces[random() % pieces.size()];
      const bool stops = random() % 8 == 0;
      // Not a byte of a sequence that has not come whole.
      if (stops) keys.read(now += JogKeys::kEscape, "");
      keys.read(now, stops ? " " + bytes : bytes);
      if (i == quits_at) keys.quit();
      const Course course = keys.course();
      const bool rests_or_stops = course == Course::kRest || course == Course::kStopping;
      EXPECT_TRUE(!stops || rests_or_stops) << "seed " << seed;
      EXPECT_TRUE(i < quits_at || rests_or_stops) << "seed " << seed;
      EXPECT_TRUE(before == Course::kRest || course == before || course == Course::kStopping)
          << "seed " << seed;
      if (random() % 4 == 0) keys.rests(now, random() % 2 == 0);
      before = keys.course();
      keys.take_suspension();
    }
  }
}

TEST_F(JogKeysTest, SpeedAndStepChangeAtRestAndInMotion) {
  read("+");
  later(150, "+");
  later(150, "-");
  EXPECT_EQ(keys_.take_speed_change(), 1);
  later(1000, "*/");
  EXPECT_EQ(keys_.take_step_change(), 0);
  read(kRight);
  EXPECT_EQ(read("-"), Course::kRight);
  EXPECT_EQ(keys_.take_speed_change(), -1);
}

TEST_F(JogKeysTest, HeldDownTheyChangeOnce) {
  for (int i = 0; i < 100; ++i) later(40, "+");
  EXPECT_EQ(keys_.take_speed_change(), 1);
  later(40, "-");
  later(40, "+");
  EXPECT_EQ(keys_.take_speed_change(), 0) << "one down, one up again";
}

TEST_F(JogKeysTest, WhoEndsStopsFirst) {
  for (const std::string_view key : {"q", "Q", "\x04"}) {
    JogKeys keys;
    keys.read(now_, kRight);
    keys.read(now_, times(300, kRight) + std::string(key) + times(200, kRight));
    EXPECT_EQ(keys.course(), Course::kStopping);
    EXPECT_TRUE(keys.quits());
  }
  JogKeys pressed_while_it_stops;
  pressed_while_it_stops.read(now_, kRight);
  pressed_while_it_stops.read(now_, " ");
  pressed_while_it_stops.read(now_, "q");
  pressed_while_it_stops.rests(now_, true);
  EXPECT_TRUE(pressed_while_it_stops.quits());
}

TEST_F(JogKeysTest, ATerminalThatIsGoneStops) {
  read(kRight);
  keys_.quit();
  EXPECT_EQ(keys_.course(), Course::kStopping);
  EXPECT_TRUE(keys_.quits());
  rests();
  EXPECT_EQ(read(kRight), Course::kRest) << "nothing begins any more";
}

TEST_F(JogKeysTest, CtrlZStopsBeforeItSuspends) {
  read(kRight);
  EXPECT_EQ(read("\x1a"), Course::kStopping);
  rests();
  EXPECT_TRUE(keys_.take_suspension());
  EXPECT_FALSE(keys_.take_suspension());
  EXPECT_EQ(read(kRight), Course::kRight);
}

}  // namespace
}  // namespace bushctl
