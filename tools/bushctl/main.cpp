// bushctl: the command line client of bushd. The only file that includes CLI11 (slow to compile).
#include <fmt/format.h>
#include <sys/signalfd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "base/standard_output.h"
#include "commands.h"
#include "line_commands.h"
#include "move_arguments.h"

namespace {

using bushd::command_t;
using bushd::lcm::Client;

struct Arguments {
  std::string url;
  std::string prefix = bushd::lcm::kDefaultPrefix;
  double timeout_s = 2.0;
  bool json = false;
  bool wait = false;
  unsigned count = 0;
  std::vector<std::string> motors;
  std::string motor;
  std::string steps;
  bool watch = false;
  bushctl::LineOptions line;
  std::uint8_t address = 0;
  std::string unique_id;
  std::string group;
  std::string table;
  bool dry_run = false;
  std::string edge = "rising";
  std::int32_t delay_us = 0;
  bushctl::Pulse pulse;
};

// Both before and after the subcommand.
void add_connection(CLI::App* app, Arguments& arguments) {
  app->add_option("--url", arguments.url, "LCM URL")->capture_default_str();
  app->add_option("--prefix", arguments.prefix, "Prefix of the daemon's channels")
      ->capture_default_str();
}

CLI::App* add_command(CLI::App& app, Arguments& arguments, const char* name, const char* text) {
  CLI::App* command = app.add_subcommand(name, text);
  add_connection(command, arguments);
  return command;
}

CLI::App* add_motors_command(CLI::App& app, Arguments& arguments, const char* name,
                             const char* text) {
  CLI::App* command = add_command(app, arguments, name, text);
  command->add_option("NAME", arguments.motors, "Motors; none: all");
  return command;
}

void add_timeout(CLI::App* command, Arguments& arguments) {
  command->add_option("--timeout-s", arguments.timeout_s, "How long to wait for the daemon's state")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::lround(seconds * 1000));
}

// SIGINT and SIGTERM from a descriptor. Before LCM starts its thread, which inherits the mask.
int block_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(-1, &signals, SFD_CLOEXEC);
}

int with_client(const Arguments& arguments, const auto& action) {
  auto client = Client::open({.url = arguments.url,
                              .prefix = arguments.prefix,
                              .program = "bushctl",
                              .interrupt_fd = block_signals()});
  if (!client) {
    fmt::print(stderr, "bushctl: {}\n", client.error().text());
    return bushctl::kFailed;
  }
  return action(**client);
}

int send(const Arguments& arguments, const bushd::Result<command_t>& command, bool wait) {
  if (!command) {
    fmt::print(stderr, "bushctl: {}\n", command.error().text());
    return bushctl::kUsage;
  }
  return with_client(arguments, [&](Client& client) {
    return bushctl::send(client, *command,
                         wait ? Client::Until::kResult : Client::Until::kAnswered);
  });
}

command_t to_motors(std::int8_t kind, const std::vector<std::string>& motors) {
  command_t command{};
  command.kind = kind;
  command.motors = motors;
  command.steps.assign(motors.size(), 0);
  return command;
}

command_t to_use(const std::string& group, const std::string& table) {
  command_t command{};
  command.kind = command_t::USE_TABLE;
  command.group = group;
  command.table = table;
  return command;
}

// Commands that have the line for themselves.
CLI::App* add_line_command(CLI::App& app, Arguments& arguments, const char* name,
                           const char* text) {
  CLI::App* command = app.add_subcommand(name, text);
  command->footer("No daemon may have the port meanwhile.");
  command->add_option("PORT", arguments.line.port, "Serial port")->required();
  command->add_option("--baud", arguments.line.baud, "Bits per second")->required();
  return command;
}

