#include "daemon/matrix/watched_lab.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "daemon/matrix/requests.h"

namespace bushd::test::matrix {
namespace {

// Longer than the longest delay of a step in these tests, and than what a report takes to be told:
// two polls, and the time between two states.
constexpr std::int64_t kRestUs = 250'000;
// A queue, or the silence after which an MCU ends what it does by itself, and some ticks.
constexpr std::int64_t kAloneUs = 1'700'000;

// A key of the keypad counts for so long, and what it began ramps down.
constexpr std::int64_t kKeyUs = 500'000 + kRestUs;

constexpr unsigned kHomeInput = 10;
constexpr std::int64_t kHomeAt = -150;
constexpr unsigned kShutterRight = 5;
constexpr unsigned kShutterLeft = 6;
constexpr unsigned kShutterSensor = 7;

}  // namespace

std::string installation(const std::string& manner) {
  const std::string format = manner.substr(0, manner.find('_'));
  std::string toml =
      "[[bus]]\nname = \"hall\"\nport = \"/dev/null\"\nbaud = 500000\ntick_us = 2560\nformat = \"" +
      format + "\"\n" + (manner.ends_with("_table") ? "moves = \"table\"\n" : "") +
      "[[mcu]]\nbus = \"hall\"\naddress = 1\nemergency_input = \"ramp\"\n"
      "[[mcu]]\nbus = \"hall\"\naddress = 2\nidle_disable_s = 0.5\nenable_settle_ms = 50\n";
  for (const char* group : {"axes", "programs", "shutters"}) {
    toml += "[[group]]\nname = \"" + std::string(group) + "\"\ntable = \"bushd2-constant\"\n";
  }
  const auto motor = [&](const std::string& name, int mcu, int output, const std::string& group,
                         const std::string& keys) {
    toml += "[[motor]]\nname = \"" + name + "\"\nmcu = \"hall:" + std::to_string(mcu) +
            "\"\noutput = " + std::to_string(output) + "\ngroup = \"" + group + "\"\n" + keys;
  };
  motor("a", 1, 0, "axes",
        "local = true\ninputs = { positive = 8, negative = 9, home = 10 }\nsoft_limits = [-30000, "
        "30000]\n"
        "home = { direction = \"negative\", most_steps = 2000 }\n");
  motor("b", 1, 1, "axes", "backlash = 30\nsettle_ms = 300\n");
  motor("c", 1, 2, "axes", "keypad = true\n");
  motor("program", 1, 3, "programs", "");
  motor("shutter", 1, 4, "shutters", "inputs = { positive = 5, negative = 6, step = 7 }\n");
  motor("d", 2, 0, "axes", "");
  motor("e", 2, 1, "axes", "home = { direction = \"positive\", most_steps = 400 }\n");
  return toml +
         "[[crate]]\nnumber = 1\n"
         "[[crate.module]]\nstation = 5\ntype = \"bushd-2\"\nf_start_hz = 100\nmotors = "
         "[\"program\"]\n"
         "[[crate.module]]\nstation = 7\ntype = \"bushd-1\"\nmotor = \"shutter\"\n";
}

WatchedLab::WatchedLab(const std::string& manner, std::uint32_t seed)
    : Lab(installation(manner)), random_(seed) {
  for (const std::string& name : kMotors) watched_[name];
  tell_inputs();
  connect();
}

std::int64_t WatchedLab::ask(const api::Request& request, const std::string& client) {
  const Claims claims = claims_of(request);
  const std::int64_t number = send_as(client, request);
  tickets_.push_back({.number = number,
                      .what = std::string(api::name_of(request)),
                      .moves = claims.moves,
                      .stops = claims.stops,
                      .resumes = claims.resumes,
                      .places = claims.places});
  for (const std::string& name : claims.programs) {
    watched_.at(name).program_until_us = now_us() + 3'000'000;
    watched_.at(name).stopped_by = 0;
  }
  look();
  return number;
}

void WatchedLab::run(double seconds) {
  run_till([] { return false; }, seconds);
}

bool WatchedLab::run_till(const std::function<bool()>& done, double limit_s) {
  return run_until(
      [&] {
        look();
        return done();
      },
      limit_s);
}

void WatchedLab::look() {
  for (auto& [name, motor] : watched_) look_at(name, motor);
  for (Ticket& ticket : tickets_) {
    if (ticket.open) follow(ticket);
  }
  tell_inputs();
}

std::string WatchedLab::why_it_may_move(const std::string& name, const Watched& motor) const {
  for (const Ticket& ticket : tickets_) {
    if (ticket.open && ticket.moves.contains(name) && ticket.number > motor.stopped_by)
      return ticket.what;
  }
  if (motor.held || now_us() < motor.local_until_us) return "local";
  if (now_us() < motor.orphan_until_us) return "without a daemon";
  if (now_us() < motor.program_until_us) return "a program";
  return "";
}

void WatchedLab::look_at(const std::string& name, Watched& motor) {
  const bool all_told = has_state("hall:1") && has_state("hall:2");
  const auto told = all_told ? std::optional(this->motor(name)) : std::nullopt;
  const bool rests = told && told->activity == api::Activity::kResting && !told->moving &&
                     told->trust != api::Trust::kStale && told->trust != api::Trust::kUnknown;
  if (!rests) motor.said_to_rest_us = -1;
  if (rests && motor.said_to_rest_us < 0) motor.said_to_rest_us = now_us();
  const bool stands_paused = told && told->paused && !told->moving;
  if (!stands_paused) motor.paused_after = -1;
  if (stands_paused && motor.paused_after < 0) {
    motor.paused_after = tickets_.empty() ? 0 : tickets_.back().number;
  }
  const std::int64_t shaft = shaft_steps(name);
  if (shaft == motor.shaft) return;
  judge(name, motor, shaft);
  motor.shaft = shaft;
  motor.last_step_us = now_us();
  // It goes on as long as it moves.
  for (std::int64_t* until_us :
       {&motor.orphan_until_us, &motor.program_until_us, &motor.local_until_us}) {
    if (now_us() < *until_us) *until_us = std::max(*until_us, now_us() + kRestUs);
  }
}

void WatchedLab::judge(const std::string& name, Watched& motor, std::int64_t shaft) {
  const std::string steps = name + " makes steps at " + std::to_string(now_us()) + " us, from " +
                            std::to_string(motor.shaft) + " to " + std::to_string(shaft);
  if (why_it_may_move(name, motor).empty()) {
    complain(motor, steps + ", that nobody has asked for; the last one before was at " +
                        std::to_string(motor.last_step_us) + " us");
  }
  if (motor.said_to_rest_us >= 0 && now_us() - motor.said_to_rest_us > kRestUs) {
    complain(motor, steps + ", and is said to rest since " + std::to_string(motor.said_to_rest_us));
  }
  const auto moves_it_on = [&](const Ticket& ticket) {
    return ticket.number > motor.paused_after &&
           (ticket.moves.contains(name) || ticket.resumes.contains(name));
  };
  const bool by_people = motor.held || now_us() < motor.local_until_us;
  if (motor.paused_after >= 0 && !by_people && std::ranges::none_of(tickets_, moves_it_on)) {
    complain(motor, steps + ", and is said to stand paused");
  }
}

void WatchedLab::complain(Watched& motor, const std::string& what) {
  if (!std::exchange(motor.reported, true)) ADD_FAILURE() << what;
}

bool WatchedLab::stands(const std::string& name, double for_s) const {
  return static_cast<double>(now_us() - watched_.at(name).last_step_us) > for_s * 1e6;
}

void WatchedLab::follow(Ticket& ticket) {
  const std::vector<Answer> answers = replies(ticket.number);
  if (answers.empty() || answers.back().phase == Answer::kAccepted) return;
  ticket.open = false;
  const Answer& answer = answers.back();
  if (answer.result == "refused") return;
  for (const std::string& name : ticket.places) watched_.at(name).may_be_placed = true;
  for (const std::string& name : ticket.moves) {
    if (answer.result == "link") orphan(name);
  }
  for (const std::string& name : ticket.resumes) watched_.at(name).stopped_by = 0;
  // What is not known to stand is not said to.
  if (answer.result != "done" || answer.reason.find("unknown") != std::string::npos ||
      answer.reason.find("lost") != std::string::npos ||
      answer.reason.find("new target") != std::string::npos) {
    return;
  }
  for (const std::string& name : ticket.stops) {
    Watched& motor = watched_.at(name);
    motor.stopped_by = std::max(motor.stopped_by, ticket.number);
    motor.held = false;
    motor.local_until_us = -1;
    motor.program_until_us = -1;
    motor.orphan_until_us = -1;
  }
}

void WatchedLab::orphan(const std::string& name) {
  watched_.at(name).orphan_until_us = now_us() + kAloneUs;
}

void WatchedLab::tell_inputs() {
  unsigned active = held_inputs_;
  const Watched& a = watched_.at("a");
  const Watched& shutter = watched_.at("shutter");
  if (a.shaft - a.origin <= kHomeAt) active |= 1U << kHomeInput;
  if (shutter.shaft >= kShutterWay) active |= 1U << kShutterRight;
  if (shutter.shaft <= 0) active |= 1U << kShutterLeft;
  if ((shutter.shaft & 1) != 0) active |= 1U << kShutterSensor;
  bus(0).mcu(0).set_inputs({static_cast<std::uint16_t>(active), button_});
}

void WatchedLab::hold_input(unsigned input, bool held) {
  held_inputs_ = held ? held_inputs_ | 1U << input : held_inputs_ & ~(1U << input);
  tell_inputs();
}

void WatchedLab::press(std::uint8_t button) {
  button_ = button;
  const bool held = (button & (BUSHD_INPUT_FORWARD | BUSHD_INPUT_REVERSE)) != 0;
  for (const std::string& name : kLocal) {
    Watched& motor = watched_.at(name);
    if (held || motor.held) motor.local_until_us = now_us() + kKeyUs;
    motor.held = held;
  }
  tell_inputs();
}

void WatchedLab::key(std::uint8_t byte) {
  for (const std::string& name : kKeypad) watched_.at(name).local_until_us = now_us() + kKeyUs;
  bus(0).mcu(0).keypad_byte(byte, now_us() * 1000);
}

void WatchedLab::cycle(int station, int subaddress, int function, std::uint32_t data) {
  ask(api::Camac{.crate = 1, .block = {.cycles = {{station, subaddress, function, data}}}},
      "crate");
}

void WatchedLab::cut_line() {
  cut_ = true;
  unplug(0);
}

void WatchedLab::reset_mcu(std::size_t mcu) {
  bus(0).reboot(mcu, 50'000'000);
}

void WatchedLab::lose_daemon() {
  for (const std::string& name : kMotors) orphan(name);
  settle_accounts();
  tickets_.clear();
  restart_daemon();
}

void WatchedLab::end_daemon() {
  ending_ = true;
  core().shut_down(now_us());
}

// One answer that ends it, and nothing behind it.
void WatchedLab::settle_accounts() {
  for (const Ticket& ticket : tickets_) {
    const std::vector<Answer> answers = replies(ticket.number);
    const auto ends = std::ranges::count_if(
        answers, [](const Answer& answer) { return answer.phase != Answer::kAccepted; });
    EXPECT_LE(ends, 1) << ticket.what;
    EXPECT_LE(answers.size(), 2U) << ticket.what;
    if (ends == 1) {
      EXPECT_NE(answers.back().phase, Answer::kAccepted)
          << ticket.what << " is accepted after its result";
    }
  }
}

void WatchedLab::compare_positions() {
  for (auto& [name, motor] : watched_) {
    const api::MotorState told = this->motor(name);
    if (told.trust != api::Trust::kKnown) continue;
    const std::int64_t stands_at = motor.shaft - motor.origin;
    if (told.position_steps != stands_at && !std::exchange(motor.may_be_placed, false)) {
      ADD_FAILURE() << name << " is said to stand at " << told.position_steps << ", and stands at "
                    << stands_at;
    }
    motor.origin = motor.shaft - told.position_steps;
  }
}

void WatchedLab::bring_to_rest() {
  press(0);
  held_inputs_ = 0;
  tell_inputs();
  if (std::exchange(ending_, false)) {
    run(2.5);
    lose_daemon();
  }
  if (std::exchange(cut_, false)) plug(0);
  disk_us = 500;
  const auto online = [this] {
    return has_state("hall:1") && has_state("hall:2") &&
           state_of("hall:1").state != api::McuState::kOffline &&
           state_of("hall:2").state != api::McuState::kOffline;
  };
  EXPECT_TRUE(run_till(online)) << "not all MCUs went online";
  cycle(5, 0, 24);
  cycle(7, 0, 24);
  ask(api::Stop{}, "end");
  ask(api::Disarm{}, "end");
  ask(api::Release{}, "end");
  const auto all_stand = [this] {
    return std::ranges::all_of(kMotors, [this](const std::string& name) {
      return stands(name) && this->motor(name).activity == api::Activity::kResting &&
             !this->motor(name).moving;
    });
  };
  EXPECT_TRUE(run_till(all_stand)) << "motors move on";
  // As people do, until it is taken.
  for (int tries = 0; tries < 10 && !all_ready(); ++tries) {
    ask(api::ClearFaults{}, "end");
    run(0.4);
    ask(api::Enable{}, "end");
    run(0.4);
  }
  EXPECT_TRUE(all_ready()) << "not all MCUs became READY: " << state_of("hall:1").detail << ", "
                           << state_of("hall:2").detail;
  const auto answered = [this] { return std::ranges::none_of(tickets_, &Ticket::open); };
  if (!run_till(answered, 10)) {
    for (const Ticket& ticket : tickets_) {
      EXPECT_FALSE(ticket.open) << ticket.what << " has no result";
    }
  }
  settle_accounts();
  compare_positions();
  tickets_.clear();
  // Back to 0, each as it is counted.
  const std::int64_t set = send(api::SetPosition{
      .motors = motor_steps(kMotors, std::vector<std::int64_t>(kMotors.size(), 0)), .dial = true});
  EXPECT_TRUE(run_till([&] { return has_result(set); }, 10));
  EXPECT_EQ(last_reply(set).result, "done") << last_reply(set).reason;
  run(0.2);
  for (auto& [name, motor] : watched_) {
    motor = {.shaft = motor.shaft, .origin = motor.shaft, .last_step_us = motor.last_step_us};
  }
  tell_inputs();
}

}  // namespace bushd::test::matrix
