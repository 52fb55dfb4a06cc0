// camac: cycles of a CAMAC crate, and the memory of a module as a whole.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "base/parse_number.h"
#include "base/printable.h"
#include "commands.h"
#include "tables/table_text.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
namespace camac = bushd::camac;
using bushd::fail;
using bushd::Result;
using bushd::client::Client;
using bushd::client::detail_of;
using nlohmann::ordered_json;

// The memory of a BUSHD-2 (docs/camac.md).
constexpr std::uint32_t kPageBytes = 256;
constexpr std::uint32_t kCodes = 238;
constexpr std::uint32_t kFirstCode = 2;
constexpr std::uint32_t kLastPage = 3;
constexpr std::uint32_t kMostCode = 255;
constexpr std::uint32_t kUnitNsAt1Hz = 4'000'000;  // 250 of them are 1 s
constexpr std::size_t kLineBytes = 16;

constexpr int kRead = 0;
constexpr int kWrite = 16;
constexpr int kMemory = 0;
constexpr int kAddress = 1;

struct CamacOptions {
  std::vector<std::string> words;
  std::uint32_t crate = 1;
  std::string page;         // to dump as a table; "": all memory
  std::uint32_t steps = 0;  // as they are
  std::uint32_t f_start_hz = 40;
  bool json = false;
};

Result<std::uint32_t> number_of(const std::string& word, std::uint32_t most) {
  const bool hex = word.starts_with("0x");
  const auto digits = std::string_view(word).substr(hex ? 2 : 0);
  const auto value = bushd::parse_number<std::uint32_t>(digits, hex ? 16 : 10);
  if (value && *value <= most) return *value;
  return fail(fmt::format("{} is no number 0..{}", bushd::printable(word), most));
}

// The numbers that stand there, each up to its greatest value.
Result<std::vector<int>> numbers_of(const std::vector<std::string>& words,
                                    const std::vector<std::uint32_t>& most) {
  std::vector<int> numbers;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto number = number_of(words[i], most[i]);
    if (!number) return fail(number.error());
    numbers.push_back(static_cast<int>(*number));
  }
  return numbers;
}

// A client's end of a crate. An answer that fails is told, and makes exit_code().
class Crate {
 public:
  Crate(Client& client, std::uint32_t number) : client_(client), number_(number) {}

  std::optional<api::CamacResult> run(camac::Block block) {
    const auto result = ask<api::CamacResult>(
        client_,
        api::Camac{.crate = static_cast<std::int32_t>(number_), .block = std::move(block)});
    if (result) return *result;
    exit_code_ = result.error();
    return std::nullopt;
  }
  std::optional<camac::Response> cycle(const camac::Naf& naf) {
    const auto result = run({.cycles = {naf}});
    if (!result || result->block.responses.empty()) return std::nullopt;
    if (result->block.responses.front().x) return result->block.responses.front();
    fmt::print(stderr, "bushctl: station {} does not accept A{} F{} (X = 0)\n", naf.station,
               naf.subaddress, naf.function);
    return std::nullopt;
  }
  int exit_code() const { return exit_code_; }

 private:
  Client& client_;
  std::uint32_t number_;
  int exit_code_ = kFailed;
};

int run_cycle(Client& client, const CamacOptions& options, const camac::Naf& naf) {
  Crate crate(client, options.crate);
  const auto result = crate.run({.cycles = {naf}});
  if (!result || result->block.responses.empty()) return crate.exit_code();
  const auto& [x, q, data] = result->block.responses.front();
  const bool lam = naf.station > camac::kStations
                       ? result->requests != 0
                       : (result->requests >> (naf.station - 1) & 1) != 0;
  if (options.json) {
    const ordered_json json = {{"x", x}, {"q", q}, {"data", data}, {"lam", lam}};
    fmt::print("{}\n", bushd::json_text(json));
  } else {
    fmt::print("X={:d} Q={:d} data {} (0x{:06x}){}\n", x, q, data, data, lam ? ", LAM" : "");
  }
  return kDone;
}

