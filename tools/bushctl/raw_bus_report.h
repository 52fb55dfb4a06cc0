// What was found out on a bus, as people and programs read it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/message.h"

namespace bushctl {

// Latencies of answers: round trip without the time of the bytes.
struct LatencyTest {
  std::string port;
  std::uint32_t baud = 0;
  unsigned asked = 0;
  std::vector<std::int64_t> latencies_us;  // of the answers, sorted; not empty
};
std::vector<std::string> latency_lines(const LatencyTest& test);
std::string latency_json(const LatencyTest& test);
// What could be better, or "".
std::string latency_advice(const LatencyTest& test);

struct Found {
  std::uint8_t address = 0;
  bushd_identity identity{};
};
// By address; then what is wrong with them.
std::vector<std::string> scan_lines(std::vector<Found> found);
std::string scan_json(std::vector<Found> found);

}  // namespace bushctl
