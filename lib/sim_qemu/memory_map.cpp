#include "sim_qemu/memory_map.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace bushd::sim {
namespace {

constexpr std::uint32_t kRam = 0x20000000;
constexpr std::uint32_t kRamSize = 0x10000;
constexpr std::size_t kMostUnits = 64;
constexpr std::uint64_t kAll = ~std::uint64_t{0};

// What the command says.
std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  if (!pipe) throw std::runtime_error(command + ": cannot be run");
  std::string out;
  std::array<char, 4096> some;
  while (const std::size_t got = std::fread(some.data(), 1, some.size(), pipe.get())) {
    out.append(some.data(), got);
  }
  return out;
}

std::string hex(std::uint32_t value) {
  std::array<char, 16> text;
  std::snprintf(text.data(), text.size(), "0x%08x", value);
  return text.data();
}

bool in_ram(std::uint32_t address) {
  return address - kRam < kRamSize;
}

}  // namespace

QemuMemoryMap::QemuMemoryMap(const std::string& image, const std::string& owners) : image_(image) {
  read_symbols();
  if (main_at_ == 0 || stack_limit_ == 0 || stack_end_ == 0 || units_.size() < 2) {
    throw std::runtime_error(image + ": arm-none-eabi-nm finds no symbols with line numbers");
  }
  objects_.push_back({"stack", stack_limit_, stack_end_ - stack_limit_, kAll});
  // Of those that begin together the larger one is the whole.
  std::stable_sort(objects_.begin(), objects_.end(), [](const Object& a, const Object& b) {
    return a.address != b.address ? a.address < b.address : a.size > b.size;
  });
  read_owners(owners);
}

void QemuMemoryMap::read_symbols() {
  std::istringstream lines(output_of("arm-none-eabi-nm -S -l '" + image_ + "'"));
  for (std::string line; std::getline(lines, line);) take_symbol(line);
}

// ADDRESS [SIZE] TYPE NAME<tab>FILE:LINE
void QemuMemoryMap::take_symbol(const std::string& line) {
  const std::size_t tab = line.find('\t');
  std::istringstream words(line.substr(0, tab));
  std::vector<std::string> word;
  for (std::string w; words >> w;) word.push_back(w);
  if (word.size() < 3) return;
  const auto address = static_cast<std::uint32_t>(std::stoul(word[0], nullptr, 16));
  const std::string& name = word.back();
  if (name == "stack_limit") stack_limit_ = address;
  if (name == "stack_end") stack_end_ = address;
  if (word.size() < 4) return;
  const auto size = static_cast<std::uint32_t>(std::stoul(word[1], nullptr, 16));
  const std::string file =
      tab == std::string::npos ? std::string() : line.substr(tab + 1, line.rfind(':') - tab - 1);
  const char type = static_cast<char>(std::tolower(word[2][0]));
  // Ours are relative to where they were built (cmake/cortex-m.cmake); the others are libraries.
  const std::uint8_t unit = file.starts_with(".") ? unit_of(file) : std::uint8_t{0};
  if (type == 't') {
    if (name == "main") main_at_ = address & ~1u;
    functions_[name] = address & ~1u;
    if (unit != 0) codes_.push_back({address & ~1u, size, unit});
    // Code in RAM is read, and not written.
    if (in_ram(address)) objects_.push_back({name, address & ~1u, size, 0});
  } else if (in_ram(address)) {
    objects_.push_back({name, address, size, std::uint64_t{unit != 0} << unit});
  }
}

std::uint8_t QemuMemoryMap::unit_of(const std::string& file) {
  const auto found = std::find(units_.begin(), units_.end(), file);
  if (found == units_.end()) {
    if (units_.size() == kMostUnits) throw std::runtime_error(image_ + ": too many source files");
    units_.push_back(file);
    return static_cast<std::uint8_t>(units_.size() - 1);
  }
  return static_cast<std::uint8_t>(found - units_.begin());
}

std::uint64_t QemuMemoryMap::units_ending(const std::string& end) const {
  if (end == "*") return kAll;
  std::uint64_t out = 0;
  for (std::size_t unit = 1; unit < units_.size(); ++unit) {
    if (units_[unit].ends_with(end)) out |= std::uint64_t{1} << unit;
  }
  return out;
}

void QemuMemoryMap::read_owners(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::map<std::string, std::uint64_t> writers;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    std::string name;
    if (!(words >> name)) continue;
    for (std::string end; words >> end;) {
      const std::uint64_t units = units_ending(end);
      if (units == 0) {
        throw std::runtime_error(path + ":" + std::to_string(number) +
                                 ": the image has no code of " + end);
      }
      writers[name] |= units;
    }
    if (std::none_of(objects_.begin(), objects_.end(),
                     [&](const Object& object) { return object.name == name; })) {
      throw std::runtime_error(path + ":" + std::to_string(number) + ": the image has no " + name);
    }
  }
  for (Object& object : objects_) {
    const auto found = writers.find(object.name);
    if (found != writers.end()) object.writers = found->second;
  }
}

const QemuMemoryMap::Object& QemuMemoryMap::object(const std::string& name) const {
  const auto found = std::find_if(objects_.begin(), objects_.end(),
                                  [&](const Object& object) { return object.name == name; });
  if (found == objects_.end()) throw std::out_of_range(image_ + " has no " + name);
  return *found;
}

std::string QemuMemoryMap::place_of(std::uint32_t pc) const {
  std::istringstream lines(output_of("arm-none-eabi-addr2line -f -e '" + image_ + "' " + hex(pc)));
  std::string function;
  std::string line;
  std::getline(lines, function);
  std::getline(lines, line);
  line.erase(0, line.find_first_not_of("./"));
  std::string unit = "a library";
  for (const Code& code : codes_) {
    if (pc - code.address < code.size) unit = units_[code.unit];
  }
  unit.erase(0, unit.find_first_not_of("./"));
  return function + " (" + line + ", in " + unit + " at " + hex(pc) + ")";
}

std::string QemuMemoryMap::thing_at(std::uint32_t address) const {
  const Object* innermost = nullptr;
  for (const Object& object : objects_) {
    if (address - object.address < object.size) innermost = &object;
  }
  if (innermost != nullptr) {
    return innermost->name + "+" + std::to_string(address - innermost->address);
  }
  if (in_ram(address) && address < stack_limit_ && address >= stack_limit_ - 4096) {
    return hex(address) + ", below the stack's bound";
  }
  const Object* before = nullptr;
  for (const Object& object : objects_) {
    if (object.address <= address) before = &object;
  }
  if (!in_ram(address) || before == nullptr) return hex(address);
  return hex(address) + ", " + std::to_string(address - before->address - before->size + 1) +
         " bytes beyond " + before->name;
}

}  // namespace bushd::sim
