// Lines that go by a table of their own: it is uploaded before they begin, and whatever comes
// meanwhile, each request has one result and nothing moves late.
#include <map>

#include "daemon/on_line.h"
#include "daemon/traced.h"
#include "engine/frame.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// Frames on their way to MCUs, by type.
class SentTypes {
 public:
  explicit SentTypes(Lab& lab) {
    lab.on_send = [this](std::size_t, std::vector<std::uint8_t>& bytes) { return add(bytes); };
  }
  int operator[](bushd_type type) const {
    const auto found = count_.find(type);
    return found == count_.end() ? 0 : found->second;
  }
  // From now on none of this type arrives.
  std::optional<bushd_type> lost{};
  int most_lost = INT32_MAX;
  std::uint8_t last_sequence = 0;

 private:
  bool add(const std::vector<std::uint8_t>& bytes) {
    bool arrives = true;
    for (const std::uint8_t byte : bytes) {
      bushd_frame frame;
      if (bushd_receive_byte(&receiver_, byte, &frame) != BUSHD_RECEIVE_FRAME) continue;
      ++count_[frame.type];
      last_sequence = frame.sequence;
      if (frame.type != lost || most_lost == 0) continue;
      --most_lost;
      arrives = false;
    }
    return arrives;
  }

  bushd_receiver receiver_{};
  std::map<int, int> count_;
};

const std::vector<std::int64_t> kOwnTable{3000, -1201, 17, 2998};

int moves_by(const Lab& lab, const std::string& how) {
  int moves = 0;
  for (const std::string& line : lab.move_lines()) {
    const auto event = nlohmann::json::parse(line);
    if (event["event"] == "move" && event.value("moves", "ticks") == how) ++moves;
  }
  return moves;
}

class UploadedLine : public Traced<const char*> {};
INSTANTIATE_TEST_SUITE_P(Manners, UploadedLine, testing::Values("fine", "coarse", "fine_table"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(UploadedLine, IsMadeByBothMcusExactToASlot) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const SentTypes sent(lab);
  EXPECT_EQ(lab.ask(line_to(kMotors, kOwnTable)).result, "reached");
  EXPECT_EQ(sent[BUSHD_MSG_TABLE_END], 2);
  // The way back has the same table; another way has not.
  EXPECT_EQ(lab.ask(line_to(kMotors, {0, 0, 0, 0})).result, "reached");
  EXPECT_EQ(sent[BUSHD_MSG_TABLE_END], 2);
  EXPECT_EQ(lab.ask(line_to(kMotors, {-400, 333, 1, -200})).result, "reached");
  EXPECT_EQ(sent[BUSHD_MSG_TABLE_END], 4);
  EXPECT_EQ(sent[BUSHD_MSG_LINE_RUN], 6);
  EXPECT_EQ(sent[BUSHD_MSG_TICKS] + sent[BUSHD_MSG_TABLE_TICKS], 0);
  EXPECT_EQ(moves_by(lab, "table"), 12);
  EXPECT_EQ(moves_by(lab, "ticks"), 0);
  EXPECT_EQ(lab.shaft_steps("m02"), 333);
  expect_clean(lab);
  close_trace(lab);
  EXPECT_EQ(check(lab, ""), 0) << said();
  EXPECT_THAT(said(), HasSubstr("farthest from the exact slot 0.0 us"));
  // It would say so if the line had had another table.
  EXPECT_EQ(check(lab, "",
                  [](auto& event) {
                    if (event["event"] == "line") event["motors"][3]["increment"] = 30;
                    return true;
                  }),
            1);
}

TEST_P(UploadedLine, GoesOnAfterAPauseAndRampsDownAlongItself) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const auto move = lab.send(line_to(kMotors, kOwnTable));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  lab.ask(api::Pause{{"m03"}});
  lab.run_for(0.2);
  lab.send(api::Resume{});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 1700; });
  lab.send(Ask::kStop, {"m02"});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_LE(off_line(lab, kMotors, kOwnTable), kOffAtRest);
  EXPECT_LT(lab.shaft_steps("m01"), 2900);
  EXPECT_EQ(moves_by(lab, "table"), 8);
  expect_clean(lab);
  close_trace(lab);
  EXPECT_EQ(check(lab, ""), 0) << said();
}

