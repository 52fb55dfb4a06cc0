#include "raw_bus_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "bus/rs485/health.h"
#include "bus/rs485/unique_id.h"
#include "grid.h"

namespace bushctl {
namespace {

using bushd::link::unique_id_text;

// The timer of an FTDI adapter as it is delivered; answers that it holds back lie around it.
constexpr std::int64_t kHeldFromUs = 10'000;
constexpr std::int64_t kHeldToUs = 20'000;
constexpr std::int64_t kGoodUs = 2'000;

std::int64_t percentile(const LatencyTest& test, unsigned percent) {
  const std::size_t last = test.latencies_us.size() - 1;
  return test.latencies_us[(last * percent + 99) / 100];
}

bushd::link::Latency histogram(const LatencyTest& test) {
  bushd::link::Latency latency;
  for (const std::int64_t us : test.latencies_us) latency.add(us);
  return latency;
}

std::string ms(std::int64_t us) {
  return fmt::format("{:.2f} ms", static_cast<double>(us) / 1000);
}

void sort_by_address(std::vector<Found>& found) {
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return std::pair(a.address, unique_id_text(a.identity)) <
           std::pair(b.address, unique_id_text(b.identity));
  });
}

// Unique ids by address, of addresses that several MCUs have.
std::map<int, std::vector<std::string>> doubled(const std::vector<Found>& found) {
  std::map<int, std::vector<std::string>> ids;
  for (const Found& mcu : found) ids[mcu.address].push_back(unique_id_text(mcu.identity));
  std::erase_if(ids, [](const auto& entry) { return entry.second.size() < 2; });
  return ids;
}

bool speaks_ours(const bushd_identity& identity) {
  return identity.protocol_version == BUSHD_PROTOCOL_VERSION;
}

}  // namespace

std::string latency_advice(const LatencyTest& test) {
  if (test.latencies_us.size() < test.asked) {
    return fmt::format(
        "{} of {} requests were not answered: look at cables, termination and baud "
        "rate",
        test.asked - test.latencies_us.size(), test.asked);
  }
  const std::int64_t median = percentile(test, 50);
  if (median >= kHeldFromUs && median < kHeldToUs) {
    return "answers are held back for some 16 ms, as FTDI adapters do: set the adapter's "
           "latency_timer to 1 (docs/troubleshooting.md, Serial port)";
  }
  if (percentile(test, 99) >= kGoodUs) {
    return "late: repairs and stops take longer by this; an adapter with a latency of 1 ms is "
           "better, or a PC with less load";
  }
  return {};
}

std::vector<std::string> latency_lines(const LatencyTest& test) {
  std::vector<std::string> out = {fmt::format(
      "{} at {} baud: {} requests, {} answers; round trip without the time of the bytes: min {}, "
      "median "
      "{}, 99 % {}, max {}",
      test.port, test.baud, test.asked, test.latencies_us.size(), ms(test.latencies_us.front()),
      ms(percentile(test, 50)), ms(percentile(test, 99)), ms(test.latencies_us.back()))};
  constexpr std::size_t kBar = 50;
  const bushd::link::Latency latency = histogram(test);
  for (std::size_t i = 0; i < latency.count.size(); ++i) {
    const bool last = i == bushd::link::Latency::kBoundsUs.size();
    const std::string label =
        last
            ? "more"
            : fmt::format("<{} ms", static_cast<double>(bushd::link::Latency::kBoundsUs[i]) / 1000);
    const std::size_t bar =
        (latency.count[i] * kBar + test.latencies_us.size() - 1) / test.latencies_us.size();
    out.push_back(fmt::format("{:>8} {:>6}{}{}", label, latency.count[i], bar == 0 ? "" : " ",
                              std::string(bar, '#')));
  }
  if (const std::string advice = latency_advice(test); !advice.empty()) out.push_back(advice);
  return out;
}

std::string latency_json(const LatencyTest& test) {
  nlohmann::json out = {{"port", test.port},
                        {"baud", test.baud},
                        {"asked", test.asked},
                        {"answered", test.latencies_us.size()},
                        {"min_us", test.latencies_us.front()},
                        {"median_us", percentile(test, 50)},
                        {"p99_us", percentile(test, 99)},
                        {"max_us", test.latencies_us.back()},
                        {"advice", latency_advice(test)},
                        {"latency", nlohmann::json::array()}};
  const bushd::link::Latency latency = histogram(test);
  for (std::size_t i = 0; i < latency.count.size(); ++i) {
    nlohmann::json column = {{"below_us", nullptr}, {"answers", latency.count[i]}};
    if (i < bushd::link::Latency::kBoundsUs.size()) {
      column["below_us"] = bushd::link::Latency::kBoundsUs[i];
    }
    out["latency"].push_back(column);
  }
  return bushd::json_text(out);
}

std::vector<std::string> scan_lines(std::vector<Found> found) {
  using enum Align;
  sort_by_address(found);
  Grid grid({kLeft, kRight, kRight, kRight, kRight});
  grid.row({"UNIQUE ID", "ADDRESS", "FIRMWARE", "BOOT", "MOTORS"});
  std::vector<std::string> notes;
  for (const auto& [address, mcu] : found) {
    if (!speaks_ours(mcu)) {
      notes.push_back(fmt::format(
          "address {}: an MCU speaks protocol version {}, this program version {}: update the "
          "older of the two",
          address, mcu.protocol_version, BUSHD_PROTOCOL_VERSION));
      continue;
    }
    grid.row({unique_id_text(mcu), fmt::to_string(address), fmt::to_string(mcu.firmware_version),
              fmt::to_string(mcu.boot_number), fmt::to_string(mcu.motors)});
  }
  for (const auto& [address, ids] : doubled(found)) {
    notes.push_back(
        fmt::format("address {} is that of {} MCUs ({}): give all but one another, with "
                    "'bushctl address PORT UNIQUE_ID NEW --baud B'",
                    address, ids.size(), fmt::join(ids, ", ")));
  }
  std::vector<std::string> out = grid.lines();
  out.insert(out.end(), notes.begin(), notes.end());
  return out;
}

std::string scan_json(std::vector<Found> found) {
  sort_by_address(found);
  nlohmann::json out = {{"mcus", nlohmann::json::array()},
                        {"doubled_addresses", nlohmann::json::array()}};
  for (const auto& [address, mcu] : found) {
    nlohmann::json entry = {{"address", address}, {"protocol_version", mcu.protocol_version}};
    if (speaks_ours(mcu)) {
      entry["unique_id"] = unique_id_text(mcu);
      entry["firmware_version"] = mcu.firmware_version;
      entry["boot"] = mcu.boot_number;
      entry["motors"] = mcu.motors;
    }
    out["mcus"].push_back(entry);
  }
  for (const auto& [address, ids] : doubled(found)) out["doubled_addresses"].push_back(address);
  return bushd::json_text(out);
}

}  // namespace bushctl