int run(int argc, char** argv) {
  Arguments arguments;
  const char* url = std::getenv("LCM_DEFAULT_URL");
  arguments.url = url != nullptr && *url != '\0' ? url : bushd::lcm::kDefaultUrl;

  CLI::App app{"bushctl: moves and watches the motors of a running bushd"};
  app.footer("Exit codes: 0 done, 1 refused or not done (reason on stderr), 2 wrong usage.");
  app.require_subcommand(1);
  add_connection(&app, arguments);

  CLI::App* status = add_command(app, arguments, "status", "All motors and MCUs");
  status->add_flag("--json", arguments.json, "As JSON");
  add_timeout(status, arguments);

  CLI::App* move = add_command(app, arguments, "move",
                               "Moves motors, those of one bus starting in the same tick");
  move->footer(
      "bushctl move [--wait] NAME STEPS [NAME STEPS...]            by so many steps\n"
      "bushctl move [--wait] NAME --to STEPS [NAME --to STEPS...]  to these positions\n"
      "STEPS may be negative. A motor that moves is given a new target; by STEPS then counts from "
      "its present one. With --wait the exit code is 0 only if every motor reached its "
      "target.");
  move->add_flag("--wait", arguments.wait, "Wait for the result");
  CLI::Option* dry_run = move->add_flag(
      "--dry-run", arguments.dry_run,
      "Say how long it would take, how fast it would be and what would go out; moves nothing");
  move->add_flag("--json", arguments.json, "With --dry-run: as JSON")->needs(dry_run);
  move->allow_extras();  // names and numbers, in their order: parse_move()

  CLI::App* arm =
      add_command(app, arguments, "arm", "Lets moves wait for the trigger of their MCU");
  arm->footer(
      "bushctl arm --delay-us US NAME STEPS [NAME STEPS...]\n"
      "Motors at rest. Those of one MCU begin in the same slot, three ticks and the delay after "
      "the "
      "edge at its trigger input. With --wait the exit code is 0 only if every motor reached its "
      "target.");
  arm->add_option("--delay-us", arguments.delay_us, "From the edge on, beside the three ticks")
      ->required()
      ->check(CLI::Range(50, 1'500'000));
  arm->add_option("--edge", arguments.edge, "Which edge")
      ->check(CLI::IsMember({"rising", "falling"}))
      ->capture_default_str();
  arm->add_flag("--wait", arguments.wait, "Wait for the result");
  arm->allow_extras();  // parse_arm()
  CLI::App* disarm =
      add_motors_command(app, arguments, "disarm", "Takes back moves that wait for the trigger");
  disarm->footer("What waits for the same trigger, or was armed together, is disarmed together.");
  CLI::App* reference =
      add_command(app, arguments, "reference", "A pulse when a motor arrives at a position");
  reference->add_option("NAME", arguments.motor, "The motor; its MCU's reference output pulses")
      ->required();
  reference->add_option("POSITION", arguments.steps, "In steps, or off")->required();
  reference->add_option("--delay-us", arguments.pulse.delay_us, "From the step to the pulse")
      ->check(CLI::Range(0, 1'500'000))
      ->capture_default_str();
  reference->add_option("--width-us", arguments.pulse.width_us, "Of the pulse; at least a slot")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  reference
      ->add_option("--direction", arguments.pulse.direction, "In which the motor arrives there")
      ->check(CLI::IsMember({"both", "positive", "negative"}))
      ->capture_default_str();

  CLI::App* stop = add_motors_command(app, arguments, "stop", "Ramps motors down");
  stop->add_flag("--wait", arguments.wait, "Wait until they stand");
  CLI::App* home = add_command(app, arguments, "home",
                               "Motors find their switches, and with them their positions");
  home->footer(
      "As the configuration's 'home' says. Those of one MCU are homed one after the other. With "
      "--wait the exit code is 0 only if every motor has found its switch; 'bushctl stop' ends "
      "it.");
  home->add_option("NAME", arguments.motors, "Motors")->required();
  home->add_flag("--wait", arguments.wait, "Wait for the result");
  CLI::App* enable = add_motors_command(app, arguments, "enable", "Drivers of the motors' MCUs on");
  CLI::App* disable =
      add_motors_command(app, arguments, "disable", "Drivers of the motors' MCUs off");
  add_motors_command(app, arguments, "clear", "Clears faults of the motors' MCUs");
  CLI::App* set = add_command(app, arguments, "set", "Says at which position a motor stands");
  set->add_option("NAME", arguments.motor, "The motor, at rest")->required();
  set->add_option("STEPS", arguments.steps, "Its position from now on")->required();

  CLI::App* watch =
      add_command(app, arguments, "watch", "Live table; in a pipe: lines of what changes");
  watch->add_option("--count", arguments.count, "End after so many snapshots")
      ->check(CLI::PositiveNumber);
  add_timeout(watch, arguments);

  CLI::App* estop = add_command(app, arguments, "estop",
                                "Emergency stop: all motors of all buses, at once, until 'clear'");

  CLI::App* health = add_command(app, arguments, "health", "How well buses, adapters and MCUs do");
  health->add_flag("--json", arguments.json, "As JSON");
  health->add_flag("--watch", arguments.watch, "Again every second");
  health->add_option("--count", arguments.count, "With --watch: end after so many")
      ->check(CLI::PositiveNumber);
  add_timeout(health, arguments);

  CLI::App* table = add_command(app, arguments, "table", "Which table each group moves by");
  table->require_subcommand(1);
  CLI::App* list =
      add_command(*table, arguments, "list", "Tables that are there, and who has which");
  list->add_flag("--json", arguments.json, "As JSON");
  CLI::App* show = add_command(*table, arguments, "show", "What a table says");
  show->add_option("TABLE", arguments.table, "NAME, NAME@REVISION or NAME@TAG")->required();
  show->add_flag("--json", arguments.json, "As JSON");
  CLI::App* use = add_command(*table, arguments, "use", "Gives a group another table");
  use->footer(
      "TABLE is NAME, NAME@REVISION or NAME@TAG, as for bushtab. Motors that move keep their "
      "table; "
      "once those of the group's MCUs stand, the MCUs get the new one, and the next move is by it. "
      "It stays in service when the daemon is started again.");
  use->add_option("GROUP", arguments.group, "The group")->required();
  use->add_option("TABLE", arguments.table, "Its table from the next move on")->required();
  CLI::App* reload =
      add_command(*table, arguments, "reload",
                  "Reads all groups' tables again; bad ones leave the old in service");

  CLI::App* latency =
      add_line_command(app, arguments, "latency-test", "How late an adapter hands over answers");
  latency->add_option("--address", arguments.address, "Of the MCU to ask; default: any")
      ->check(CLI::Range(1, 255));
  unsigned requests = 200;
  latency->add_option("--count", requests, "Requests")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  latency->add_flag("--json", arguments.line.json, "As JSON");
  CLI::App* scan = add_line_command(app, arguments, "scan",
                                    "Which MCUs are on a line, whatever their addresses");
  scan->add_flag("--json", arguments.line.json, "As JSON");
  CLI::App* address =
      add_line_command(app, arguments, "address", "Gives an MCU another address, for good");
  address->add_option("UNIQUE_ID", arguments.unique_id, "Of the MCU, as 'scan' shows it")
      ->required();
  address->add_option("NEW", arguments.address, "Its address from now on")
      ->required()
      ->check(CLI::Range(1, 255));

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? bushctl::kDone : bushctl::kUsage;
  }

  if (status->parsed()) {
    return with_client(arguments, [&](Client& client) {
      return bushctl::show_status(client, milliseconds(arguments.timeout_s), arguments.json);
    });
  }
  if (watch->parsed()) {
    bushctl::WatchOptions options{.timeout = milliseconds(arguments.timeout_s), .count = {}};
    if (arguments.count > 0) options.count = arguments.count;
    return with_client(arguments, [&](Client& client) { return bushctl::watch(client, options); });
  }
  if (health->parsed()) {
    bushctl::HealthOptions options{.timeout = milliseconds(arguments.timeout_s),
                                   .json = arguments.json,
                                   .watch = arguments.watch,
                                   .count = {}};
    if (arguments.count > 0) options.count = arguments.count;
    return with_client(arguments,
                       [&](Client& client) { return bushctl::show_health(client, options); });
  }
  if (latency->parsed()) {
    return bushctl::latency_test(arguments.line, arguments.address, requests);
  }
  if (scan->parsed()) return bushctl::scan(arguments.line);
  if (address->parsed()) {
    return bushctl::set_address(arguments.line, arguments.unique_id, arguments.address);
  }
  if (estop->parsed()) return send(arguments, to_motors(command_t::EMERGENCY_STOP, {}), true);
  if (list->parsed()) {
    return with_client(
        arguments, [&](Client& client) { return bushctl::list_tables(client, arguments.json); });
  }
  if (show->parsed()) {
    return with_client(arguments, [&](Client& client) {
      return bushctl::show_table(client, arguments.table, arguments.json);
    });
  }
  if (use->parsed()) return send(arguments, to_use(arguments.group, arguments.table), true);
  if (reload->parsed()) return send(arguments, to_motors(command_t::RELOAD_TABLES, {}), true);
  if (move->parsed() && arguments.dry_run) {
    auto command = bushctl::parse_move(move->remaining());
    if (!command) return send(arguments, command, true);
    return with_client(arguments, [&](Client& client) {
      return bushctl::show_plan(client, *command, arguments.json);
    });
  }
  if (move->parsed())
    return send(arguments, bushctl::parse_move(move->remaining()), arguments.wait);
  if (arm->parsed()) {
    return send(arguments, bushctl::parse_arm(arm->remaining(), arguments.edge, arguments.delay_us),
                arguments.wait);
  }
  if (reference->parsed()) {
    return send(arguments,
                bushctl::parse_reference(arguments.motor, arguments.steps, arguments.pulse), true);
  }
  if (disarm->parsed())
    return send(arguments, to_motors(command_t::DISARM, arguments.motors), true);
  if (stop->parsed()) {
    return send(arguments, to_motors(command_t::STOP, arguments.motors), arguments.wait);
  }
  if (home->parsed()) {
    return send(arguments, to_motors(command_t::HOME, arguments.motors), arguments.wait);
  }
  // These are over in a moment, and only their result tells whether the MCUs did them.
  if (set->parsed())
    return send(arguments, bushctl::parse_set(arguments.motor, arguments.steps), true);
  const std::int8_t kind = enable->parsed()    ? command_t::ENABLE
                           : disable->parsed() ? command_t::DISABLE
                                               : command_t::CLEAR_FAULTS;
  return send(arguments, to_motors(kind, arguments.motors), true);
}

}  // namespace

int main(int argc, char** argv) {
  bushd::expect_closed_output();
  try {
    return bushd::finished_output(run(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "bushctl: {}\n", error.what());
    return bushctl::kFailed;
  }
}
