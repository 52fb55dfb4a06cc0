#include "tables/bushd/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/table.h"
#include "tables/rounding.h"

namespace bushd::tables::image {
namespace {

constexpr std::size_t kFirstCode = 2;
constexpr std::size_t kFirstPosition = 240;
constexpr std::uint16_t kSlowest = 250;
constexpr std::uint16_t kFastest = 10;
constexpr double kMinStartHz = 1;
constexpr double kMaxStartHz = 100;
constexpr double kNoise = 1e-6;
constexpr std::size_t kBushd1Codes = 4;
// BUSHD-1 can time steps of 50 us .. 1.5 s.
constexpr double kBushd1MinStepS = 50e-6;
constexpr double kBushd1MaxStepS = 1.5;

std::uint16_t cruise_of(const TableContent& content) {
  return content.cruise.value_or(content.accel.back());
}

bool is_symmetric(const TableContent& content) {
  return !content.decel || std::equal(content.decel->rbegin(), content.decel->rend(),
                                      content.accel.begin(), content.accel.end());
}

tl::unexpected<Error> asymmetric() {
  return fail(
      "has two different sides; BUSHD-2 brakes with the codes of its acceleration. Make them "
      "mirror each other");
}

}  // namespace

Program read_page(const Page& page) {
  Program program{.steps = page[0] + 256U * page[1]};
  program.codes.assign(page.begin() + kFirstCode, page.begin() + kFirstPosition);
  std::copy(page.begin() + kFirstPosition, page.end(), program.positions.begin());
  return program;
}

Page write_page(const Program& program) {
  Page page{};
  page[0] = static_cast<std::uint8_t>(program.steps & 0xFF);
  page[1] = static_cast<std::uint8_t>(program.steps >> 8);
  std::copy(program.codes.begin(), program.codes.end(), page.begin() + kFirstCode);
  std::copy(program.positions.begin(), program.positions.end(), page.begin() + kFirstPosition);
  return page;
}

Result<double> start_hz_of(const TableContent& content) {
  const double hz = 1e9 / (static_cast<double>(kSlowest) * content.time_unit_ns);
  // Both ends are whole numbers of ns, so nothing is rounded there.
  if (hz >= kMinStartHz && hz <= kMaxStartHz) return hz;
  return fail(
      fmt::format("code 250 of {} ns is F_start = {:.6g} Hz; BUSHD-2 has 1..100 Hz, a "
                  "time_unit_ns of 40000..4000000",
                  content.time_unit_ns, hz));
}

Result<std::vector<std::uint8_t>> codes_of(const TableContent& content) {
  if (const auto hz = start_hz_of(content); !hz) return fail(hz.error());
  if (!is_symmetric(content)) return asymmetric();
  if (content.accel.size() > kCodes) {
    return fail(
        fmt::format("has {} codes; a page of BUSHD-2 holds {}. --resample cuts the top speed",
                    content.accel.size(), kCodes));
  }
  const auto bad = std::find_if(content.accel.begin(), content.accel.end(), [](std::uint16_t code) {
    return code > kSlowest || code < kFastest;
  });
  if (bad != content.accel.end()) {
    return fail(
        fmt::format("accel[{}] is {}; BUSHD-2 has codes of 8 bits, 10 (25 F_start) .. 250 "
                    "(F_start). --resample rounds up",
                    bad - content.accel.begin(), *bad));
  }
  if (cruise_of(content) != content.accel.back()) {
    return fail(
        fmt::format("cruises at code {} after {}; BUSHD-2 goes on with its last code. "
                    "--resample sets it",
                    cruise_of(content), content.accel.back()));
  }
  std::vector<std::uint8_t> codes(content.accel.begin(), content.accel.end());
  codes.resize(kCodes, codes.back());
  return codes;
}

Result<TableContent> table_of(const std::vector<std::uint8_t>& codes, double start_hz) {
  if (!(start_hz >= kMinStartHz && start_hz <= kMaxStartHz)) {
    return fail(fmt::format("F_start = {:.6g} Hz; allowed: 1..100 Hz", start_hz));
  }
  TableContent content{.name = "page"};
  content.time_unit_ns = static_cast<std::uint32_t>(rounded_up_units(1e9 / (kSlowest * start_hz)));
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const bool rises = i > 0 && codes[i] > codes[i - 1];
    if (codes[i] < kFastest || codes[i] > kSlowest || rises) {
      return fail(fmt::format(
          "code {} of the page, at its byte {}, is {}{}; allowed: 10..250, never "
          "rising. Is there a program in this page?",
          i, i + kFirstCode, codes[i], rises ? fmt::format(" after {}", codes[i - 1]) : ""));
    }
    content.accel.push_back(codes[i]);
  }
  while (content.accel.size() > 1 &&
         content.accel.back() == content.accel[content.accel.size() - 2]) {
    content.accel.pop_back();
  }
  return content;
}

