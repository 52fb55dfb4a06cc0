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

#include "daemon/camac_lab.h"
#include "daemon/fronts/reception.h"
#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

class Client final : public api::Session {
 public:
  explicit Client(std::string id) : Session(api::Transport::kSocket, std::move(id), true) {}
  void answer(std::int64_t number, const api::Reply& reply) override {
    answers[number].push_back(reply);
  }
  std::map<std::int64_t, std::vector<api::Reply>> answers;
};

// A lab behind the reception, as in the event loop.
struct Desk {
  explicit Desk(Lab& of) : lab(of) {}

  std::int64_t take(const std::shared_ptr<Client>& from, const api::Request& request) {
    reception.take({.session = from, .number = ++number}, request, 1);
    return number;
  }
  void carry_out() {
    while (!reception.idle()) reception.carry_out_next();
  }
  // The word of its one result; "refused: WHY", "none", or that there are several.
  std::string result_of(std::int64_t of, const std::shared_ptr<Client>& client) const {
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
      steps[name] = lab.shaft_steps(name);
    }
    return steps;
  }

  Lab& lab;
  std::int64_t number = 0;
  std::shared_ptr<Client> mover = std::make_shared<Client>("mover");
  std::shared_ptr<Client> panel = std::make_shared<Client>("panel");
  daemon::Reception reception{lab.core().counted_stops(),
                              [this](const api::Asker& asker, const api::Request& request) {
                                lab.core().request(lab.now_us(), asker, request);
                              }};
};

