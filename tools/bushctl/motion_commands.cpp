// Subcommands that move motors, stop them, and say where they stand.
#include <fmt/format.h>

#include <chrono>
#include <memory>

#include "commands.h"
#include "envelope_move.h"
#include "move_arguments.h"
#include "path_file.h"
#include "render.h"
#include "where.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;

constexpr const char* kSpeed = "Not faster than this, in the motor's unit per second";
constexpr const char* kSteps = "Numbers are steps, not the motors' units";

Numbers numbers(bool steps) {
  return steps ? Numbers::kSteps : Numbers::kUser;
}

Client::Until until(bool wait) {
  return wait ? Client::Until::kResult : Client::Until::kAnswered;
}

// What the move would be.
template <class Move>
int show_plan(const Connection& connection, Move move, bool as_json) {
  return with_client(connection, [&](Client& client) {
    move.dry_run = true;
    const auto plan = ask<api::MovePlan>(client, move);
    return plan ? print(*plan, as_json) : plan.error();
  });
}

struct MoveOptions {
  bool wait = false;
  bool steps = false;
  bool dry_run = false;
  bool json = false;
  bool line = false;
  std::string speed;
  std::string envelope;
  LineOptions along;
  std::vector<std::string> words;
};

constexpr std::chrono::milliseconds kStatusPatience{4000};

// Where its motor stands, and what its scale is, the daemon knows.
int move_by_envelope(const Connection& connection, const MoveOptions& options) {
  if (options.words.size() != 1 || options.line || options.steps) {
    return wrong_usage(bushd::Error{
        "--envelope is for one motor, and says where it goes: write NAME --envelope ENVELOPE, "
        "without --line and --steps"});
  }
  const auto envelope = read_envelope(options.envelope);
  if (!envelope) return failed(envelope.error());
  std::vector<api::MovePath> path;
  const int code = with_client(connection, [&](Client& client) {
    const auto status = client.status(kStatusPatience);
    if (!status) return failure(client, status.error());
    const auto motors = where(*status, options.words, unix_us());
    if (!motors) return failed(motors.error());
    if (motors->size() != 1) return failed(bushd::Error{"--envelope is for one motor"});
    auto made = envelope_path(*envelope, motors->front(), options.speed);
    if (!made) return failed(made.error());
    path = std::move(*made);
    return static_cast<int>(kDone);
  });
  if (code != kDone) return code;
  return options.dry_run ? show_plan(connection, path, options.json, {})
                         : send_parts(connection, path, until(options.wait), {});
}

void add_move(CommandLine& commands) {
  using Options = MoveOptions;
  const auto options = std::make_shared<Options>();
  const auto carry_out = [&commands, options](auto move) {
    const auto speed = parse_speed(options->speed, numbers(options->steps));
    if (!speed) return wrong_usage(speed.error());
    move.speed = *speed;
    if (options->dry_run) return show_plan(commands.connection(), move, options->json);
    return send(commands.connection(), move, until(options->wait), Hope::kReached);
  };
  commands.add("move", "Move motors; those on one bus start in the same tick")
      .footer(
          "bushctl move [--wait] NAME DISTANCE [NAME DISTANCE...]            by these distances\n"
          "bushctl move [--wait] NAME --to POSITION [NAME --to POSITION...]  to these positions\n"
          "Both are in the motor's unit, or in steps of a motor without one, and may be negative; "
          "the nearest step counts. A motor that moves is given a new target; a distance then "
          "counts from its present one. 'slit*' and @GROUP stand for several motors. With --wait "
          "the exit code is 0 only if every motor reached "
          "its target.\n"
          "With --line motors of one bus move along a straight line: at any moment each of them "
          "has made the same share of its way. Stops, pauses and limits of one act on all. By the "
          "elementary law, of motors of one MCU, one motor makes one step at a time, and --feed is "
          "that of these steps.\n"
          "NAME --to POSITION --speed-at AT:SPEED [--speed-at AT:SPEED...] moves one motor, from "
          "each of these positions on not faster than that, until the next one; it makes no last "
          "approach for backlash.\n"
          "NAME --envelope ENVELOPE moves one motor by an envelope of 'bushtab envelope': a name "
          "in "
          "/etc/bushd/tables, or a file NAME.envelope with its table beside it.")
      .flag("--line", &options->line,
            "Along a straight line; all motors on one bus, or each at a serial port of its own")
      .flag("--wait", &options->wait, "Wait for the result")
      .option("--speed", &options->speed, kSpeed)
      .option_with("--line", "--duration", &options->along.duration,
                   "With --line: take at least so many seconds")
      .choice_with("--line", "--law", &options->along.law, kLaws,
                   "With --line: the motor with most steps leads, or one motor steps at a time")
      .option_with("--line", "--feed", &options->along.feed,
                   "With --line: not faster along the way than this, per second, in the unit that "
                   "the motors share")
      .option("--envelope", &options->envelope, "By the speeds of this envelope, to where it ends")
      .flag("--steps", &options->steps, kSteps)
      .flag("--dry-run", &options->dry_run,
            "Say how long it would take, how fast it would be and what would go out; moves nothing")
      .flag_with("--dry-run", "--json", &options->json, "With --dry-run: print JSON")
      .raw_words(&options->words, "NAME DISTANCE|NAME --to POSITION...")
      .run([&commands, carry_out, options] {
        if (!options->envelope.empty()) return move_by_envelope(commands.connection(), *options);
        const Numbers as = numbers(options->steps);
        const auto profile = parse_speed_profile(options->words, as, options->speed);
        if (!profile) return wrong_usage(profile.error());
        if (!profile->empty() && options->line) {
          return wrong_usage(bushd::Error{"--speed-at is for one motor, --line for several"});
        }
        if (!profile->empty() && options->dry_run) {
          return show_plan(commands.connection(), *profile, options->json, {});
        }
        if (!profile->empty()) {
          return send_parts(commands.connection(), *profile, until(options->wait), {});
        }
        if (options->line) {
          auto move = parse_move_line(options->words, as, options->along);
          return move ? carry_out(std::move(*move)) : wrong_usage(move.error());
        }
        auto move = parse_move(options->words, as);
        return move ? carry_out(std::move(*move)) : wrong_usage(move.error());
      });
}

