// What a stop ends of what has not begun: every kind of request that begins motion, every kind of
// stop, every place where the request can wait. Nothing moves by it afterwards, and each request
// has one result, which says who has stopped it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/fronts/reception.h"
#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

class Asking final : public api::Session {
 public:
  explicit Asking(std::string id) : Session(api::Transport::kSocket, std::move(id), true) {}
  void answer(std::int64_t number, const api::Reply& reply) override {
    answers[number].push_back(reply);
  }
  std::map<std::int64_t, std::vector<api::Reply>> answers;
};

std::string toml_with_homes(const std::string& mcu_keys = "") {
  std::string toml = hall(2, 3);
  for (const char* motor : {"m01", "m02"}) {
    toml = with_keys(toml, motor, "home = { direction = \"negative\", most_steps = 3000 }\n");
  }
  return with_mcu_keys(with_mcu_keys(toml, mcu_keys), mcu_keys, 2);
}

// A lab behind the reception, as in the event loop.
struct Desk : Lab {
  Desk() : Desk(toml_with_homes()) { connect(); }
  explicit Desk(const std::string& toml, bool kept = false)
      : Lab(toml), reception(stops_of_core(kept), [this](const auto& asker, const auto& request) {
          core().request(now_us(), asker, request);
        }) {}

  std::int64_t take(const std::shared_ptr<Asking>& from, const api::Request& request) {
    reception.take({.session = from, .number = ++number}, request, 1);
    return number;
  }
  std::int64_t take(const api::Request& request) { return take(mover, request); }
  // Taken, and begun as far as it can be.
  void begin(const api::Request& request, double seconds = 0.05) {
    take(request);
    carry_out();
    run_for(seconds);
  }
  void carry_out() {
    while (!reception.idle()) reception.carry_out_next();
  }
  // The word of its one result; "refused: WHY", "none", or that there are several.
  std::string result_of(std::int64_t of, const std::shared_ptr<Asking>& client) const {
    std::string result = "none";
    for (const api::Reply& reply : client->answers[of]) {
      if (!api::is_final(reply)) continue;
      if (result != "none") return "several results";
      const auto* completed = std::get_if<api::Completed>(&reply);
      result = completed == nullptr
                   ? "refused: " + api::reason_of(reply)
                   : std::string(word(completed->outcome)) + ": " + completed->reason;
    }
    return result;
  }
  std::string result_of(std::int64_t of) const { return result_of(of, mover); }
  std::map<std::string, std::int64_t> shafts() const {
    std::map<std::string, std::int64_t> steps;
    for (int m = 1; m <= 6; ++m) {
      const std::string name = "m0" + std::to_string(m);
      steps[name] = shaft_steps(name);
    }
    return steps;
  }

  // Everything moves again, and the disk knows that all rests.
  void settle() {
    disk_us = 500;
    ask(api::Release{});
    ask(Ask::kStop, {});
    ask(Ask::kClearFaults, {});
    run_for(1.5);
  }

  std::int64_t number = 0;
  std::shared_ptr<Asking> mover = std::make_shared<Asking>("mover");
  std::shared_ptr<Asking> panel = std::make_shared<Asking>("panel");
  daemon::Reception reception;

 private:
  // A core that keeps positions is another one.
  daemon::StopCount& stops_of_core(bool kept) {
    if (kept) keep_positions();
    return core().counted_stops();
  }
};

// Requests for motors m01 and m02; the last of these begins the motion. `round`: trajectories have
// numbers.
struct Kind {
  using Requests = std::function<std::vector<api::Request>(std::int64_t round)>;
  Kind(const char* its_name, Requests of_round) : name(its_name), requests(std::move(of_round)) {}
  Kind(const char* its_name, std::vector<api::Request> same)
      : Kind(its_name, [same = std::move(same)](std::int64_t) { return same; }) {}
  Kind(const char* its_name, const api::Request& one) : Kind(its_name, std::vector{one}) {}

  const char* name;
  Requests requests;
};

