// A lab for the model of the semantics (semantics_test.py): the daemon's core and its MCUs on
// virtual time. Reads one JSON object a line from stdin; each is answered by a line "@ {...}" with
// what has become of it, and all motors as the daemon says they are and as their pins have turned
// them.
#include <gtest/gtest.h>

#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/json_text.h"
#include "daemon/lab.h"

namespace bushd::test {
namespace {

using nlohmann::json;

// Steps by the pins alone, of one bus.
class Pulses final : public sim::EdgeSink {
 public:
  void edge(const sim::Edge& edge) override {
    Pin& pin = pins_[{edge.mcu, edge.index}];
    if (edge.signal == sim::Signal::kDir) pin.forward = edge.level;
    if (edge.signal != sim::Signal::kStep || !edge.level) return;
    pin.steps += pin.forward ? 1 : -1;
    pin.last = pin.forward ? 1 : -1;
  }
  void settled(sim::TimeNs) override {}
  std::int64_t steps(std::size_t mcu, std::uint8_t output) { return pins_[{mcu, output}].steps; }
  // The direction of its last step; 0: it has made none.
  int direction(std::size_t mcu, std::uint8_t output) { return pins_[{mcu, output}].last; }

 private:
  struct Pin {
    bool forward = false;
    std::int64_t steps = 0;
    int last = 0;
  };
  std::map<std::pair<std::size_t, std::uint8_t>, Pin> pins_;
};

api::Amount amount_of(const json& amount) {
  if (amount.contains("steps")) return amount.at("steps").get<std::int64_t>();
  return api::UserUnits{amount.at("user").get<double>()};
}

std::vector<api::MotorAmount> amounts_of(const json& request) {
  std::vector<api::MotorAmount> all;
  for (const json& motor : request.at("motors")) {
    all.push_back({motor.at("name").get<std::string>(), amount_of(motor)});
  }
  return all;
}

api::Jog jog_of(const json& request) {
  api::Jog jog{.motor = request.at("motor").get<std::string>(),
               .per_s = request.at("speed").get<double>(),
               .in_steps = request.value("speed_in_steps", false),
               .keepalive_ms = request.value("keepalive_ms", 500)};
  if (request.contains("steps_after")) {
    jog.steps_after = request.at("steps_after").get<std::int64_t>();
  }
  return jog;
}

api::Configure configure_of(const json& request) {
  api::Configure configure{.kind = api::Configure::Kind::kChange};
  for (const json& change : request.at("changes")) {
    configure.changes.push_back({.motor = change.at("motor").get<std::string>(),
                                 .key = change.at("key").get<std::string>(),
                                 .value = change.at("value").get<std::string>()});
  }
  return configure;
}

api::Request request_of(const json& request) {
  const auto kind = request.at("request").get<std::string>();
  if (kind == "move") {
    api::Move move{.kind = request.at("to").get<bool>() ? api::Move::Kind::kAbsolute
                                                        : api::Move::Kind::kRelative,
                   .motors = amounts_of(request)};
    if (request.contains("speed")) {
      move.speed = api::Speed{.per_s = request.at("speed").get<double>(),
                              .in_steps = request.value("speed_in_steps", false)};
    }
    return move;
  }
  if (kind == "set") {
    return api::SetPosition{.motors = amounts_of(request), .dial = request.value("dial", false)};
  }
  if (kind == "jog") return jog_of(request);
  if (kind == "configure") return configure_of(request);
  const auto names = request.at("names").get<std::vector<std::string>>();
  if (kind == "confirm") return api::Confirm{names};
  if (kind == "pause") return api::Pause{names};
  if (kind == "resume") return api::Resume{names};
  if (kind == "hold") return api::Hold{names};
  if (kind == "release") return api::Release{names};
  return api::Stop{names};
}

class Driver {
 public:
  // Returns what is to be told beside the state.
  json carry_out(const json& line) {
    const auto what = line.at("do").get<std::string>();
    if (what == "lab") return open(line);
    if (what == "ask") return ask(request_of(line));
    if (what == "end") return told(line.at("number").get<std::int64_t>(), true);
    if (what == "run") lab_->run_for(line.at("s").get<double>());
    if (what == "reboot") lab_->bus(0).reboot(line.at("mcu").get<std::size_t>(), 50'000'000);
    if (what == "restart") lab_->restart_daemon();
    if (what == "cut") lab_->cut_pc_power();
    if (what == "ready") be_ready();
    return json::object();
  }