void add_arm(CommandLine& commands) {
  struct Options {
    std::string edge = "rising";
    std::int64_t delay_us = 0;
    bool line = false;
    std::string duration;
    bool steps = false;
    bool wait = false;
    bool while_connected = false;
    std::string speed;
    std::vector<std::string> words;
  };
  const auto options = std::make_shared<Options>();
  const auto carry_out = [&commands, options](auto arm) {
    if (!arm) return wrong_usage(arm.error());
    const auto speed = parse_speed(options->speed, numbers(options->steps));
    if (!speed) return wrong_usage(speed.error());
    arm->speed = *speed;
    arm->while_connected = options->while_connected;
    // Whose end disarms them has to stay.
    const bool waits = options->wait || options->while_connected;
    return send(commands.connection(), *arm, until(waits), Hope::kReached);
  };
  commands.add("arm", "Let moves wait for the trigger of their MCU")
      .footer(
          "bushctl arm --delay-us US NAME DISTANCE [NAME DISTANCE...]\n"
          "bushctl arm --delay-us US --line NAME DISTANCE [NAME DISTANCE...], or NAME --to "
          "POSITION\n"
          "Motors at rest. Those of one MCU begin in the same slot, three ticks and the delay "
          "after the edge at its trigger input. With --line they move along a straight line, as "
          "with move --line, on MCUs that can make it; each MCU goes by the edge at its own input. "
          "They wait without an end, also when bushctl has ended: 'bushctl disarm' ends that, and "
          "'bushctl status' tells who has armed them. With --while-connected they are disarmed "
          "when "
          "bushctl ends, however that comes. "
          "With --wait the exit code is 0 only if every motor "
          "reached its target.")
      .number("--delay-us", &options->delay_us, bushd::api::Arm::kDelayUs,
              "Delay from the edge, beyond the three ticks", Command::Needed::kYes)
      .flag("--line", &options->line, "Along a straight line; all motors on one bus")
      .option_with("--line", "--duration", &options->duration,
                   "With --line: take at least so many seconds")
      .choice("--edge", &options->edge, {"rising", "falling"}, "Edge that starts the moves")
      .option("--speed", &options->speed, kSpeed)
      .flag("--steps", &options->steps, kSteps)
      .flag("--wait", &options->wait, "Wait for the result")
      .flag("--while-connected", &options->while_connected,
            "Wait for the result, and disarm them if this program ends before")
      .raw_words(&options->words, "NAME DISTANCE|NAME --to POSITION...")
      .run([carry_out, options] {
        const Numbers as = numbers(options->steps);
        if (options->line) {
          return carry_out(parse_arm_line(options->words, as, options->edge, options->delay_us,
                                          options->duration));
        }
        return carry_out(parse_arm(options->words, as, options->edge, options->delay_us));
      });
}