TEST_P(UploadedLine, BeginsByATrigger) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const SentTypes sent(lab);
  const auto move = lab.send(api::ArmLine{.edge = api::Edge::kRising,
                                          .delay_us = 7'777,
                                          .kind = api::Move::Kind::kAbsolute,
                                          .motors = motor_steps(kMotors, kOwnTable)});
  ASSERT_TRUE(lab.run_until(
      [&] {
        return std::ranges::all_of(kMotors, [&](const std::string& motor) {
          return lab.motor(motor).activity == api::Activity::kArmed;
        });
      },
      2));
  lab.run_for(0.2);
  EXPECT_EQ(sent[BUSHD_MSG_TABLE_END], 2);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  for (const std::size_t mcu : {0, 1}) lab.bus(0).mcu(mcu).set_inputs({0, BUSHD_INPUT_TRIGGER});
  EXPECT_EQ(lab.wait(move).result, "reached");
  for (std::size_t i = 0; i < kMotors.size(); ++i) {
    EXPECT_EQ(lab.shaft_steps(kMotors[i]), kOwnTable[i]);
  }
  expect_clean(lab);
  close_trace(lab);
  EXPECT_EQ(check(lab, ""), 0) << said();
}

// The daemon plans the stop, and both must count alike.
TEST_P(UploadedLine, IsCountedAlikeWhereverItIsStopped) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    const auto move = lab.send(api::ArmLine{
        .edge = api::Edge::kRising,
        .delay_us = 100,
        .motors = motor_steps({"m01", "m02", "m03"}, {233, -50, i % 2 == 0 ? 1907 : -1907})});
    lab.run_for(0.5);
    EXPECT_EQ(lab.last_reply(move).phase, Answer::kAccepted) << lab.last_reply(move).reason;
    lab.bus(0).mcu(0).set_inputs({0, BUSHD_INPUT_TRIGGER});
    lab.run_for(0.004 + 0.0037 * i);
    lab.bus(0).mcu(1).set_inputs({0, BUSHD_INPUT_TRIGGER});
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "stopped") << result.reason;
    lab.run_for(0.3);
    for (const char* motor : {"m01", "m02", "m03"}) {
      EXPECT_EQ(lab.motor(motor).position_steps, lab.shaft_steps(motor));
    }
    for (const std::size_t mcu : {0, 1}) lab.bus(0).mcu(mcu).set_inputs({});
  }
  expect_clean(lab);
}

// The motors of one MCU stand already when those of the other one, which has not heard that they
// wait no more, have begun and are to stop farther along the line.
TEST_P(UploadedLine, IsCountedAlikeIfAnMcuBeginsLate) {
  for (int i = 2; i < 24; ++i) {
    SCOPED_TRACE(i);
    ReadyLab lab(hall(2, 2, GetParam()));
    const auto move =
        lab.send(api::ArmLine{.edge = api::Edge::kRising,
                              .delay_us = 100,
                              .motors = motor_steps({"m01", "m02", "m03"}, {233, -50, 1907})});
    lab.run_for(0.5);
    lab.bus(0).mcu(0).set_inputs({0, BUSHD_INPUT_TRIGGER});
    lab.run_for(0.002 * i);
    lab.bus(0).mcu(1).set_inputs({0, BUSHD_INPUT_TRIGGER});
    // What the first one is told arrives, the second one is deaf for a while.
    lab.run_for(0.01);
    bushd_receiver receiver{};
    lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
      bool arrives = true;
      for (const std::uint8_t byte : bytes) {
        bushd_frame frame;
        const auto status = bushd_receive_byte(&receiver, byte, &frame);
        if (status == BUSHD_RECEIVE_FRAME && frame.address == 2) arrives = false;
      }
      return arrives;
    };
    lab.run_for(0.15);
    lab.on_send = nullptr;
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "stopped") << result.reason;
    lab.run_for(0.3);
    for (const char* motor : {"m01", "m02", "m03"}) {
      EXPECT_EQ(lab.motor(motor).position_steps, lab.shaft_steps(motor));
    }
    EXPECT_THAT(lab.errors(), testing::IsEmpty());
  }
}

