// Clients that put programs into MCUs, run them and erase them. The programs of one MCU have one
// name and the same motors, whatever they do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "config/config.h"
#include "mcu_program.h"
#include "request.h"
#include "sim/random.h"

namespace bushfaults {

// Every second MCU may go on with its program when no host is heard.
void allow_mcu_programs(bushd::config::Config& config, std::uint64_t seed);

class McuPrograms {
 public:
  // `config` outlives it.
  McuPrograms(const bushd::config::Config& config, std::uint64_t seed);

  // What one of them asks next.
  Request next();

 private:
  struct OfMcu {
    std::vector<std::string> motors{};
    std::string name{};
    bool without_host = false;  // is allowed
  };
  McuProgram made(const OfMcu& mcu);
  McuProgram::Frame motion(std::size_t motors, bool of_line);
  Request run();

  std::vector<OfMcu> mcus_;
  bushd::sim::Random random_;
};

}  // namespace bushfaults
