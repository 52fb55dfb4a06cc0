// What lies where in an image for LM3S6965, whose code is where, and who may write which object of
// its RAM (sim/memory_map.h), from the ELF's symbols and line numbers (arm-none-eabi-nm).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sim/memory_map.h"

namespace bushd::sim {

class QemuMemoryMap : public MemoryMap {
 public:
  struct Code {
    std::uint32_t address;
    std::uint32_t size;
    Unit unit;
  };

  // Throws std::runtime_error.
  QemuMemoryMap(const std::string& image, const std::string& owners);

  const std::vector<Code>& codes() const { return codes_; }
  std::uint32_t main_at() const { return main_at_; }
  std::uint32_t function(const std::string& name) const { return functions_.at(name); }

  // For people.
  std::string place_of(std::uint32_t pc) const;       // FUNCTION (FILE:LINE)
  std::string thing_at(std::uint32_t address) const;  // OBJECT+OFFSET, or what else is there

 private:
  void take_symbol(const std::string& line);

  std::vector<Code> codes_;
  std::map<std::string, std::uint32_t> functions_;
  std::uint32_t main_at_ = 0;
  std::uint32_t stack_limit_ = 0;
  std::uint32_t stack_end_ = 0;
};

}  // namespace bushd::sim