void add_compare(CommandLine& commands) {
  struct Options {
    std::string motor;
    std::string position;
    bool steps = false;
    Pulse pulse;
  };
  const auto options = std::make_shared<Options>();
  commands.add("compare", "Make a pulse when a motor arrives at a position")
      .option("NAME", &options->motor, "The motor; its MCU's position compare output pulses")
      .option("POSITION", &options->position, "Position in the motor's unit, or off")
      .flag("--steps", &options->steps, kSteps)
      .number("--delay-us", &options->pulse.delay_us, bushd::api::PositionCompare::kDelayUs,
              "Delay from the step to the pulse")
      .number("--width-us", &options->pulse.width_us, bushd::api::PositionCompare::kWidthUs,
              "Width of the pulse, at least a slot")
      .choice("--direction", &options->pulse.direction, {"both", "positive", "negative"},
              "Direction of arrival")
      .run([&commands, options] {
        const auto request = parse_position_compare(options->motor, options->position,
                                                    numbers(options->steps), options->pulse);
        if (!request) return wrong_usage(request.error());
        return send(commands.connection(), *request);
      });
}

void add_stop(CommandLine& commands) {
  struct Options {
    api::MotorNames motors;
    bool wait = false;
  };
  const auto options = std::make_shared<Options>();
  commands.add("stop", "Ramp motors down")
      .words("NAME", &options->motors, kMotorsOrAll, Command::Needed::kNo)
      .flag("--wait", &options->wait, "Wait until the motors stand")
      .run([&commands, options] {
        return send(commands.connection(), api::Stop{options->motors}, until(options->wait));
      });
}

void add_estop(CommandLine& commands) {
  commands.add("estop", "Stop all motors of all buses at once, until 'clear'")
      .footer(
          "The exit code is 0 only if all MCUs have confirmed it and stand. One that cannot be "
          "reached "
          "is named, and stopped as soon as it comes.")
      .run([&commands] {
        return send(commands.connection(), api::EmergencyStop{}, Client::Until::kResult,
                    Hope::kDoneEverywhere);
      });
}

void add_home(CommandLine& commands) {
  struct Options {
    api::MotorNames motors;
    std::string speed;
    bool steps = false;
    bool all = false;
    bool wait = false;
  };
  const auto options = std::make_shared<Options>();
  commands.add("home", "Home motors at their switches")
      .footer(
          "As the configuration's 'home' says. Those of one MCU are homed one after the other; "
          "with --all those of one 'order' are homed together, the lowest first, and one that is "
          "not found ends the others. With --wait the exit code is 0 only if every motor has found "
          "its switch; 'bushctl stop' ends it, and with --wait Ctrl-C (with --all it stops all "
          "motors).")
      .words("NAME", &options->motors, kMotors, Command::Needed::kNo)
      .flag("--all", &options->all, "All motors with a home switch, by their order")
      .option("--speed", &options->speed, kSpeed)
      .flag("--steps", &options->steps, "--speed is in steps per second")
      .flag("--wait", &options->wait, "Wait for the result")
      .run([&commands, options] {
        const auto speed = parse_speed(options->speed, numbers(options->steps));
        if (!speed) return wrong_usage(speed.error());
        if (options->all != options->motors.empty()) {
          return wrong_usage(bushd::Error{.message = "home: name the motors, or use --all"});
        }
        return send(commands.connection(), api::Home{options->motors, *speed, options->all},
                    until(options->wait), Hope::kReached);
      });
}

void add_set(CommandLine& commands) {
  struct Options {
    std::string motor;
    std::string position;
    bool steps = false;
    bool dial = false;
  };
  const auto options = std::make_shared<Options>();
  commands.add("set", "Say where a motor stands, without moving it")
      .footer(
          "Of a motor with a unit, POSITION is its user position from now on: the offset changes. "
          "With --dial or --steps, and of a motor without a unit, the position itself is set, and "
          "is known from then on.")
      .option("NAME", &options->motor, "The motor, at rest")
      .option("POSITION", &options->position, "New position")
      .flag("--dial", &options->dial, "POSITION is the dial's")
      .flag("--steps", &options->steps, kSteps)
      .run([&commands, options] {
        const auto request =
            parse_set(options->motor, options->position, numbers(options->steps), options->dial);
        if (!request) return wrong_usage(request.error());
        // Over in a moment, and only the result tells whether the MCU did it.
        return send(commands.connection(), *request);
      });
}

}  // namespace

void add_motion_commands(CommandLine& commands) {
  add_move(commands);
  add_arm(commands);
  add_disarm_command(commands);
  add_compare(commands);
  add_stop(commands);
  add_estop(commands);
  add_home(commands);
  add_set(commands);
}

}  // namespace bushctl
