// What bushctl does on a bus by itself, while no daemon has it. All return the exit code.
#pragma once

#include <cstdint>
#include <string>

namespace bushctl {

inline constexpr std::uint32_t kMaxBaud = 100'000'000;

struct RawBusOptions {
  std::string port;
  std::uint32_t baud = 0;
  bool json = false;
};

// Asks `count` times who has this address; 0: whoever answers a scan.
int latency_test(const RawBusOptions& options, std::uint8_t address, unsigned count);
int scan(const RawBusOptions& options);
// `unique_id`: 16 hexadecimal digits.
int set_address(const RawBusOptions& options, const std::string& unique_id, std::uint8_t address);

}  // namespace bushctl
