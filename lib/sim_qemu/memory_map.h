// What lies where in an image for LM3S6965, whose code is where, and which source files may write
// which object of its RAM. Read from the ELF's symbols and line numbers (arm-none-eabi-nm) and from
// the port's file of owners, of lines
//
//     OBJECT  FILE...      # comment
//
// OBJECT is a symbol; FILE ends the path of a source file, `*` is all of them. A symbol inside of
// another one stands for its own part. Objects that are not named belong to the file that defines
// them. What is no object belongs to nobody.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace bushd::sim {

class QemuMemoryMap {
 public:
  struct Code {
    std::uint32_t address;
    std::uint32_t size;
    std::uint8_t unit;  // source file by number, from 1 on
  };
  struct Object {
    std::string name;
    std::uint32_t address;
    std::uint32_t size;
    std::uint64_t writers;  // bit per unit
  };

  // Throws std::runtime_error.
  QemuMemoryMap(const std::string& image, const std::string& owners);

  const std::vector<Code>& codes() const { return codes_; }
  // Parts stand behind what they are parts of.
  const std::vector<Object>& objects() const { return objects_; }
  std::uint32_t main_at() const { return main_at_; }
  // Throws std::out_of_range.
  const Object& object(const std::string& name) const;
  std::uint32_t function(const std::string& name) const { return functions_.at(name); }

  // For people.
  std::string place_of(std::uint32_t pc) const;       // FUNCTION (FILE:LINE)
  std::string thing_at(std::uint32_t address) const;  // OBJECT+OFFSET, or what else is there

 private:
  void read_symbols();
  void take_symbol(const std::string& line);
  void read_owners(const std::string& path);
  std::uint8_t unit_of(const std::string& file);
  std::uint64_t units_ending(const std::string& end) const;

  std::string image_;
  std::vector<std::string> units_{""};
  std::vector<Code> codes_;
  std::vector<Object> objects_;
  std::map<std::string, std::uint32_t> functions_;
  std::uint32_t main_at_ = 0;
  std::uint32_t stack_limit_ = 0;
  std::uint32_t stack_end_ = 0;
};

}  // namespace bushd::sim