Result<Resampled> resample(const TableContent& content) {
  if (!is_symmetric(content)) return asymmetric();
  const double unit_ns = content.time_unit_ns;
  const double slowest_ns = content.accel.front() * unit_ns;
  // The finest unit in which the start still fits, and F_start is one that the hardware has.
  const double new_unit_ns =
      std::max(1e9 / (kSlowest * kMaxStartHz), std::ceil(slowest_ns / kSlowest));
  if (new_unit_ns > 1e9 / (kSlowest * kMinStartHz)) {
    return fail(fmt::format("starts at {:.6g} steps/s; BUSHD-2 starts at 1 Hz or faster",
                            1e9 / slowest_ns));
  }
  Resampled out{.content = {.name = content.name, .description = content.description}};
  out.content.time_unit_ns = static_cast<std::uint32_t>(new_unit_ns);
  out.top_hz_before = 1e9 / (cruise_of(content) * unit_ns);
  for (std::size_t i = 0; i < kCodes && i <= content.accel.size(); ++i) {
    const std::uint16_t old = std::max(
        cruise_of(content), i < content.accel.size() ? content.accel[i] : cruise_of(content));
    const double exact = old * unit_ns / new_unit_ns;
    const double code = std::max<double>(kFastest, rounded_up_units(exact));
    if (i == content.accel.size() && code == out.content.accel.back()) break;
    out.content.accel.push_back(static_cast<std::uint16_t>(code));
    out.worst_speed_error = std::max(out.worst_speed_error, 1 - exact / code);
  }
  out.top_hz_after = 1e9 / (out.content.accel.back() * new_unit_ns);
  return out;
}

Result<Travel> travel_of(const TableContent& content, std::uint32_t steps,
                         std::uint32_t reactor_delay) {
  if (steps < 1 || steps > kBushd1MaxSteps) {
    return fail(fmt::format("{} steps; BUSHD-1 travels 1..{}", steps, kBushd1MaxSteps));
  }
  if (reactor_delay > 0xFFFF) return fail("the delay from reactor start has 16 bits: 0..65535");
  const auto table = make(content);
  if (!table) return fail(table.error());
  Travel travel{.reactor_delay = reactor_delay};
  for (std::uint32_t j = 1; j <= steps; ++j) {
    const std::uint16_t delay = bushd_table_delay(&(*table)->view(), j, steps);
    const double delay_s = delay * 1e-9 * content.time_unit_ns;
    if (delay > 255) {
      return fail(
          fmt::format("the delay before step {} is {} units; BUSHD-1 has codes of 8 bits. Use a "
                      "longer time unit (\"bushtab resample --time-unit\")",
                      j, delay));
    }
    if (delay_s < kBushd1MinStepS * (1 - kNoise) || delay_s > kBushd1MaxStepS * (1 + kNoise)) {
      return fail(fmt::format("the delay before step {} is {:.6g} s; BUSHD-1 has 50 us .. 1.5 s", j,
                              delay_s));
    }
    travel.codes.push_back(static_cast<std::uint8_t>(delay));
  }
  return travel;
}

std::vector<std::uint8_t> write_travel(const Travel& travel) {
  std::vector<std::uint8_t> bytes(kBushd1Codes + travel.codes.size());
  bytes[0] = static_cast<std::uint8_t>(travel.codes.size());
  bytes[2] = static_cast<std::uint8_t>(travel.reactor_delay & 0xFF);
  bytes[3] = static_cast<std::uint8_t>(travel.reactor_delay >> 8);
  std::copy(travel.codes.begin(), travel.codes.end(), bytes.begin() + kBushd1Codes);
  return bytes;
}

Result<Travel> read_travel(const std::vector<std::uint8_t>& bytes) {
  const std::size_t steps = bytes.empty() ? 0 : bytes[0];
  if (steps < 1 || steps > kBushd1MaxSteps || bytes.size() < kBushd1Codes + steps) {
    return fail(
        fmt::format("byte 0 says {} steps and there are {} bytes; allowed: 1..{} steps and a "
                    "code for each from byte 4 on",
                    steps, bytes.size(), kBushd1MaxSteps));
  }
  if (bytes[1] != 0) return fail("byte 1 is not 0: this is no memory of BUSHD-1");
  Travel travel{.reactor_delay = bytes[2] + 256U * bytes[3]};
  travel.codes.assign(bytes.begin() + kBushd1Codes,
                      bytes.begin() + static_cast<std::ptrdiff_t>(kBushd1Codes + steps));
  return travel;
}

Result<TableContent> table_of(const Travel& travel, std::uint32_t time_unit_ns) {
  const std::vector<std::uint8_t>& codes = travel.codes;
  const auto fastest = std::min_element(codes.begin(), codes.end());
  const auto turn = fastest + 1;
  TableContent content{.name = "travel", .time_unit_ns = time_unit_ns};
  content.accel.assign(codes.begin(), turn);
  // A travel that only speeds up still needs an end; its last delay is one.
  std::vector<std::uint16_t> decel(turn == codes.end() ? fastest : turn, codes.end());
  if (!std::equal(decel.rbegin(), decel.rend(), content.accel.begin(), content.accel.end())) {
    content.decel = std::move(decel);
  }
  if (const auto fault = check(content)) {
    return fail(
        fmt::format("the codes of the travel are not those of a table, which gets faster and "
                    "then slower: {} {}",
                    fault->key, fault->message));
  }
  return content;
}

}  // namespace bushd::tables::image
