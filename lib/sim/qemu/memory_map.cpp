#include "sim/qemu/memory_map.h"

#include <cctype>
#include <sstream>
#include <stdexcept>

namespace bushd::sim {
namespace {

constexpr std::uint32_t kRam = 0x20000000;
constexpr std::uint32_t kRamSize = 0x10000;
// QEMU's watch has a bit for each.
constexpr std::size_t kMostUnits = 64;

bool in_ram(std::uint32_t address) {
  return address - kRam < kRamSize;
}

}  // namespace

QemuMemoryMap::QemuMemoryMap(const std::string& image, const std::string& owners)
    : MemoryMap(image) {
  for_lines("arm-none-eabi-nm -S -l " + quoted(image),
            [this](const std::string& line) { take_symbol(line); });
  if (main_at_ == 0 || stack_limit_ == 0 || stack_end_ == 0 || units() < 2) {
    throw std::runtime_error(image + ": arm-none-eabi-nm finds no symbols with line numbers");
  }
  if (units() > kMostUnits) throw std::runtime_error(image + ": has too many source files");
  add({"stack", stack_limit_, stack_end_ - stack_limit_, ~std::uint64_t{0}});
  read_owners(owners);
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
  const Unit unit = file.starts_with(".") ? unit_of(file) : kNoUnit;
  if (type == 't') {
    if (name == "main") main_at_ = address & ~1u;
    functions_[name] = address & ~1u;
    if (unit != kNoUnit) codes_.push_back({address & ~1u, size, unit});
    // Code in RAM is read, and not written.
    if (in_ram(address)) add({name, address & ~1u, size, 0});
  } else if (in_ram(address)) {
    add({name, address, size, Units(unit != kNoUnit ? 1 : 0) << unit});
  }
}

std::string QemuMemoryMap::place_of(std::uint32_t pc) const {
  auto place = code_place("arm-none-eabi-addr2line", image(), pc);
  if (!place) return hex(pc, 8);
  place->line.erase(0, place->line.find_first_not_of("./"));
  std::string unit = "a library";
  for (const Code& code : codes_) {
    if (pc - code.address < code.size) unit = name_of(code.unit);
  }
  return place->function + " (" + place->line + ", in " + unit + " at " + hex(pc, 8) + ")";
}

std::string QemuMemoryMap::thing_at(std::uint32_t address) const {
  const Object* innermost = nullptr;
  for (const Object& object : objects()) {
    if (address - object.address < object.size) innermost = &object;
  }
  if (innermost != nullptr) {
    return innermost->name + "+" + std::to_string(address - innermost->address);
  }
  if (in_ram(address) && address < stack_limit_ && address >= stack_limit_ - 4096) {
    return hex(address, 8) + ", below the stack's bound";
  }
  const Object* before = nullptr;
  for (const Object& object : objects()) {
    if (object.address <= address) before = &object;
  }
  if (!in_ram(address) || before == nullptr) return hex(address, 8);
  return hex(address, 8) + ", " + std::to_string(address - before->address - before->size + 1) +
         " bytes beyond " + before->name;
}

}  // namespace bushd::sim
