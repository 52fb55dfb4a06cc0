// What bushctl's subcommands share, and where they come from: one function per family puts its
// subcommands on the command line.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/answer.h"
#include "client/client.h"
#include "command_line.h"

namespace bushctl {

enum Exit : int {
  kDone = 0,
  kFailed = 1,  // refused, no daemon, or a result other than hoped for; stderr says which
  kUsage = 2,
  kInterrupted = 130
};

// status, where, watch, health
void add_view_commands(CommandLine& commands);
// move, arm, disarm, compare, stop, estop, home, set
void add_motion_commands(CommandLine& commands);
// follow
void add_follow_command(CommandLine& commands);
// pause, resume, hold, release, enable, disable, clear, confirm
void add_plain_commands(CommandLine& commands);
// disarm
void add_disarm_command(CommandLine& commands);
// history
void add_history_commands(CommandLine& commands);
// path
void add_path_commands(CommandLine& commands);
// jog
void add_jog_commands(CommandLine& commands);
// config
void add_config_commands(CommandLine& commands);
// table list, show, use, reload
void add_table_commands(CommandLine& commands);
// program put, list, run, erase
void add_program_commands(CommandLine& commands);
// camac
void add_camac_commands(CommandLine& commands);
// latency-test, scan, address: on a line that no daemon has
void add_raw_bus_commands(CommandLine& commands);
// setup
void add_setup_command(CommandLine& commands);
// doctor
void add_doctor_command(CommandLine& commands);
// web-token
void add_web_commands(CommandLine& commands);

// Where the service has its configuration.
inline constexpr const char* kSystemConfig = "/etc/bushd/bushd.toml";

// What NAME is, for --help.
inline constexpr const char* kMotors = "Motors; 'slit*' and @GROUP stand for several";
inline constexpr const char* kMotorsOrAll =
    "Motors; 'slit*' and @GROUP stand for several (default: all)";

// The file of tokens of bushd-web: the given one, if any.
std::string web_token_file(const std::string& given);

// What may follow these words (base/completion.h), with names that the daemon knows.
int complete(CommandLine& commands, const std::vector<std::string>& words);

// Runs the action with a client that SIGINT and SIGTERM interrupt; without a daemon it says so.
int with_client(const Connection& connection,
                const std::function<int(bushd::client::Client&)>& action);

// Readable once SIGINT or SIGTERM has come. First called before there are threads: they inherit
// that these are blocked.
int signal_descriptor();
// SIGINT or SIGTERM has come since; once, and then it is forgotten.
bool take_interrupt();
// From now on SIGHUP is one of these.
void take_hangup_too();

// What the result is when all is well. kDoneEverywhere: done, and the reason names no MCU that
// could not be reached.
enum class Hope { kReached, kDone, kDoneEverywhere };

// kAnswered: done when accepted. kResult: done when the result is as hoped for. All returns are
// exit codes.
int send(const Connection& connection, const bushd::api::Request& request,
         bushd::client::Client::Until until = bushd::client::Client::Until::kResult,
         Hope hope = Hope::kDone);
// The same with a client that is there.
int send(bushd::client::Client& client, const bushd::api::Request& request,
         bushd::client::Client::Until until, Hope hope);

// How a reason reads here.
using Wording = std::function<std::string(const std::string&)>;
struct Sending {
  bushd::api::Request request;
  bushd::client::Client::Until until{};
  Hope hope{};
  Wording wording{};  // of refusals
  // Those that it moves, if it does not name them itself: Ctrl-C stops them.
  bushd::api::MotorNames motors{};
};
int send(bushd::client::Client& client, const Sending& sending);
// A path whose points come in several requests: all but the last are taken, then that is sent.
int send_parts(const Connection& connection, const std::vector<bushd::api::MovePath>& parts,
               bushd::client::Client::Until until, const Wording& wording);
// What it would be.
int show_plan(const Connection& connection, std::vector<bushd::api::MovePath> parts, bool as_json,
              const Wording& wording);

int print(const bushd::api::MovePlan& plan, bool as_json);
void print_lines(const std::vector<std::string>& lines);

// Says on stderr why, unless it was the user who broke off.
int failure(const bushd::client::Client& client, const bushd::Error& error);
// If something of what was shown did not arrive, stderr says so. kDone if nothing is missing.
int complete(const bushd::client::Status& status, const bushd::client::Status::Missing& missing,
             const char* things);
// Says on stderr why.
int failed(const bushd::Error& error);
// Says what is wrong with words that make no request.
int wrong_usage(const bushd::Error& error);
int refused(const bushd::api::Reply& reply);

// What the request's result brings. Where there is none, stderr says why, and the error is the exit
// code.
template <class Detail>
tl::expected<Detail, int> ask(bushd::client::Client& client, const bushd::api::Request& request) {
  const auto reply = client.run(request, bushd::client::Client::Until::kResult);
  if (!reply) return tl::unexpected(failure(client, reply.error()));
  const auto* detail = bushd::client::detail_of<Detail>(*reply);
  if (detail == nullptr) return tl::unexpected(refused(*reply));
  return *detail;
}

std::chrono::milliseconds milliseconds(double seconds);
// The clock on the wall, since 1970.
std::int64_t unix_us();

}  // namespace bushctl