// Three motors an MCU; the third of each is on no line.
class WaitingLine : public testing::Test {
 protected:
  WaitingLine() { lab.connect(); }
  // Returns the number of the request when a part of its table has been sent.
  template <class Request>
  std::int64_t begin(const Request& request) {
    const int before = sent[BUSHD_MSG_TABLE_DATA];
    const auto number = lab.send(request);
    EXPECT_TRUE(lab.run_until([&] { return sent[BUSHD_MSG_TABLE_DATA] > before + 1; }, 1));
    EXPECT_TRUE(lab.replies(number).empty());
    return number;
  }
  std::int64_t begin() { return begin(line_to(kFour, kOwnTable)); }
  void expect_rest_at(const std::vector<std::int64_t>& steps) {
    lab.run_for(1);
    for (std::size_t i = 0; i < kFour.size(); ++i) EXPECT_EQ(lab.shaft_steps(kFour[i]), steps[i]);
  }
  int results(std::int64_t number) const {
    return static_cast<int>(std::ranges::count_if(lab.replies(number), [](const Answer& answer) {
      return answer.phase != Answer::kAccepted;
    }));
  }
  void expect_reached() {
    EXPECT_EQ(lab.ask(line_to(kFour, kOwnTable)).result, "reached");
    expect_rest_at(kOwnTable);
  }

  const std::vector<std::string> kFour{"m01", "m02", "m04", "m05"};
  Lab lab{hall(2, 3)};
  SentTypes sent{lab};
};

TEST_F(WaitingLine, IsStoppedBeforeItBegins) {
  for (const api::Request& request :
       std::vector<api::Request>{request_of(Ask::kStop, {"m02"}), api::Pause{{"m04"}},
                                 api::Disarm{{"m01"}}, request_of(Ask::kEmergencyStop, {})}) {
    SCOPED_TRACE(request.index());
    const auto line = begin();
    lab.send(request);
    EXPECT_THAT(lab.wait(line, 0.1),
                Ends("stopped", "before this was carried out; nothing has moved"));
    lab.run_for(0.02);
    const int parts = sent[BUSHD_MSG_TABLE_DATA];
    expect_rest_at({0, 0, 0, 0});
    EXPECT_EQ(sent[BUSHD_MSG_TABLE_DATA], parts) << "nobody waits for it";
    EXPECT_EQ(sent[BUSHD_MSG_LINE_RUN], 0);
    EXPECT_EQ(results(line), 1);
    if (request.index() != api::Request(api::Pause{}).index()) continue;
    lab.ask(api::Resume{});
  }
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  expect_reached();
}

// Nobody waits for a line: another motor of its MCUs moves at once, and the line is streamed.
TEST_F(WaitingLine, IsStreamedAsSoonAsTheMcuDoesNotRest) {
  const auto line = begin();
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m03"}, {400}).result, "reached");
  EXPECT_EQ(lab.wait(line).result, "reached");
  EXPECT_EQ(sent[BUSHD_MSG_LINE_RUN], 0);
  EXPECT_GT(sent[BUSHD_MSG_TICKS] + sent[BUSHD_MSG_TABLE_TICKS], 8);
  expect_rest_at(kOwnTable);
  expect_clean(lab);
}