std::vector<api::Request> path_in_parts(std::int32_t rows, std::int32_t rows_of_part) {
  std::vector<api::Request> parts;
  for (std::int32_t row = 0; row < rows; row += rows_of_part) {
    api::MovePath part{.motors = {"m01", "m02"}, .rows = rows, .first_row = row};
    for (std::int32_t i = row; i < std::min(rows, row + rows_of_part); ++i) {
      part.positions.push_back(2 * i + 2);
      part.positions.push_back(i % 2);
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

std::vector<api::Request> trajectory_in_parts(std::int64_t number, int parts) {
  std::vector<api::Request> requests;
  api::Follow common{.array = number, .motors = {"m01", "m02"}};
  for (int i = 0; i < parts; ++i) {
    api::Follow rows = common;
    rows.part = i + 1 == parts ? api::Follow::Part::kLastRows : api::Follow::Part::kRows;
    rows.time_s = {2.0 * i, 2.0 * i + 1};
    rows.positions = {10.0 * i, 0, 10.0 * i + 5, 0};
    requests.emplace_back(rows);
  }
  common.part = api::Follow::Part::kRun;
  requests.emplace_back(common);
  return requests;
}

const std::vector<Kind> kKinds{
    {"move", request_of(Ask::kMoveBy, {"m02", "m01"}, {300, 400})},
    {"line", api::MoveLine{.motors = motor_steps({"m01", "m02"}, {400, 200})}},
    {"path", path_in_parts(40, 40)},
    {"path in parts", path_in_parts(60, 20)},
    {"trajectory", [](std::int64_t round) { return trajectory_in_parts(round, 2); }},
    {"arm", api::Arm{.delay_us = 1000, .motors = motor_steps({"m01", "m02"}, {40, 50})}},
    {"arm line",
     api::ArmLine{.delay_us = 1000, .motors = motor_steps({"m01", "m02"}, {400, -400})}},
    {"jog", api::Jog{.motor = "m01", .per_s = 200, .in_steps = true, .keepalive_ms = 10'000}},
    {"home", api::Home{{"m01"}}},
};

const std::vector<api::Request> kStops{api::Stop{{"m01"}},
                                       api::Stop{},
                                       api::EmergencyStop{},
                                       api::Pause{{"m01"}},
                                       api::Pause{{"axes"}},
                                       api::Hold{{"m01"}},
                                       api::Disarm{{"m01"}},
                                       api::Jog{.motor = "m01"},
                                       api::Stop{{"m01", "m01", "nobody"}}};

auto is_stopped_by(std::int64_t command) {
  return AllOf(HasSubstr("stopped: "),
               HasSubstr("command " + std::to_string(command) + " of panel"));
}

class StopOrder : public testing::Test {
 protected:
  using Put = std::function<void(const std::vector<api::Request>&)>;
  // `put` brings requests to where they wait, the first ones of these; the others come after the
  // stop. So many of them have their results before it.
  void check(Desk& desk, const Kind& kind, const api::Request& stop, std::size_t with_result,
             const Put& put) {
    SCOPED_TRACE(std::string(kind.name) + ", " + std::string(api::name_of(stop)));
    const std::vector<api::Request> requests = kind.requests(++round_);
    const std::int64_t first = desk.number + 1;
    put(requests);
    std::vector<std::int64_t> waiting;
    for (auto n = first + static_cast<std::int64_t>(with_result); n <= desk.number; ++n) {
      ASSERT_EQ(desk.result_of(n), "none") << "request " << n - first + 1 << " is to wait";
      waiting.push_back(n);
    }
    const auto before = desk.shafts();
    auto next = static_cast<std::size_t>(desk.number + 1 - first);
    const auto stopped = desk.take(desk.panel, stop);
    for (; next < requests.size(); ++next) waiting.push_back(desk.take(requests[next]));
    desk.carry_out();
    desk.run_for(1.5);
    for (const std::int64_t n : waiting) {
      EXPECT_THAT(desk.result_of(n), is_stopped_by(stopped)) << "request " << n - first + 1;
    }
    EXPECT_EQ(desk.shafts(), before) << "nothing moves";
    EXPECT_THAT(desk.result_of(stopped, desk.panel),
                AnyOf(HasSubstr("done: "), HasSubstr("fault: ")));
  }

  // The same of each of these kinds and each stop. `all_but_last`: these have their results.
  void check_each(Desk& desk, const std::vector<Kind>& kinds, bool all_but_last, const Put& put) {
    for (const Kind& kind : kinds) {
      for (const api::Request& stop : kStops) {
        desk.settle();
        check(desk, kind, stop, all_but_last ? kind.requests(0).size() - 1 : 0, put);
      }
    }
  }

  std::int64_t round_ = 0;
};

TEST_F(StopOrder, OfWhatHasBeenReceivedAndNotTaken) {
  Desk desk;
  check_each(desk, kKinds, false, [&](const auto& requests) {
    for (const api::Request& request : requests) desk.take(request);
  });
}

// The first part is taken; the others are received before the stop, or come after it.
TEST_F(StopOrder, OfWhatComesInParts) {
  Desk desk;
  for (const Kind& kind : kKinds) {
    if (kind.requests(0).size() == 1) continue;
    for (const std::size_t received : {1u, 2u}) {
      for (const api::Request& stop : kStops) {
        check(desk, kind, stop, 1, [&](const auto& requests) {
          desk.begin(requests.front());
          EXPECT_THAT(desk.result_of(desk.number), HasSubstr("done"));
          for (std::size_t n = 1; n < received; ++n) desk.take(requests[n]);
        });
        desk.settle();
      }
    }
  }
}

TEST_F(StopOrder, OfWhatWaitsForTheDisk) {
  Desk desk(toml_with_homes(), true);
  desk.connect();
  check_each(desk, kKinds, true, [&](const auto& requests) {
    desk.disk_us = 200'000;
    for (const api::Request& request : requests) desk.begin(request);
  });
}

TEST_F(StopOrder, OfWhatWaitsForDrivers) {
  Desk desk(toml_with_homes("idle_disable_s = 0.5\nenable_settle_ms = 250\n"));
  desk.connect();
  check_each(desk, kKinds, true, [&](const auto& requests) {
    for (const api::Request& request : requests) desk.begin(request);
  });
}

// 0.13 s of a PC; here it is work that is done only in slices.
TEST_F(StopOrder, OfAPathThatIsBeingPlanned) {
  Desk desk;
  check_each(desk, {{"long path", path_in_parts(6000, 2000)}}, true, [&](const auto& requests) {
    for (const api::Request& request : requests) desk.begin(request, 0);
    for (int slice = 0; slice < 10; ++slice) desk.core().work();
    desk.core().keep_up(desk.now_us());
  });
}

TEST_F(StopOrder, OfRowsThatAreBeingChecked) {
  Desk desk;
  const Kind trajectory{"trajectory",
                        [](std::int64_t round) { return trajectory_in_parts(round, 1); }};
  check_each(desk, {trajectory}, false,
             [&](const auto& requests) { desk.begin(requests.front(), 0); });
}

TEST_F(StopOrder, OfALineWhoseTableIsBeingUploaded) {
  Desk desk;
  std::int64_t way = 3000;  // each has a table of its own
  const auto motors = [&way] { return motor_steps({"m01", "m02", "m04"}, {++way, -1201, 2998}); };
  const std::vector<Kind> kinds{{"line",
                                 [&](std::int64_t) -> std::vector<api::Request> {
                                   return {api::MoveLine{.motors = motors()}};
                                 }},
                                {"arm line", [&](std::int64_t) -> std::vector<api::Request> {
                                   return {api::ArmLine{.delay_us = 1000, .motors = motors()}};
                                 }}};
  check_each(desk, kinds, false, [&](const auto& requests) { desk.begin(requests.front(), 0.01); });
}

// m01 waits until m02, of the same MCU, has been homed.
TEST_F(StopOrder, OfAMotorThatWaitsForItsTurnToBeHomed) {
  Desk desk(toml_with_homes());
  for (std::size_t output : {0u, 1u}) {
    desk.bus(0).mcu(0).attach_switch(output, {.at_steps = -300});
  }
  desk.connect();
  for (const api::Request& stop : kStops) {
    SCOPED_TRACE(api::name_of(stop));
    desk.ask(Ask::kMoveTo, {"m02"}, {200});
    const auto first = desk.take(api::Home{{"m02"}});
    const auto second = desk.take(api::Home{{"m01"}});
    desk.carry_out();
    desk.run_for(0.1);
    const std::int64_t at = desk.shaft_steps("m01");
    const auto stopped = desk.take(desk.panel, stop);
    desk.run_for(8);
    EXPECT_THAT(desk.result_of(second),
                AllOf(HasSubstr("stopped: m01: stopped before it was its turn to be homed"),
                      is_stopped_by(stopped)));
    EXPECT_EQ(desk.shaft_steps("m01"), at);
    EXPECT_THAT(desk.result_of(first), AnyOf(HasSubstr("reached: "), HasSubstr("stopped: ")));
    desk.settle();
    desk.ask(Ask::kSetPosition, {"m02"}, {desk.shaft_steps("m02")});
  }
}

// A move of many motors is begun in slices; m01 is among the last of them.
TEST_F(StopOrder, OfAMoveThatIsBegunInSlices) {
  for (const api::Request& stop : kStops) {
    SCOPED_TRACE(api::name_of(stop));
    Desk desk(hall(3, 16, "coarse"));
    desk.connect();
    api::Move move;
    for (int m = 48; m >= 1; --m) {
      move.motors.push_back({(m < 10 ? "m0" : "m") + std::to_string(m), 300});
    }
    const auto number = desk.take(move);
    desk.carry_out();
    ASSERT_TRUE(desk.core().begins_moves());
    desk.core().work();
    ASSERT_TRUE(desk.core().begins_moves()) << "m01 has not begun";
    const auto stopped = desk.take(desk.panel, stop);
    desk.run_for(3);
    EXPECT_EQ(desk.shaft_steps("m01"), 0);
    if (std::holds_alternative<api::Pause>(stop)) desk.ask(api::Resume{});
    desk.run_for(3);
    EXPECT_THAT(desk.result_of(number), is_stopped_by(stopped));
    EXPECT_EQ(desk.shaft_steps("m01"), 0);
  }
}

TEST_F(StopOrder, OfResume) {
  Desk desk;
  const Kind resume{"resume", api::Resume{}};
  for (const api::Request& stop : kStops) {
    const auto start = desk.shaft_steps("m01");
    desk.send(Ask::kMoveBy, {"m01"}, {2000});
    ASSERT_TRUE(desk.run_until([&] { return desk.shaft_steps("m01") > start + 300; }));
    desk.ask(api::Pause{});
    check(desk, resume, stop, 0, [&](const auto& requests) { desk.take(requests.front()); });
    desk.settle();
  }
}

// Its rest is planned anew before it goes on.
TEST_F(StopOrder, OfAResumedPathWhoseRestIsBeingPlanned) {
  Desk desk;
  for (const api::Request& stop :
       {api::Request(api::Stop{{"m01"}}), api::Request(api::EmergencyStop{}),
        api::Request(api::Pause{{"m01"}})}) {
    SCOPED_TRACE(api::name_of(stop));
    api::Move back = {.kind = api::Move::Kind::kAbsolute,
                      .motors = motor_steps({"m01", "m02"}, {0, 0})};
    ASSERT_EQ(desk.ask(back).result, "reached");
    std::int64_t path = 0;
    for (const api::Request& part : path_in_parts(6000, 2000)) path = desk.send(part);
    ASSERT_TRUE(desk.run_until([&] { return desk.shaft_steps("m01") > 200; }));
    desk.ask(api::Pause{});
    desk.take(api::Resume{});
    desk.carry_out();
    desk.core().keep_up(desk.now_us());
    const auto before = desk.shafts();
    desk.take(desk.panel, stop);
    desk.run_for(3);
    EXPECT_EQ(desk.shafts(), before);
    EXPECT_EQ(desk.has_result(path), !std::holds_alternative<api::Pause>(stop));
    desk.settle();
  }
}

// What clears an emergency stop, or lets motors go, is undone by one that came after it.
TEST_F(StopOrder, OfWhatUndoesAStop) {
  Desk desk;
  const auto release = desk.take(api::Release{});
  const auto clear = desk.take(api::ClearFaults{});
  desk.take(desk.panel, api::Hold{{"m01"}});
  const auto estop = desk.take(desk.panel, api::EmergencyStop{});
  ASSERT_TRUE(desk.run_until([&] { return desk.result_of(estop, desk.panel) != "none"; }));
  desk.carry_out();
  desk.run_for(0.5);
  EXPECT_THAT(desk.result_of(release), HasSubstr("stopped: m01: stopped by command"));
  EXPECT_THAT(desk.result_of(clear), HasSubstr("stopped: m01: stopped by command"));
  EXPECT_TRUE(desk.motor("m01").held);
  EXPECT_EQ(desk.ask(Ask::kMoveBy, {"m02"}, {10}).result, "refused");
  // A stop has nothing against either.
  const auto again = desk.take(api::Release{});
  desk.take(desk.panel, api::Stop{});
  desk.carry_out();
  EXPECT_THAT(desk.result_of(again), HasSubstr("done: released"));
}

TEST_F(StopOrder, LeavesAloneWhatArrivesLaterOrIsOfOtherMotors) {
  Desk desk;
  const auto ended = desk.take(request_of(Ask::kMoveBy, {"m01"}, {400}));
  const auto other = desk.take(request_of(Ask::kMoveBy, {"m03"}, {30}));
  const auto dry_run = desk.take(api::Move{.motors = motor_steps({"m01"}, {40}), .dry_run = true});
  const auto set = desk.take(request_of(Ask::kSetPosition, {"m02"}, {70}));
  desk.take(desk.panel, api::Stop{{"m01", "m02"}});
  const auto later = desk.take(request_of(Ask::kMoveBy, {"m01"}, {20}));
  desk.carry_out();
  desk.run_for(2);
  EXPECT_THAT(desk.result_of(ended), HasSubstr("stopped: "));
  EXPECT_THAT(desk.result_of(other), HasSubstr("reached: "));
  EXPECT_THAT(desk.result_of(dry_run), HasSubstr("done: "));
  EXPECT_THAT(desk.result_of(set), HasSubstr("done: "));
  EXPECT_THAT(desk.result_of(later), HasSubstr("reached: "));
  EXPECT_EQ(desk.shaft_steps("m01"), 20);
  EXPECT_EQ(desk.motor("m02").position_steps, 70);
}

// The first parts of a path are ended: so is the path, and the next one is another.
TEST_F(StopOrder, AnotherPathAfterwardsIsMade) {
  Desk desk;
  const std::vector<api::Request> parts = path_in_parts(60, 20);
  desk.take(parts[0]);
  desk.take(desk.panel, api::Stop{});
  std::int64_t last = 0;
  for (const api::Request& part : parts) last = desk.take(part);
  desk.carry_out();
  ASSERT_TRUE(desk.run_until([&] { return desk.result_of(last) != "none"; }));
  EXPECT_THAT(desk.result_of(last), HasSubstr("reached: "));
  EXPECT_EQ(desk.shaft_steps("m01"), 120);
}

TEST_F(StopOrder, OfTheDaemonItself) {
  Desk desk;
  std::vector<std::int64_t> waiting;
  for (const Kind& kind : kKinds) {
    for (const api::Request& request : kind.requests(++round_)) {
      waiting.push_back(desk.take(request));
    }
  }
  desk.core().shut_down(desk.now_us());
  desk.carry_out();
  desk.run_for(2);
  for (const std::int64_t number : waiting) {
    EXPECT_THAT(desk.result_of(number), AnyOf(HasSubstr("stopped by the daemon, which ends"),
                                              HasSubstr("the daemon is shutting down")));
  }
  EXPECT_THAT(desk.shafts(), testing::Each(testing::Field(
                                 &std::pair<const std::string, std::int64_t>::second, 0)));
}

// The stop key of a keypad has the same way: its jog ends though too much waits.
TEST_F(StopOrder, OfTwoStepsOfOneClientIsTheirOwnOrder) {
  Desk desk;
  const auto jog = desk.take(api::Jog{.motor = "m01", .per_s = 200, .in_steps = true});
  for (int i = 0; i < 100; ++i) desk.take(api::Enable{});
  const auto end = desk.take(api::Jog{.motor = "m01"});
  EXPECT_THAT(desk.result_of(end), HasSubstr("done: "));
  desk.carry_out();
  desk.run_for(1);
  EXPECT_THAT(desk.result_of(jog), HasSubstr("stopped: "));
  EXPECT_EQ(desk.shaft_steps("m01"), 0);
}

}  // namespace
}  // namespace bushd::test
