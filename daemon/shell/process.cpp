#include "daemon/shell/process.h"

#include <sys/resource.h>

#include <chrono>
#include <random>

namespace bushd::daemon {

std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::int64_t cpu_us() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return (usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) * 1'000'000 + usage.ru_utime.tv_usec +
         usage.ru_stime.tv_usec;
}

std::int64_t unix_time_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::int64_t new_run() {
  std::random_device random;
  const std::uint64_t number = std::uint64_t{random()} << 32 | random();
  return static_cast<std::int64_t>(number >> 1 | 1u);
}

std::uint16_t master_number(std::int64_t run) {
  return static_cast<std::uint16_t>(static_cast<std::uint64_t>(run) * 0x9E3779B97F4A7C15u >> 48);
}

}  // namespace bushd::daemon
