#include "raw_bus_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <optional>

#include "base/printable.h"
#include "bus/rs485/unique_id.h"
#include "bus_scan.h"
#include "commands.h"
#include "raw_bus.h"
#include "raw_bus_report.h"

namespace bushctl {
namespace {

using bushd::fail;
using bushd::Result;

constexpr unsigned kTries = 3;

bool one(const RawBus::Answers& answers) {
  return !answers.empty();
}

Result<std::vector<Found>> find_some(RawBus& bus, const RawBusOptions& options) {
  auto found = find_all(bus);
  if (found && found->empty()) {
    return fail(fmt::format("{}: no MCU answers at {} baud; check baud rate, cables and power",
                            options.port, options.baud));
  }
  return found;
}

std::optional<std::array<std::uint8_t, BUSHD_UNIQUE_ID_SIZE>> parse_id(const std::string& text) {
  std::array<std::uint8_t, BUSHD_UNIQUE_ID_SIZE> id{};
  if (text.size() != 2 * id.size() ||
      text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < id.size(); ++i) {
    id[i] = static_cast<std::uint8_t>(std::stoul(text.substr(2 * i, 2), nullptr, 16));
  }
  return id;
}

}  // namespace

int latency_test(const RawBusOptions& options, std::uint8_t address, unsigned count) {
  auto bus = RawBus::open(options.port, options.baud);
  if (!bus) return failed(bus.error());
  if (address == 0) {
    const auto found = find_some(*bus, options);
    if (!found) return failed(found.error());
    address = found->front().address;
  }
  const bushd_identify message = {.salt = 0, .windows = 1, .window_units = 0};
  std::array<std::uint8_t, 16> payload{};
  const std::size_t size = bushd_encode_identify(&message, payload.data());
  LatencyTest test{.port = options.port, .baud = options.baud, .asked = count, .latencies_us = {}};
  for (unsigned i = 0; i < count; ++i) {
    const auto answers = bus->ask(address, BUSHD_MSG_IDENTIFY, {payload.data(), size},
                                  BUSHD_IDENTITY_SIZE, kAnswerPatience, one);
    if (!answers) return failed(answers.error());
    if (!answers->empty()) test.latencies_us.push_back(answers->front().latency_us);
  }
  if (test.latencies_us.empty()) {
    return failed({.message = fmt::format("{0}: address {1} does not answer at {2} baud; "
                                          "'bushctl scan {0} --baud {2}' shows who does",
                                          options.port, address, options.baud)});
  }
  std::sort(test.latencies_us.begin(), test.latencies_us.end());
  print_lines(options.json ? std::vector{latency_json(test)} : latency_lines(test));
  return kDone;
}

int scan(const RawBusOptions& options) {
  auto bus = RawBus::open(options.port, options.baud);
  if (!bus) return failed(bus.error());
  const auto found = find_some(*bus, options);
  if (!found) return failed(found.error());
  print_lines(options.json ? std::vector{scan_json(*found)} : scan_lines(*found));
  return kDone;
}

int set_address(const RawBusOptions& options, const std::string& unique_id, std::uint8_t address) {
  const auto id = parse_id(unique_id);
  if (!id) {
    fmt::print(stderr,
               "bushctl: \"{}\" is no unique id; one has 16 hexadecimal digits, and "
               "'bushctl scan {} --baud {}' shows them\n",
               unique_id, options.port, options.baud);
    return kUsage;
  }
  auto bus = RawBus::open(options.port, options.baud);
  if (!bus) return failed(bus.error());
  // Two with one address would be worse than the wrong address.
  const auto there = find_all(*bus);
  if (!there) return failed(there.error());
  for (const Found& mcu : *there) {
    const bool itself = std::memcmp(mcu.identity.unique_id, id->data(), id->size()) == 0;
    if (mcu.address != address || itself) continue;
    return failed({.message = fmt::format("address {} is that of {} already; give that one another "
                                          "first",
                                          address, bushd::link::unique_id_text(mcu.identity))});
  }
  bushd_set_address message{.unique_id = {}, .address = address};
  std::copy(id->begin(), id->end(), message.unique_id);
  std::array<std::uint8_t, 16> payload{};
  const std::size_t size = bushd_encode_set_address(&message, payload.data());
  for (unsigned i = 0; i < kTries; ++i) {
    const auto answers = bus->ask(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SET_ADDRESS,
                                  {payload.data(), size}, 1, kAnswerPatience, one);
    if (!answers) return failed(answers.error());
    bushd_acknowledgement reply;
    if (answers->empty() ||
        bushd_decode_acknowledgement(answers->front().payload.data(),
                                     answers->front().payload.size(), &reply) != BUSHD_OK) {
      continue;
    }
    if (reply.status != BUSHD_OK) {
      return failed(
          {.message = fmt::format("{} refuses: {}", unique_id, bushd_status_text(reply.status))});
    }
    fmt::print("{}: address {}\n", unique_id, address);
    return kDone;
  }
  return failed(
      {.message = fmt::format("{}: no MCU with unique id {} answers", options.port, unique_id)});
}

}  // namespace bushctl
