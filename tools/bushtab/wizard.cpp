// wizard: a table of the profile pto from the answers to a few questions, in the order and with the
// names of PLC motion wizards.
//
// A typed answer that cannot be is asked for again. One from a file ends the wizard: what follows
// would be taken for answers to other questions.
#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/parse_number.h"
#include "base/printable.h"
#include "commands.h"
#include "diagnostic_text.h"
#include "open_table.h"
#include "tables/profiles/quantity.h"
#include "tables/table.h"

namespace bushtab {
namespace {

using bushd::Result;
namespace tables = bushd::tables;
namespace profiles = bushd::tables::profiles;
using profiles::Quantity;

constexpr std::size_t kMaxAnswer = 4096;  // bytes: a path fits

class Questions {
 public:
  // Takes the answer, or says why it cannot.
  using Take = std::function<Result<void>(const std::string& answer)>;

  struct Question {
    std::string text;
    std::string* usual;
    Take take;
  };
  Result<void> ask_all(const std::vector<Question>& questions) {
    for (const Question& question : questions) {
      if (auto asked = ask(question.text, *question.usual, question.take); !asked) return asked;
    }
    return {};
  }

  // Asks until `take` succeeds; an empty answer is `usual`, which becomes the answer given.
  Result<void> ask(const std::string& question, std::string& usual, const Take& take) {
    while (true) {
      const std::string ready = usual.empty() ? "" : fmt::format(" [{}]", bushd::printable(usual));
      fmt::print("{}{}: ", question, ready);
      std::fflush(stdout);
      auto line = read_line();
      if (!line) {
        fmt::print("\n");
        return bushd::fail(line.error());
      }
      if (!typed_) fmt::print("{}\n", bushd::printable(*line));
      asked_ = true;
      const std::string answer = line->empty() ? usual : *line;
      const Result<void> taken = take(answer);
      if (taken) {
        usual = answer;
        return {};
      }
      const std::string why = fmt::format("{}: {}", question, taken.error().text());
      if (!typed_) return bushd::fail(why + "; nothing is written");
      fmt::print("{}\n", bushd::printable_lines(taken.error().text()));
    }
  }

 private:
  Result<std::string> read_line() {
    std::string line;
    int byte = std::getchar();
    for (; byte != EOF && byte != '\n'; byte = std::getchar()) {
      if (line.size() == kMaxAnswer) {
        return bushd::fail(
            fmt::format("an answer has {} bytes at most; nothing is written", kMaxAnswer));
      }
      line.push_back(static_cast<char>(byte));
    }
    if (byte == EOF && line.empty()) {
      if (asked_ || typed_) {
        return bushd::fail("the answers end here; nothing is written. A line for each question");
      }
      return bushd::fail(
          "the wizard asks questions: run it in a terminal, or give it the answers on standard "
          "input, a line each. \"bushtab new --law pto\" takes them as options");
    }
    if (const std::size_t end = line.find_last_not_of(" \t\r"); end != std::string::npos) {
      line.resize(end + 1);
      line.erase(0, line.find_first_not_of(" \t"));
    } else {
      line.clear();
    }
    return line;
  }