// Requests for motors m01 and m02; the last of these begins the motion. `round`: trajectories have
// numbers.
struct Kind {
  const char* name;
  std::function<std::vector<api::Request>(std::int64_t round)> requests;
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
    {"move",
     [](std::int64_t) {
       return std::vector<api::Request>{request_of(Ask::kMoveBy, {"m02", "m01"}, {300, 400})};
     }},
    {"line",
     [](std::int64_t) {
       return std::vector<api::Request>{
           api::MoveLine{.motors = motor_steps({"m01", "m02"}, {400, 200})}};
     }},
    {"path", [](std::int64_t) { return path_in_parts(40, 40); }},
    {"path in parts", [](std::int64_t) { return path_in_parts(60, 20); }},
    {"trajectory", [](std::int64_t round) { return trajectory_in_parts(round, 2); }},
    {"arm",
     [](std::int64_t) {
       return std::vector<api::Request>{
           api::Arm{.delay_us = 1000, .motors = motor_steps({"m01", "m02"}, {40, 50})}};
     }},
    {"arm line",
     [](std::int64_t) {
       return std::vector<api::Request>{
           api::ArmLine{.delay_us = 1000, .motors = motor_steps({"m01", "m02"}, {400, -400})}};
     }},
    {"jog",
     [](std::int64_t) {
       return std::vector<api::Request>{
           api::Jog{.motor = "m01", .per_s = 200, .in_steps = true, .keepalive_ms = 10'000}};
     }},
    {"home", [](std::int64_t) { return std::vector<api::Request>{api::Home{{"m01"}}}; }},
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

std::string toml_with_homes(const std::string& mcu_keys = "") {
  std::string toml = hall(2, 3);
  for (const char* motor : {"name = \"m01\"\n", "name = \"m02\"\n"}) {
    toml.insert(toml.find(motor) + std::string(motor).size(),
                "home = { direction = \"negative\", most_steps = 3000 }\n");
  }
  for (std::size_t at = toml.find("address = "); at != std::string::npos;
       at = toml.find("address = ", at + 1)) {
    toml.insert(toml.find('\n', at) + 1, mcu_keys);
  }
  return toml;
}

// Everything moves again, and the disk knows that all rests.
void settle(Desk& desk) {
  Lab& lab = desk.lab;
  lab.wait(lab.send(api::Release{}));
  lab.wait(lab.send(Ask::kStop, {}));
  lab.wait(lab.send(Ask::kClearFaults, {}));
  lab.run_for(1.5);
}

class StopOrder : public testing::Test {
 protected:
  // `put` brings requests to where they wait, the first ones of these; the others come after the
  // stop. So many of them have their results before it.
  void check(Desk& desk, const Kind& kind, const api::Request& stop,
             const std::function<void(const std::vector<api::Request>&)>& put,
             std::int64_t with_result = 0) {
    SCOPED_TRACE(std::string(kind.name) + ", " + std::string(api::name_of(stop)));
    const std::vector<api::Request> requests = kind.requests(++round_);
    const std::int64_t first = desk.number + 1;
    put(requests);
    std::vector<std::int64_t> waiting;
    for (std::int64_t n = first + with_result; n <= desk.number; ++n) {
      ASSERT_EQ(desk.result_of(n), "none") << "request " << n - first + 1 << " is to wait";
      waiting.push_back(n);
    }
    const auto before = desk.shafts();
    auto next = static_cast<std::size_t>(desk.number + 1 - first);
    const auto stopped = desk.take(desk.panel, stop);
    for (; next < requests.size(); ++next) waiting.push_back(desk.take(desk.mover, requests[next]));
    desk.carry_out();
    desk.lab.run_for(1.5);
    const std::string who = "command " + std::to_string(stopped) + " of panel";
    for (const std::int64_t n : waiting) {
      EXPECT_THAT(desk.result_of(n), AllOf(HasSubstr("stopped: "), HasSubstr(who)))
          << "request " << n - first + 1;
    }
    EXPECT_EQ(desk.shafts(), before) << "nothing moves";
    EXPECT_THAT(desk.result_of(stopped, desk.panel),
                AnyOf(HasSubstr("done: "), HasSubstr("fault: ")));
  }

  std::int64_t round_ = 0;
};

TEST_F(StopOrder, OfWhatHasBeenReceivedAndNotTaken) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  for (const Kind& kind : kKinds) {
    for (const api::Request& stop : kStops) {
      check(desk, kind, stop, [&](const auto& requests) {
        for (const api::Request& request : requests) desk.take(desk.mover, request);
      });
      settle(desk);
    }
  }
}

// The first part is taken; the others are received before the stop, or come after it.
TEST_F(StopOrder, OfWhatComesInParts) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  for (const Kind& kind : kKinds) {
    if (kind.requests(0).size() == 1) continue;
    for (const std::size_t received : {1u, 2u}) {
      for (const api::Request& stop : kStops) {
        check(
            desk, kind, stop,
            [&](const auto& requests) {
              desk.take(desk.mover, requests.front());
              desk.carry_out();
              lab.run_for(0.05);
              EXPECT_THAT(desk.result_of(desk.number), HasSubstr("done"));
              for (std::size_t i = 1; i < received; ++i) desk.take(desk.mover, requests[i]);
            },
            1);
        settle(desk);
      }
    }
  }
}

TEST_F(StopOrder, OfWhatWaitsForTheDisk) {
  Lab lab(toml_with_homes());
  lab.keep_positions();
  lab.connect();
  Desk desk(lab);
  for (const Kind& kind : kKinds) {
    for (const api::Request& stop : kStops) {
      lab.disk_us = 500;
      settle(desk);
      check(
          desk, kind, stop,
          [&](const auto& requests) {
            for (const api::Request& request : requests) {
              lab.disk_us = 200'000;
              desk.take(desk.mover, request);
              desk.carry_out();
              lab.run_for(0.05);
            }
          },
          kind.requests(0).size() - 1);
    }
  }
}

TEST_F(StopOrder, OfWhatWaitsForDrivers) {
  Lab lab(toml_with_homes("idle_disable_s = 0.5\nenable_settle_ms = 250\n"));
  lab.connect();
  Desk desk(lab);
  for (const Kind& kind : kKinds) {
    for (const api::Request& stop : kStops) {
      settle(desk);
      check(
          desk, kind, stop,
          [&](const auto& requests) {
            for (const api::Request& request : requests) {
              desk.take(desk.mover, request);
              desk.carry_out();
              lab.run_for(0.05);
            }
          },
          kind.requests(0).size() - 1);
    }
  }
}

// 0.13 s of a PC; here it is work that is done only in slices.
TEST_F(StopOrder, OfAPathThatIsBeingPlanned) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const Kind path{"long path", [](std::int64_t) { return path_in_parts(6000, 2000); }};
  for (const api::Request& stop : kStops) {
    check(
        desk, path, stop,
        [&](const auto& requests) {
          for (const api::Request& request : requests) {
            desk.take(desk.mover, request);
            desk.carry_out();
          }
          for (int slice = 0; slice < 10; ++slice) lab.core().work();
          lab.core().keep_up(lab.now_us());
        },
        path.requests(0).size() - 1);
    settle(desk);
  }
}