// All of it, by a block of words. LAM makes Q of each 0, so Q is not asked for. The address
// register is put back.
std::optional<std::vector<std::uint32_t>> read_memory(Crate& crate, int station) {
  const auto before = crate.cycle({station, kAddress, kRead});
  if (!before || !crate.cycle({station, kAddress, kWrite, camac::kDataMask})) return std::nullopt;
  const auto last = crate.cycle({station, kAddress, kRead});
  if (!last || !crate.cycle({station, kAddress, kWrite, 0})) return std::nullopt;
  camac::Block block{.count = last->data + 1};
  block.cycles.assign(block.count, {station, kMemory, kRead});
  const auto read = crate.run(block);
  if (!read || !crate.cycle({station, kAddress, kWrite, before->data})) return std::nullopt;
  std::vector<std::uint32_t> bytes;
  for (const camac::Response& response : read->block.responses) bytes.push_back(response.data);
  return bytes;
}

int print_table(const CamacOptions& options, int station, const std::vector<std::uint32_t>& bytes) {
  const auto page = number_of(options.page, kLastPage);
  if (!page) return wrong_usage(page.error());
  const std::size_t first = *page * kPageBytes + kFirstCode;
  if (first + kCodes > bytes.size()) {
    fmt::print(stderr, "bushctl: station {} has no page {}\n", station, *page);
    return kFailed;
  }
  bushd::tables::TableContent table{
      .name = fmt::format("camac-{}-{}-{}", options.crate, station, *page),
      .time_unit_ns = kUnitNsAt1Hz / options.f_start_hz};
  for (std::size_t i = first; i < first + kCodes; ++i) {
    table.accel.push_back(static_cast<std::uint16_t>(std::max(bytes[i], 1U)));
  }
  if (const auto fault = bushd::tables::check(table)) {
    fmt::print(stderr, "bushctl: the codes of page {} are no table: {}: {}\n", *page, fault->key,
               fault->message);
    return kFailed;
  }
  fmt::print("{}", bushd::tables::to_text(table));
  return kDone;
}

int dump(Client& client, const CamacOptions& options, int station) {
  Crate crate(client, options.crate);
  const auto bytes = read_memory(crate, station);
  if (!bytes) return crate.exit_code();
  if (!options.page.empty()) return print_table(options, station, *bytes);
  if (options.json) {
    const ordered_json json = {{"station", station}, {"memory", *bytes}};
    fmt::print("{}\n", bushd::json_text(json));
    return kDone;
  }
  for (std::size_t i = 0; i < bytes->size(); i += kLineBytes) {
    const auto line = std::span(*bytes).subspan(i, kLineBytes);
    fmt::print("{:4}  {:3}\n", i, fmt::join(line, " "));
  }
  return kDone;
}

// The codes of a table, as a program has them: up to 238, then the last one again.
Result<std::vector<std::uint32_t>> codes_of(const bushd::tables::TableContent& table) {
  if (table.decel) return fail("has a decelerating side of its own; a program has one side");
  if (table.accel.empty() || table.accel.size() > kCodes) {
    return fail(fmt::format("has {} codes; a program has 1..{}", table.accel.size(), kCodes));
  }
  if (table.cruise && *table.cruise != table.accel.back()) {
    return fail("has a cruise delay of its own; a program cruises at its last code");
  }
  std::vector<std::uint32_t> codes(table.accel.begin(), table.accel.end());
  const std::uint32_t greatest = std::ranges::max(codes);
  if (greatest > kMostCode) {
    return fail(fmt::format("has code {}; codes of a program are 1..{}", greatest, kMostCode));
  }
  codes.resize(kCodes, codes.back());
  return codes;
}

Result<std::vector<std::uint32_t>> codes_of(Client& client, const std::string& name) {
  const auto reply = client.run(api::GetTable{name}, Client::Until::kResult);
  if (!reply) return fail(reply.error());
  if (const auto* none = std::get_if<api::Refused>(&*reply)) return fail(none->reason);
  const auto* table = detail_of<api::TableFile>(reply);
  if (table == nullptr) return fail("the daemon's answer brings no table");
  auto codes = codes_of(table->content);
  if (!codes) return fail("table " + name + " " + codes.error().message);
  return codes;
}