TEST_F(WaitingLine, ForTheTriggerIsRefusedThen) {
  const auto line = begin(api::ArmLine{.delay_us = 100, .motors = motor_steps(kFour, kOwnTable)});
  const auto other = lab.send(Ask::kMoveTo, {"m03"}, {400});
  EXPECT_THAT(lab.wait(line, 0.1).reason,
              HasSubstr("MCU hall:1 does not have, and takes only while all its motors rest"));
  EXPECT_EQ(lab.wait(other).result, "reached");
  expect_rest_at({0, 0, 0, 0});
  expect_clean(lab);
}

// In the order of their requests.
TEST_F(WaitingLine, KeepsLaterRequestsForItsMotorsWaiting) {
  const auto line = begin();
  const auto move = lab.send(Ask::kMoveTo, {"m05"}, {5});
  const auto set = lab.send(Ask::kSetPosition, {"m02"}, {100});
  EXPECT_EQ(lab.wait(line).result, "reached");
  EXPECT_THAT(lab.wait(move).reason, HasSubstr("line"));
  EXPECT_EQ(lab.last_reply(move).result, "refused");
  EXPECT_EQ(lab.last_reply(set).result, "refused");
  for (const auto number : {line, move, set}) EXPECT_EQ(results(number), 1);
  EXPECT_EQ(sent[BUSHD_MSG_LINE_RUN], 2);
  expect_rest_at(kOwnTable);
}

TEST_F(WaitingLine, IsNotTheOnlyOne) {
  const auto line = begin();
  const auto other = lab.send(line_to({"m03", "m06"}, {200, 67}));
  EXPECT_EQ(lab.wait(line).result, "reached");
  EXPECT_EQ(lab.wait(other).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m06"), 67);
  expect_rest_at(kOwnTable);
  expect_clean(lab);
}

TEST_F(WaitingLine, EndsWithItsMcuOrLink) {
  const auto after_a_reset = begin();
  lab.bus(0).reboot(1, 50'000'000);
  EXPECT_NE(lab.wait(after_a_reset).result, "reached");
  lab.run_until([&] { return lab.all_ready(); }, 20);
  expect_rest_at({0, 0, 0, 0});
  lab.ask(Ask::kSetPosition, {"m04", "m05", "m06"}, {0, 0, 0});
  const auto unplugged = begin();
  lab.unplug(0);
  EXPECT_EQ(lab.wait(unplugged, 0.1).result, "refused");
  lab.plug(0);
  lab.run_until([&] { return lab.all_ready(); }, 20);
  expect_rest_at({0, 0, 0, 0});
  for (const auto number : {after_a_reset, unplugged}) EXPECT_EQ(results(number), 1);
  expect_reached();
}

TEST_F(WaitingLine, OutlivesLostParts) {
  for (const bushd_type type : {BUSHD_MSG_TABLE_BEGIN, BUSHD_MSG_TABLE_DATA, BUSHD_MSG_TABLE_END}) {
    sent.lost = type;
    sent.most_lost = 2;
    const int runs = sent[BUSHD_MSG_LINE_RUN];
    const std::int64_t second = 1000 + type;  // a table of its own, each
    const auto line = lab.send(line_to(kFour, {3000, second, 17, 2998}));
    EXPECT_EQ(lab.wait(line).result, "reached") << lab.last_reply(line).reason;
    EXPECT_EQ(sent[BUSHD_MSG_LINE_RUN], runs + 2);
    EXPECT_EQ(lab.ask(line_to(kFour, {0, 0, 0, 0})).result, "reached");
  }
  EXPECT_EQ(sent[BUSHD_MSG_TICKS], 0);
}

// It waits half a second at most, and a step of the daemon takes no time here.
TEST_F(WaitingLine, IsStreamedIfItsTableDoesNotArrive) {
  sent.lost = BUSHD_MSG_TABLE_DATA;
  const std::int64_t before_ns = lab.bus(0).now_ns();
  const auto line = lab.send(line_to(kFour, kOwnTable));
  ASSERT_TRUE(lab.run_until([&] { return !lab.replies(line).empty(); }, 2));
  EXPECT_LE(lab.bus(0).now_ns() - before_ns, 510'000'000);
  EXPECT_EQ(lab.wait(line).result, "reached");
  EXPECT_EQ(sent[BUSHD_MSG_LINE_RUN], 0);
  expect_rest_at(kOwnTable);
  sent.lost.reset();
  expect_reached();
}

// One that the MCU does not take is streamed.
TEST_F(WaitingLine, EndsWithARefusal) {
  const auto line = begin();
  // Somebody else's table in its place: the next part is none of it.
  bushd_table_begin other{};
  other.bank = BUSHD_SCRATCH_BANK;
  other.accel_count = 1;
  other.cruise = 100;
  other.time_unit_ns = 1000;
  std::vector<std::uint8_t> payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_table_begin(&other, payload.data()));
  std::vector<std::uint8_t> wire(BUSHD_FRAME_MAX_WIRE);
  wire.resize(bushd_frame_encode(1, BUSHD_MSG_TABLE_BEGIN,
                                 static_cast<std::uint8_t>(sent.last_sequence + 1), payload.data(),
                                 payload.size(), wire.data()));
  wire.insert(wire.begin(), 0);  // behind a part of another frame, perhaps
  for (const std::uint8_t byte : wire) lab.bus(0).mcu(0).receive(byte, lab.bus(0).now_ns());
  EXPECT_EQ(lab.wait(line).result, "reached");
  EXPECT_EQ(sent[BUSHD_MSG_LINE_RUN], 0);
  expect_rest_at(kOwnTable);
  expect_reached();
}