TEST_F(StopOrder, OfRowsThatAreBeingChecked) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const Kind trajectory{"trajectory",
                        [](std::int64_t round) { return trajectory_in_parts(round, 1); }};
  for (const api::Request& stop : kStops) {
    check(desk, trajectory, stop, [&](const auto& requests) {
      desk.take(desk.mover, requests.front());
      desk.carry_out();
    });
    settle(desk);
  }
}

TEST_F(StopOrder, OfALineWhoseTableIsBeingUploaded) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const std::vector<std::int64_t> own_table{3000, -1201, 2998};
  std::int64_t way = 0;
  const auto line_of = [&](bool armed) -> std::vector<api::Request> {
    const auto motors =
        motor_steps({"m01", "m02", "m04"}, {own_table[0] + ++way, own_table[1], own_table[2]});
    if (armed) return {api::ArmLine{.delay_us = 1000, .motors = motors}};
    return {api::MoveLine{.motors = motors}};
  };
  for (const bool armed : {false, true}) {
    const Kind line{armed ? "arm line" : "line", [&](std::int64_t) { return line_of(armed); }};
    for (const api::Request& stop : kStops) {
      check(desk, line, stop, [&](const auto& requests) {
        desk.take(desk.mover, requests.front());
        desk.carry_out();
        lab.run_for(0.01);
      });
      settle(desk);
    }
  }
}

// m01 waits until m02, of the same MCU, has been homed.
TEST_F(StopOrder, OfAMotorThatWaitsForItsTurnToBeHomed) {
  Lab lab(toml_with_homes());
  for (std::size_t output : {0u, 1u}) {
    lab.bus(0).mcu(0).attach_switch(output, {.at_steps = -300});
  }
  lab.connect();
  Desk desk(lab);
  for (const api::Request& stop : kStops) {
    SCOPED_TRACE(api::name_of(stop));
    lab.wait(lab.send(Ask::kMoveTo, {"m02"}, {200}));
    const auto first = desk.take(desk.mover, api::Home{{"m02"}});
    const auto second = desk.take(desk.mover, api::Home{{"m01"}});
    desk.carry_out();
    lab.run_for(0.1);
    const std::int64_t at = lab.shaft_steps("m01");
    const auto stopped = desk.take(desk.panel, stop);
    lab.run_for(8);
    EXPECT_THAT(desk.result_of(second),
                AllOf(HasSubstr("stopped: m01: stopped before it was its turn to be homed"),
                      HasSubstr("command " + std::to_string(stopped) + " of panel")));
    EXPECT_EQ(lab.shaft_steps("m01"), at);
    EXPECT_THAT(desk.result_of(first), AnyOf(HasSubstr("reached: "), HasSubstr("stopped: ")));
    settle(desk);
    lab.wait(lab.send(Ask::kSetPosition, {"m02"}, {lab.shaft_steps("m02")}));
  }
}