  json state() {
    json motors = json::object();
    for (const Motor& of : motors_) {
      json motor = {{"pulses", pulses_->steps(of.mcu, of.output)},
                    {"last_direction", pulses_->direction(of.mcu, of.output)}};
      if (lab_->has_state(of.mcu_name)) {
        const api::MotorState state = lab_->motor(of.name);
        motor.update({{"steps", state.position_steps},
                      {"user", state.user},
                      {"dial", state.dial},
                      {"target", state.target_steps},
                      {"user_target", state.user_target},
                      {"moving", state.moving},
                      {"paused", state.paused},
                      {"held", state.held},
                      {"trust", word(state.trust)},
                      {"reason", state.uncertain_reason}});
      }
      motors[of.name] = std::move(motor);
    }
    return motors;
  }
  std::int64_t now_us() const { return lab_->now_us(); }

 private:
  struct Motor {
    std::string name;
    std::string mcu_name;
    std::size_t mcu;
    std::uint8_t output;
  };

  json open(const json& line) {
    lab_.reset();
    pulses_ = std::make_unique<Pulses>();
    lab_ = std::make_unique<Lab>(line.at("toml").get<std::string>(), "", pulses_.get());
    lab_->read_period_us = 400;
    motors_.clear();
    for (const json& motor : line.at("motors")) {
      motors_.push_back({.name = motor.at("name"),
                         .mcu_name = motor.at("mcu_name"),
                         .mcu = motor.at("mcu"),
                         .output = motor.at("output")});
    }
    if (line.at("kept").get<bool>()) lab_->keep_positions();
    if (line.at("connect").get<bool>()) lab_->connect();
    be_ready();
    return json::object();
  }

  // Until all MCUs can be used and nothing is being restored, and the state says so.
  void be_ready() {
    const auto ready = [this] {
      if (!lab_->all_ready()) return false;
      for (const Motor& motor : motors_) {
        if (lab_->motor(motor.name).trust == api::Trust::kUnknown) return false;
      }
      return true;
    };
    EXPECT_TRUE(lab_->run_until(ready, 20)) << "not READY";
    lab_->run_for(0.02);
  }

  // Until the first reply: with a state store, some requests wait for the disk.
  json ask(const api::Request& request) {
    const std::int64_t number = lab_->send(request);
    EXPECT_TRUE(lab_->run_until([&] { return !lab_->replies(number).empty(); }, 3)) << "no reply";
    return told(number, false);
  }

  json told(std::int64_t number, bool wait) {
    const Answer answer = wait ? lab_->wait(number, 300) : lab_->last_reply(number);
    constexpr const char* kPhases[] = {"accepted", "refused", "result"};
    return {{"number", number},
            {"phase", kPhases[answer.phase]},
            {"result", answer.result},
            {"reason", answer.reason},
            {"motor_results", answer.motor_results},
            {"legs", answer.legs},
            {"position_steps", answer.position_steps}};
  }

  std::unique_ptr<Pulses> pulses_;  // outlives the lab
  std::unique_ptr<Lab> lab_;
  std::vector<Motor> motors_;
};

TEST(SemanticsDriver, CarriesOutWhatItReads) {
  Driver driver;
  std::string line;
  while (std::getline(std::cin, line)) {
    json answer = driver.carry_out(json::parse(line));
    answer["now_us"] = driver.now_us();
    answer["motors"] = driver.state();
    answer["failed"] = testing::Test::HasFailure();
    std::cout << "@ " << bushd::json_text(answer) << std::endl;
  }
}

}  // namespace
}  // namespace bushd::test