int load(Client& client, const CamacOptions& options, int station, int page,
         const std::string& name) {
  const auto codes = codes_of(client, name);
  if (!codes) return failed({.message = codes.error().message});
  Crate crate(client, options.crate);
  const std::uint32_t start = static_cast<std::uint32_t>(page) * kPageBytes;
  camac::Block block;
  const auto write = [&](int a, std::uint32_t data) {
    block.cycles.push_back({station, a, kWrite, data});
  };
  if (options.steps > 0) {
    write(kAddress, start);
    write(kMemory, options.steps & 0xFF);
    write(kMemory, options.steps >> 8);
  }
  write(kAddress, start + kFirstCode);
  for (const std::uint32_t code : *codes) write(kMemory, code);
  block.count = static_cast<std::uint32_t>(block.cycles.size());
  const auto written = crate.run(block);
  if (!written) return crate.exit_code();
  if (std::ranges::all_of(written->block.responses, &camac::Response::x)) return kDone;
  fmt::print(stderr, "bushctl: station {} has not accepted all of it (X = 0)\n", station);
  return kFailed;
}

int run_camac(const CommandLine& commands, const CamacOptions& options) {
  const auto& words = options.words;
  const bool loads = words.front() == "load" && words.size() == 4;
  const bool dumps = words.front() == "dump" && words.size() == 2;
  if (!loads && !dumps && (words.size() < 3 || words.size() > 4)) {
    return wrong_usage(bushd::Error{
        "allowed: camac N A F [DATA], camac dump STATION, camac load STATION PAGE TABLE"});
  }
  std::vector<std::string> given = words;
  std::vector<std::uint32_t> most{31, 15, 31, camac::kDataMask};
  if (loads) given = {words[1], words[2]};
  if (loads) most = {camac::kStations, kLastPage};
  if (dumps) given = {words[1]};
  if (dumps) most = {camac::kStations};
  const auto numbers = numbers_of(given, most);
  if (!numbers) return wrong_usage(numbers.error());
  const std::vector<int>& n = *numbers;
  return with_client(commands.connection(), [&](Client& client) {
    if (loads) return load(client, options, n[0], n[1], words[3]);
    if (dumps) return dump(client, options, n[0]);
    const auto data = static_cast<std::uint32_t>(n.size() > 3 ? n[3] : 0);
    return run_cycle(client, options, {n[0], n[1], n[2], data});
  });
}

}  // namespace

void add_camac_commands(CommandLine& commands) {
  const auto options = std::make_shared<CamacOptions>();
  commands.add("camac", "Make a cycle of a CAMAC crate, or read and write a module's memory")
      .footer(
          "bushctl camac N A F [DATA]               one cycle; numbers are decimal, or "
          "hexadecimal\n"
          "                                         with 0x\n"
          "bushctl camac dump STATION               the memory of a BUSHD-1 or BUSHD-2; with "
          "--page the\n"
          "                                         codes of a program of BUSHD-2 as a table file\n"
          "bushctl camac load STATION PAGE TABLE    the codes of a table as a program of BUSHD-2, "
          "with\n"
          "                                         --steps the number of steps as well")
      .words("N", &options->words, "N A F [DATA], dump STATION, or load STATION PAGE TABLE",
             Command::Needed::kYes)
      .number("--crate", &options->crate, 1u, 62u, "Number of the crate")
      .option("--page", &options->page, "Program to dump, 0..3")
      .number("--f-start", &options->f_start_hz, 1u, 100u, "f_start_hz of the module, for --page")
      .number("--steps", &options->steps, 0u, 65535u, "Number of steps to load; 0: as it is")
      .flag("--json", &options->json, "Print JSON")
      .run([&commands, options] { return run_camac(commands, *options); });
}

}  // namespace bushctl