TEST_F(WaitingLine, IsForgottenWithTheDaemon) {
  begin();
  lab.restart_daemon();
  lab.run_until([&] { return lab.all_ready(); }, 20);
  expect_rest_at({0, 0, 0, 0});
  lab.ask(api::Confirm{.motors = {}});
  expect_reached();
}

TEST_F(WaitingLine, IsRefusedIfItsMotorsGetAnotherTable) {
  const auto line = begin();
  EXPECT_EQ(lab.wait(lab.use("axes", "bushd2-scurve")).result, "done");
  EXPECT_EQ(lab.wait(line).result, "refused");
  EXPECT_EQ(results(line), 1);
  expect_rest_at({0, 0, 0, 0});
  expect_reached();
}

TEST(WaitingLines, DoNotBeginTowardsALimitThatHasClosed) {
  ReadyLab lab(with_keys(hall(2, 2), "m03", "limit = \"positive\"\n"));
  const SentTypes sent(lab);
  const auto line = lab.send(line_to(kMotors, kOwnTable));
  ASSERT_TRUE(lab.run_until([&] { return sent[BUSHD_MSG_TABLE_DATA] > 1; }, 1));
  lab.bus(0).mcu(1).set_inputs({1, 0});
  const Answer answer = lab.wait(line);
  EXPECT_NE(answer.result, "reached");
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m03"), 0);
}

// People would notice it with a long table.
TEST(WaitingLines, DoNotWaitLong) {
  std::string codes;
  for (int code = 4999; code > 1000; code -= 2) codes += std::to_string(code) + ", ";
  const std::string table =
      "name = \"glacier\"\ntime_unit_ns = 1000\naccel = [" + codes + "1000]\n";
  ReadyLab lab(hall(2, 2, "fine", "glacier"), table);
  const SentTypes sent(lab);
  EXPECT_EQ(lab.ask(line_to(kMotors, kOwnTable)).result, "reached");
  EXPECT_EQ(sent[BUSHD_MSG_TABLE_BEGIN], 0);
  // For a trigger there is nothing else.
  const auto armed = lab.send(api::ArmLine{.delay_us = 100,
                                           .kind = api::Move::Kind::kAbsolute,
                                           .motors = motor_steps(kMotors, {0, 0, 0, 0})});
  lab.run_for(2);
  EXPECT_EQ(lab.last_reply(armed).phase, Answer::kAccepted);
  EXPECT_EQ(sent[BUSHD_MSG_TABLE_END], 2);
}

}  // namespace
}  // namespace bushd::test
