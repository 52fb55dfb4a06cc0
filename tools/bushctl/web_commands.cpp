// bushctl web-token: who may command from a page of bushd-web.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <pwd.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/printable.h"
#include "commands.h"
#include "grid.h"
#include "tokens/token_file.h"

namespace bushctl {
namespace {

namespace tokens = bushd::tokens;
using nlohmann::ordered_json;

constexpr std::uint32_t kMaxDays = 3650;
constexpr std::int64_t kDayS = 24 * 60 * 60;

struct TokenOptions {
  std::string name;
  std::uint32_t days = 90;
  bool list = false;
  std::string revoke;
  std::string file;
  bool json = false;
};

std::int64_t unix_s() {
  return unix_us() / 1'000'000;
}

std::string time_text(std::int64_t unix_s) {
  return fmt::format("{:%Y-%m-%d %H:%M}", fmt::localtime(static_cast<std::time_t>(unix_s)));
}

// As a name of a token: those of some directories have other characters.
std::string login_name() {
  const passwd* entry = ::getpwuid(::getuid());
  return entry == nullptr ? fmt::format("{}", ::getuid()) : tokens::name_like(entry->pw_name);
}

int make_token(const TokenOptions& options, const std::string& path) {
  const std::string user = login_name();
  const std::string name = options.name.empty() ? user : options.name;
  if (!tokens::is_name(name)) {
    return wrong_usage({.message = fmt::format("\"{}\" is no name of a token: allowed are 1..{} of "
                                               "A-Z, a-z, 0-9, '_', '.', '-'",
                                               name, tokens::kMaxNameLength)});
  }
  std::array<std::uint8_t, tokens::kRandomBytes> random{};
  if (::getentropy(random.data(), random.size()) != 0) {
    return failed({.message = fmt::format("no random bytes: {}", std::strerror(errno))});
  }
  const std::string shown = tokens::make_token(random);
  const std::int64_t now_s = unix_s();
  const tokens::Token token{.name = name,
                            .expires_s = now_s + options.days * kDayS,
                            .made_s = now_s,
                            .made_by = user,
                            .hash = tokens::hash_of(shown).value()};
  if (const auto added = tokens::add(path, token); !added) return failed(added.error());
  if (options.json) {
    const ordered_json json = {
        {"name", name}, {"token", shown}, {"expires_s", token.expires_s}, {"file", path}};
    fmt::print("{}\n", bushd::json_text(json));
    return kDone;
  }
  fmt::print(
      "Token \"{0}\", until {1}:\n\n    {2}\n\n"
      "Enter it once in the page of bushd-web, which may command from then on; capitals and dashes "
      "do not matter.\n"
      "It is not shown again. Whoever has it may move motors: 'bushctl web-token --revoke {0}' "
      "takes it back.\n",
      name, time_text(token.expires_s), shown);
  return kDone;
}

int list_tokens(const TokenOptions& options, const std::string& path) {
  const auto found = tokens::read(path);
  if (!found) return failed(found.error());
  const std::int64_t now_s = unix_s();
  if (options.json) {
    ordered_json json = {{"file", path}, {"tokens", ordered_json::array()}};
    for (const tokens::Token& token : *found) {
      json["tokens"].push_back({{"name", token.name},
                                {"expires_s", token.expires_s},
                                {"expired", token.expired(now_s)},
                                {"made_s", token.made_s},
                                {"made_by", token.made_by}});
    }
    fmt::print("{}\n", bushd::json_text(json));
    return kDone;
  }
  if (found->empty()) {
    fmt::print("no tokens in {}: 'bushctl web-token' makes one\n", bushd::printable(path));
    return kDone;
  }
  using enum Align;
  Grid grid({kLeft, kLeft, kLeft, kLeft, kLeft});
  grid.row({"NAME", "EXPIRES", "", "MADE", "BY"});
  for (const tokens::Token& token : *found) {
    grid.row({token.name, time_text(token.expires_s), token.expired(now_s) ? "expired" : "valid",
              time_text(token.made_s), token.made_by});
  }
  print_lines(grid.lines());
  return kDone;
}

int revoke_token(const TokenOptions& options, const std::string& path) {
  if (const auto revoked = tokens::revoke(path, options.revoke); !revoked) {
    return failed(revoked.error());
  }
  if (options.json) {
    fmt::print("{}\n", bushd::json_text(ordered_json{{"revoked", options.revoke}, {"file", path}}));
  } else {
    fmt::print("Token \"{}\" is revoked: pages with it may only read\n", options.revoke);
  }
  return kDone;
}

int web_token(const TokenOptions& options) {
  if (int{!options.name.empty()} + int{options.list} + int{!options.revoke.empty()} > 1) {
    return wrong_usage({.message = "one of NAME, --list and --revoke at a time"});
  }
  const std::string path = web_token_file(options.file);
  if (options.list) return list_tokens(options, path);
  if (!options.revoke.empty()) return revoke_token(options, path);
  return make_token(options, path);
}

}  // namespace

std::string web_token_file(const std::string& given) {
  const char* named = std::getenv("BUSHD_WEB_TOKENS");
  if (!given.empty()) return given;
  return named == nullptr || *named == '\0' ? tokens::kSystemFile : named;
}

void add_web_commands(CommandLine& commands) {
  const auto options = std::make_shared<TokenOptions>();
  commands.add_local("web-token", "Make a token by which a page of bushd-web may command, for NAME")
      .footer(
          "Needs no daemon, but the right to write the file: members of the group bushd have it. "
          "Only the SHA-256 of a token is kept, so it is shown once. What a page with it does is "
          "in 'bushctl history' by its name.")
      .word("NAME", &options->name, "Name of the token (default: that of this user)")
      .number<std::uint32_t>("--days", &options->days, 1, kMaxDays, "How long it is valid")
      .flag("--list", &options->list, "List the tokens, and make none")
      .option("--revoke", &options->revoke, "Remove the token of this name, and make none")
      .file(
          "--file", &options->file,
          fmt::format("File of tokens (default: $BUSHD_WEB_TOKENS, else {})", tokens::kSystemFile))
      .flag("--json", &options->json, "Print JSON")
      .run([options] { return web_token(*options); });
}

}  // namespace bushctl
