// What lies where in the RAM of an image for AVR, and who may write there (sim/memory_map.h), from
// the ELF's symbols and line numbers.
#pragma once

#include <gelf.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sim/memory_map.h"

namespace bushd::sim {

class AvrMemoryMap : public MemoryMap {
 public:
  // Throws std::runtime_error, with file, line and cause.
  AvrMemoryMap(const std::string& image, const std::string& owners);

  // Whose code is at this address of the flash.
  Unit unit_at(std::uint32_t pc) const { return pc / 2 < unit_at_.size() ? unit_at_[pc / 2] : 0; }

  // Where this object lies in the data memory. Throws std::out_of_range.
  std::uint16_t address_of(const std::string& name) const {
    return static_cast<std::uint16_t>(object(name).address);
  }
  // The smallest object at this address of RAM, or nullptr.
  const Object* object_at(std::uint16_t address) const;
  bool may_write(Unit unit, std::uint16_t address) const { return writers_[address].test(unit); }

  std::uint16_t variables_end() const { return variables_end_; }
  std::uint16_t stack_top() const { return stack_top_; }

  // FUNCTION (FILE:LINE), for people.
  std::string place_of(std::uint32_t pc) const;

 private:
  void read_image();
  void read_units(Elf* elf);
  void fill_units(const std::set<std::size_t>& symbols);
  void read_symbols(Elf* elf);
  void take_symbol(const std::string& name, const GElf_Sym& symbol, const std::string& source);
  void assign_writers(const std::string& owners);

  static constexpr std::size_t kData = 0x4100;  // the largest of all chips

  std::vector<Unit> unit_at_;
  std::map<std::string, std::string> defined_in_;  // names of local objects
  std::vector<std::int16_t> object_at_ = std::vector<std::int16_t>(kData, -1);
  std::vector<Units> writers_ = std::vector<Units>(kData);
  std::uint16_t variables_end_ = 0;
  std::uint16_t stack_top_ = 0;
};

}  // namespace bushd::sim