// A move of many motors is begun in slices; m01 is among the last of them.
TEST_F(StopOrder, OfAMoveThatIsBegunInSlices) {
  for (const api::Request& stop : kStops) {
    SCOPED_TRACE(api::name_of(stop));
    Lab lab(hall(3, 16, "coarse"));
    lab.connect();
    Desk desk(lab);
    api::Move move;
    for (int m = 48; m >= 1; --m) {
      move.motors.push_back({(m < 10 ? "m0" : "m") + std::to_string(m), 300});
    }
    const auto number = desk.take(desk.mover, move);
    desk.carry_out();
    ASSERT_TRUE(lab.core().begins_moves());
    lab.core().work();
    ASSERT_TRUE(lab.core().begins_moves()) << "m01 has not begun";
    const auto stopped = desk.take(desk.panel, stop);
    lab.run_for(3);
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
    if (std::holds_alternative<api::Pause>(stop)) lab.wait(lab.send(api::Resume{}));
    lab.run_for(3);
    EXPECT_THAT(desk.result_of(number),
                AllOf(HasSubstr("stopped: "),
                      HasSubstr("command " + std::to_string(stopped) + " of panel")));
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
  }
}

TEST_F(StopOrder, OfResume) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const Kind resume{"resume",
                    [](std::int64_t) { return std::vector<api::Request>{api::Resume{}}; }};
  for (const api::Request& stop : kStops) {
    const auto start = lab.shaft_steps("m01");
    lab.send(Ask::kMoveBy, {"m01"}, {2000});
    ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > start + 300; }));
    lab.wait(lab.send(api::Pause{}));
    check(desk, resume, stop,
          [&](const auto& requests) { desk.take(desk.mover, requests.front()); });
    settle(desk);
  }
}

// Its rest is planned anew before it goes on.
TEST_F(StopOrder, OfAResumedPathWhoseRestIsBeingPlanned) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  for (const api::Request& stop :
       {api::Request(api::Stop{{"m01"}}), api::Request(api::EmergencyStop{}),
        api::Request(api::Pause{{"m01"}})}) {
    SCOPED_TRACE(api::name_of(stop));
    api::Move back = {.kind = api::Move::Kind::kAbsolute,
                      .motors = motor_steps({"m01", "m02"}, {0, 0})};
    ASSERT_EQ(lab.wait(lab.send(back)).result, "reached");
    std::int64_t path = 0;
    for (const api::Request& part : path_in_parts(6000, 2000)) path = lab.send(part);
    ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 200; }));
    lab.wait(lab.send(api::Pause{}));
    desk.take(desk.mover, api::Resume{});
    desk.carry_out();
    lab.core().keep_up(lab.now_us());
    const auto before = desk.shafts();
    desk.take(desk.panel, stop);
    lab.run_for(3);
    EXPECT_EQ(desk.shafts(), before);
    EXPECT_EQ(lab.has_result(path), !std::holds_alternative<api::Pause>(stop));
    settle(desk);
  }
}

// What clears an emergency stop, or lets motors go, is undone by one that came after it.
TEST_F(StopOrder, OfWhatUndoesAStop) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const auto release = desk.take(desk.mover, api::Release{});
  const auto clear = desk.take(desk.mover, api::ClearFaults{});
  desk.take(desk.panel, api::Hold{{"m01"}});
  const auto estop = desk.take(desk.panel, api::EmergencyStop{});
  ASSERT_TRUE(lab.run_until([&] { return desk.result_of(estop, desk.panel) != "none"; }));
  desk.carry_out();
  lab.run_for(0.5);
  EXPECT_THAT(desk.result_of(release), HasSubstr("stopped: m01: stopped by command"));
  EXPECT_THAT(desk.result_of(clear), HasSubstr("stopped: m01: stopped by command"));
  EXPECT_TRUE(lab.motor("m01").held);
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m02"}, {10})).result, "refused");
  // A stop has nothing against either.
  const auto again = desk.take(desk.mover, api::Release{});
  desk.take(desk.panel, api::Stop{});
  desk.carry_out();
  EXPECT_THAT(desk.result_of(again), HasSubstr("done: released"));
}

