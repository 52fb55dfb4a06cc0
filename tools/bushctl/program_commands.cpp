// program: programs of MCUs are put, listed, run and erased.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "commands.h"
#include "program_file.h"
#include "program_text.h"
#include "progress.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;
using bushd::client::detail_of;
using bushd::client::Status;

constexpr const char* kGroup = "program";
constexpr std::chrono::milliseconds kStatusWithin{4000};

// A list that was asked for on a connection of its own, while the first one waits for an upload.
class Upload {
 public:
  Upload(const Connection& connection, std::string program) : program_(std::move(program)) {
    if (isatty(STDERR_FILENO) == 0) return;
    auto options = connection.options();
    options.answer_within = kEvery;
    if (auto client = Client::open(std::move(options))) client_ = std::move(*client);
  }

  void show() {
    if (!client_) return;
    const auto reply = client_->run(api::ListPrograms{}, Client::Until::kResult);
    const auto* list = detail_of<api::ProgramList>(reply);
    const std::string text = list == nullptr ? std::string() : upload_text(*list, program_);
    if (text.empty()) return;
    fmt::print(stderr, "\r{:.{}}\x1b[K", text, columns_of_terminal(STDERR_FILENO));
    std::fflush(stderr);
    shown_ = true;
  }
  void clear() {
    if (std::exchange(shown_, false)) fmt::print(stderr, "\r\x1b[K");
  }

  static constexpr std::chrono::milliseconds kEvery{200};

 private:
  std::string program_;
  std::unique_ptr<Client> client_;
  bool shown_ = false;
};

struct PutOptions {
  std::string program;
  std::string file;
  bool dry_run = false;
  bool json = false;
};

int print_put(Client& client, const api::ProgramEntry& program, bool as_json) {
  if (as_json) {
    fmt::print("{}\n", bushd::json_text(bushd::json_of(program)));
    return kDone;
  }
  // Without it positions are steps.
  const auto status = client.status(kStatusWithin);
  if (!status && client.interrupted()) return kInterrupted;
  print_lines(lines(program, status.value_or(Status())));
  return kDone;
}

int put(const Connection& connection, const PutOptions& options) {
  auto request = read_program(options.program, options.file);
  if (!request) return wrong_usage(request.error());
  request->dry_run = options.dry_run;
  return with_client(connection, [&](Client& client) {
    Upload upload(connection, options.program);
    Client::Meanwhile meanwhile;
    if (!options.dry_run) {
      meanwhile.beside = [&]() -> std::optional<api::Request> {
        upload.show();
        return std::nullopt;
      };
      meanwhile.beside_every = Upload::kEvery;
    }
    const auto reply = client.run(*request, Client::Until::kResult, meanwhile);
    upload.clear();
    if (!reply) return failure(client, reply.error());
    const auto* list = detail_of<api::ProgramList>(reply);
    const auto* completed = std::get_if<api::Completed>(&*reply);
    const bool done = completed != nullptr && completed->outcome == api::Outcome::kDone;
    if (list == nullptr || list->programs.empty() || !done) return refused(*reply);
    return print_put(client, list->programs.front(), options.json);
  });
}

int list_programs(Client& client, bool as_json) {
  const auto list = ask<api::ProgramList>(client, api::ListPrograms{});
  if (!list) return list.error();
  print_lines(as_json ? std::vector{bushd::json_text(bushd::json_of(*list))} : table(*list));
  return kDone;
}

// What a stop of these programs is to name.
api::MotorNames motors_of(const api::ProgramList& list, const std::vector<std::string>& programs) {
  api::MotorNames motors;
  for (const api::ProgramEntry& entry : list.programs) {
    if (std::ranges::find(programs, entry.program) == programs.end()) continue;
    for (const api::ProgramEntry::Motor& motor : entry.motors) motors.push_back(motor.motor);
  }
  return motors;
}

int run_programs(Client& client, const std::vector<std::string>& programs, bool wait) {
  Sending sending{.request = api::RunPrograms{programs},
                  .until = wait ? Client::Until::kResult : Client::Until::kAnswered,
                  .hope = Hope::kReached};
  if (wait) {
    const auto reply = client.run(api::ListPrograms{}, Client::Until::kResult);
    if (!reply) return failure(client, reply.error());
    if (const auto* list = detail_of<api::ProgramList>(reply)) {
      sending.motors = motors_of(*list, programs);
    }
  }
  return send(client, sending);
}

void add_program_put(CommandLine& commands) {
  const auto options = std::make_shared<PutOptions>();
  commands.add("put", "Put a program into the memory of the MCU of its motors", kGroup)
      .footer(
          "FILE is TOML (docs/programs.md); files of points that it names are read beside it. It "
          "takes the place of the program that this MCU has; nothing moves. Prints what the "
          "program will do from where its motors stand.")
      .option("PROGRAM", &options->program,
              "Its name: 1 to 63 of A-Z a-z 0-9 _ . -, the first one no -")
      .option("FILE", &options->file, "The program")
      .flag("--dry-run", &options->dry_run, "Only check it, and print what it would do")
      .flag("--json", &options->json, "Print JSON")
      .run([&commands, options] { return put(commands.connection(), *options); });
}

void add_program_list(CommandLine& commands) {
  const auto json = std::make_shared<bool>(false);
  commands
      .add("list", "List the programs of all MCUs that can have one, and how far they are", kGroup)
      .flag("--json", json.get(), "Print JSON")
      .run_with_client([json](Client& client) { return list_programs(client, *json); });
}

void add_program_run(CommandLine& commands) {
  struct Options {
    std::vector<std::string> programs;
    bool wait = false;
  };
  const auto options = std::make_shared<Options>();
  commands.add("run", "Run programs; those of one bus start in the same tick", kGroup)
      .footer(
          "Several programs are of MCUs of one bus: all of them start, or none does. 'bushctl "
          "stop', 'pause' and 'resume' of one motor are for the whole program. With --wait the "
          "exit code is 0 only if every program came to its end; Ctrl-C ramps their motors down.")
      .words("PROGRAM", &options->programs, "Programs that were put", Command::Needed::kYes)
      .flag("--wait", &options->wait, "Wait for the result")
      .run_with_client([options](Client& client) {
        return run_programs(client, options->programs, options->wait);
      });
}

void add_program_erase(CommandLine& commands) {
  const auto program = std::make_shared<std::string>();
  commands.add("erase", "Erase a program from the memory of its MCU", kGroup)
      .option("PROGRAM", program.get(), "The program")
      .run([&commands, program] {
        return send(commands.connection(), api::EraseProgram{*program});
      });
}

}  // namespace

void add_program_commands(CommandLine& commands) {
  commands.add_group(kGroup, "Let MCUs carry out programs by themselves");
  add_program_put(commands);
  add_program_list(commands);
  add_program_run(commands);
  add_program_erase(commands);
}

}  // namespace bushctl