  const bool typed_ = isatty(STDIN_FILENO) == 1;
  bool asked_ = false;
};

// What has been answered, as it was: the usual answers when all is asked again.
struct Answers {
  std::string max, start, accel_time, decel_time;
  std::string torque_file = "none", steps_per_turn = "200", full_steps_per_turn = "200", inertia,
              friction = "0Nm", safety = "2";
};

Questions::Take quantity(Quantity kind, double& value,
                         const std::function<Result<void>(double)>& check) {
  return [kind, &value, check](const std::string& answer) -> Result<void> {
    const auto parsed = profiles::parse_quantity(kind, answer);
    if (!parsed) return bushd::fail(parsed.error());
    if (const auto good = check(*parsed); !good) return good;
    value = *parsed;
    return {};
  };
}

Result<void> positive(double value) {
  if (value > 0) return {};
  return bushd::fail("must be above 0");
}

Result<void> not_negative(double value) {
  if (value >= 0) return {};
  return bushd::fail("must not be below 0");
}

Questions::Take number(double& value, double least) {
  return [&value, least](const std::string& answer) -> Result<void> {
    const auto given = bushd::parse_number<double>(answer);
    if (!given || *given < least) {
      return bushd::fail(fmt::format("allowed: a number, {} or more", least));
    }
    value = *given;
    return {};
  };
}

Result<void> ask_profile(Questions& questions, Answers& answers, profiles::Spec& spec) {
  const std::string speed = " (" + profiles::units_text(Quantity::kSpeed) + ")";
  const std::string time = " (" + profiles::units_text(Quantity::kTime) + ")";
  const auto below_max = [&spec](double hz) -> Result<void> {
    if (hz > 0 && hz <= spec.max_hz) return {};
    return bushd::fail(
        fmt::format("must be above 0 and at most the maximum speed, {:.6g} steps/s", spec.max_hz));
  };
  double accel_s = 0;
  double decel_s = 0;
  const auto accel_time = [&](const std::string& answer) -> Result<void> {
    auto taken = quantity(Quantity::kTime, accel_s, positive)(answer);
    if (taken && answers.decel_time.empty()) answers.decel_time = answer;
    return taken;
  };
  const auto asked = questions.ask_all({
      {"Maximum speed, MAX_SPEED" + speed, &answers.max,
       quantity(Quantity::kSpeed, spec.max_hz, positive)},
      {"Start/stop speed, SS_SPEED" + speed, &answers.start,
       quantity(Quantity::kSpeed, spec.start_hz, below_max)},
      {"Acceleration time, from start to maximum speed" + time, &answers.accel_time, accel_time},
      {"Deceleration time, from maximum to stop speed" + time, &answers.decel_time,
       quantity(Quantity::kTime, decel_s, positive)},
  });
  if (!asked) return asked;
  spec.accel = {.profile = profiles::Profile::kPto, .time_s = accel_s};
  spec.decel = {.profile = profiles::Profile::kPto, .time_s = decel_s};
  return {};
}

Result<void> ask_motor(Questions& questions, Answers& answers, MotorOptions& options) {
  profiles::Motor& motor = options.motor;
  const std::string inertia = " (" + profiles::units_text(Quantity::kInertia) + ")";
  const std::string torque = " (" + profiles::units_text(Quantity::kTorque) + ")";
  const auto file = [&](const std::string& answer) -> Result<void> {
    options.torque_file = answer == "none" ? "" : answer;
    if (options.torque_file.empty()) return {};
    const auto curve = profiles::load_torque_csv(answer, motor.steps_per_turn);
    if (!curve) return bushd::fail(curve.error());
    return {};
  };
  const auto asked = questions.ask_all(
      {{"Motor's pull-out torque, a CSV file, or none", &answers.torque_file, file}});
  if (!asked || options.torque_file.empty()) return asked;
  return questions.ask_all({
      {"Steps of a turn, microsteps included", &answers.steps_per_turn,
       number(motor.steps_per_turn, 1)},
      {"Full steps of a turn", &answers.full_steps_per_turn, number(motor.full_steps_per_turn, 1)},
      {"Inertia of rotor and load" + inertia, &answers.inertia,
       quantity(Quantity::kInertia, motor.inertia_kgm2, positive)},
      {"Friction of motor and load" + torque, &answers.friction,
       quantity(Quantity::kTorque, motor.friction_nm, not_negative)},
      {"Safety factor, torque of the motor / torque used", &answers.safety,
       number(motor.safety, 1)},
  });
}

// The figures and the drawing of what would be written; what the motor says of it.
Result<void> tell(const New& wanted) {
  const auto motor = load_motor(wanted.motor);
  if (!motor) return bushd::fail(motor.error());
  auto content = profiles::make_content(wanted.spec);
  if (!content) return bushd::fail(content.error());
  const auto table = tables::make(std::move(*content), wanted.spec.name);
  if (!table) return bushd::fail(table.error());
  fmt::print("\n");
  draw_in_terminal({*table}, {wanted.spec.name});
  const bushd_table& view = (*table)->view();
  fmt::print("{} codes up, {} down\n", view.accel.count, view.decel.count);
  profiles::Limits limits;
  limits.motor = *motor;
  const auto found = profiles::diagnostics(**table, limits);
  for (const profiles::Diagnostic& diagnostic : found) fmt::print("{}\n", text_of(diagnostic));
  if (found.empty() && *motor) fmt::print("the motor can follow it\n");
  fmt::print("\n");
  return {};
}

}  // namespace

int wizard(const Places& places, const Wizard& wanted) {
  const auto home = home_of(places, wanted.table);
  if (!home) return refuse(home.error());
  New made;
  made.table = wanted.table;
  made.replace = wanted.replace;
  made.spec.name = home->name;
  Questions questions;
  Answers answers;
  while (true) {
    if (const auto asked = ask_profile(questions, answers, made.spec); !asked) {
      return refuse(asked.error());
    }
    if (const auto asked = ask_motor(questions, answers, made.motor); !asked) {
      return refuse(asked.error());
    }
    const auto told = tell(made);
    if (!told) fmt::print("{}\n", bushd::printable_lines(told.error().text()));
    char choice = 0;
    const auto take = [&](const std::string& answer) -> Result<void> {
      choice = answer == "yes" || answer == "no" || answer == "again" ? answer.front() : '\0';
      if (choice == 'y' && !told) return bushd::fail(told.error());
      if (choice != 0) return {};
      return bushd::fail("allowed: yes, no, or again: all questions with these answers ready");
    };
    std::string usual = told ? "yes" : "again";
    if (const auto asked = questions.ask(
            "Write " + bushd::printable(made.spec.name) + ": yes, no, again", usual, take);
        !asked) {
      return refuse(asked.error());
    }
    if (choice == 'y') return make_new(places, made);
    if (choice == 'n') {
      fmt::print("nothing is written\n");
      return kDone;
    }
  }
}

}  // namespace bushtab