TEST_F(StopOrder, LeavesAloneWhatArrivesLaterOrIsOfOtherMotors) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const auto ended = desk.take(desk.mover, request_of(Ask::kMoveBy, {"m01"}, {400}));
  const auto other = desk.take(desk.mover, request_of(Ask::kMoveBy, {"m03"}, {30}));
  const auto dry_run =
      desk.take(desk.mover, api::Move{.motors = motor_steps({"m01"}, {40}), .dry_run = true});
  const auto set = desk.take(desk.mover, request_of(Ask::kSetPosition, {"m02"}, {70}));
  desk.take(desk.panel, api::Stop{{"m01", "m02"}});
  const auto later = desk.take(desk.mover, request_of(Ask::kMoveBy, {"m01"}, {20}));
  desk.carry_out();
  lab.run_for(2);
  EXPECT_THAT(desk.result_of(ended), HasSubstr("stopped: "));
  EXPECT_THAT(desk.result_of(other), HasSubstr("reached: "));
  EXPECT_THAT(desk.result_of(dry_run), HasSubstr("done: "));
  EXPECT_THAT(desk.result_of(set), HasSubstr("done: "));
  EXPECT_THAT(desk.result_of(later), HasSubstr("reached: "));
  EXPECT_EQ(lab.shaft_steps("m01"), 20);
  EXPECT_EQ(lab.motor("m02").position_steps, 70);
}

// The first parts of a path are ended: so is the path, and the next one is another.
TEST_F(StopOrder, AnotherPathAfterwardsIsMade) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const std::vector<api::Request> parts = path_in_parts(60, 20);
  desk.take(desk.mover, parts[0]);
  desk.take(desk.panel, api::Stop{});
  std::int64_t last = 0;
  for (const api::Request& part : parts) last = desk.take(desk.mover, part);
  desk.carry_out();
  ASSERT_TRUE(lab.run_until([&] { return desk.result_of(last) != "none"; }));
  EXPECT_THAT(desk.result_of(last), HasSubstr("reached: "));
  EXPECT_EQ(lab.shaft_steps("m01"), 120);
}

TEST_F(StopOrder, OfTheDaemonItself) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  std::vector<std::int64_t> waiting;
  for (const Kind& kind : kKinds) {
    for (const api::Request& request : kind.requests(++round_)) {
      waiting.push_back(desk.take(desk.mover, request));
    }
  }
  lab.core().shut_down(lab.now_us());
  desk.carry_out();
  lab.run_for(2);
  for (const std::int64_t number : waiting) {
    EXPECT_THAT(desk.result_of(number), AnyOf(HasSubstr("stopped by the daemon, which ends"),
                                              HasSubstr("the daemon is shutting down")));
  }
  EXPECT_THAT(desk.shafts(), testing::Each(testing::Field(
                                 &std::pair<const std::string, std::int64_t>::second, 0)));
}

// The stop key of a keypad has the same way: its jog ends though too much waits.
TEST_F(StopOrder, OfTwoStepsOfOneClientIsTheirOwnOrder) {
  Lab lab(toml_with_homes());
  lab.connect();
  Desk desk(lab);
  const auto jog = desk.take(desk.mover, api::Jog{.motor = "m01", .per_s = 200, .in_steps = true});
  for (int i = 0; i < 100; ++i) desk.take(desk.mover, api::Enable{});
  const auto end = desk.take(desk.mover, api::Jog{.motor = "m01"});
  EXPECT_THAT(desk.result_of(end), HasSubstr("done: "));
  desk.carry_out();
  lab.run_for(1);
  EXPECT_THAT(desk.result_of(jog), HasSubstr("stopped: "));
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

}  // namespace
}  // namespace bushd::test
