// What lies where in the RAM of an image, and which of its source files may write there. Each
// simulator reads the objects and the source files from its kind of ELF (sim/avr/memory_map.h,
// sim/qemu/memory_map.h), and who may write what from the port's file of owners, of lines
//
//     OBJECT  FILE...      # comment
//
// OBJECT is a symbol; FILE ends the path of a source file, `*` is all of them. A symbol inside of
// another one stands for its own part. An object that is named without a file is nobody's; one that
// is not named belongs to the file that defines it. What is no object belongs to nobody.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace bushd::sim {

class MemoryMap {
 public:
  // Source files by number; code without line numbers (of libraries) is of none.
  using Unit = std::uint8_t;
  static constexpr Unit kNoUnit = 0;
  static constexpr std::size_t kMaxUnits = 128;
  using Units = std::bitset<kMaxUnits>;

  struct Object {
    std::string name;
    std::uint32_t address;
    std::uint32_t size;
    Units writers;
  };

  const std::string& name_of(Unit unit) const { return units_[unit]; }
  // Whose path ends like this. Throws std::out_of_range.
  Unit unit_named(const std::string& end) const;

  // By address; parts stand behind what they are parts of.
  const std::vector<Object>& objects() const { return objects_; }
  // Throws std::out_of_range.
  const Object& object(const std::string& name) const;

 protected:
  explicit MemoryMap(std::string image) : image_(std::move(image)) {}

  const std::string& image() const { return image_; }
  // The number of a source file, with or without "../" before its path.
  Unit unit_of(std::string file);
  std::size_t units() const { return units_.size(); }
  Units units_ending(const std::string& end) const;
  void add(Object object) { objects_.push_back(std::move(object)); }
  // When all objects are added. Returns the names that are in the file. Throws std::runtime_error,
  // with file, line and cause.
  std::set<std::string> read_owners(const std::string& path);
  // Who may write an object that is not in the file of owners.
  void set_writers(std::size_t object, Units units) { objects_[object].writers = units; }

 private:
  std::string image_;
  std::vector<std::string> units_{"code without line numbers"};
  std::vector<Object> objects_;
};

// The lines that a command prints, in a shell. Throws std::runtime_error.
void for_lines(const std::string& command, const std::function<void(const std::string&)>& take);
// For a shell; without quotes in it.
std::string quoted(const std::string& path);

// 0x00ff with 4 digits.
std::string hex(std::uint32_t value, int digits);

struct CodePlace {
  std::string function;
  std::string line;
};
// Where the code at `pc` comes from, as this tool says; nothing if it cannot be run.
std::optional<CodePlace> code_place(const std::string& addr2line, const std::string& image,
                                    std::uint32_t pc);

// The map of an image and its owners; each is read once.
template <typename Map>
std::shared_ptr<const Map> map_of(const std::string& image, const std::string& owners) {
  static std::map<std::pair<std::string, std::string>, std::shared_ptr<const Map>> maps;
  auto& map = maps[{image, owners}];
  if (!map) map = std::make_shared<const Map>(image, owners);
  return map;
}

}  // namespace bushd::sim
