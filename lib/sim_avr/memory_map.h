// What lies where in the RAM of an image for AVR, and which of its source files may write there.
// Read from the ELF's symbols and line numbers (avr-objdump) and from the port's file of owners, of
// lines
//
//     OBJECT  FILE...      # comment
//
// OBJECT is a symbol; FILE ends the path of a source file, `*` is all of them. A symbol inside of
// another one stands for its own part. Objects that are not named belong to the file that defines
// them. What is no object belongs to nobody.
#pragma once

#include <gelf.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace bushd::sim {

class AvrMemoryMap {
 public:
  // Source files by number; code without line numbers (avr-libc, libgcc) is of none.
  using Unit = std::uint8_t;
  static constexpr Unit kNoUnit = 0;

  struct Object {
    std::string name;
    std::uint16_t address;
    std::uint16_t size;
    std::uint64_t writers;  // bit per unit
  };

  // Throws std::runtime_error, with file, line and cause.
  AvrMemoryMap(const std::string& image, const std::string& owners);

  // Whose code is at this address of the flash.
  Unit unit_at(std::uint32_t pc) const { return pc / 2 < unit_at_.size() ? unit_at_[pc / 2] : 0; }
  const std::string& name_of(Unit unit) const { return units_[unit]; }
  // Whose path ends like this.
  Unit unit_named(const std::string& end) const;

  // The smallest object at this address of RAM, or nullptr.
  const Object* object_at(std::uint16_t address) const;
  // Throws std::out_of_range.
  const Object& object(const std::string& name) const;
  bool may_write(Unit unit, std::uint16_t address) const {
    return (writers_[address] >> unit & 1) != 0;
  }

  std::uint16_t variables_end() const { return variables_end_; }
  std::uint16_t stack_top() const { return stack_top_; }

  // FUNCTION (FILE:LINE), for people.
  std::string place_of(std::uint32_t pc) const;

 private:
  void read_units();
  void fill_units(const std::set<std::size_t>& symbols);
  void read_symbols();
  void take_symbol(const std::string& name, const GElf_Sym& symbol, const std::string& source);
  void read_owners(const std::string& path);
  std::uint64_t units_ending(const std::string& end) const;

  static constexpr std::size_t kUnits = 64;
  static constexpr std::size_t kData = 0x2200;

  std::string image_;
  std::vector<std::string> units_{"code without line numbers"};
  std::vector<Unit> unit_at_;
  std::vector<Object> objects_;
  std::map<std::string, std::string> defined_in_;  // names of local objects
  std::vector<std::int16_t> object_at_ = std::vector<std::int16_t>(kData, -1);
  std::vector<std::uint64_t> writers_ = std::vector<std::uint64_t>(kData, 0);
  std::uint16_t variables_end_ = 0;
  std::uint16_t stack_top_ = 0;
};

}  // namespace bushd::sim
