// What a process reads of the system: clocks, and numbers that are its own.
#pragma once

#include <cstdint>

namespace bushd::daemon {

// Since some time before the process began; never goes back.
std::int64_t now_us();
// Time of the CPU that the process has had.
std::int64_t cpu_us();
// Since 1970.
std::int64_t unix_time_us();

// Another one in every run, and in every process on every machine as far as 63 bits go.
std::int64_t new_run();
// By which this run is known as a master on its lines.
std::uint16_t master_number(std::int64_t run);

}  // namespace bushd::daemon
