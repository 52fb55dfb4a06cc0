#include "sim_avr/memory_map.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <stdexcept>

namespace bushd::sim {
namespace {

// The linker's name for addresses of RAM.
constexpr std::uint64_t kRam = 0x800000;
constexpr std::uint64_t kRamEnd = kRam + 0x10000;

}  // namespace

AvrMemoryMap::AvrMemoryMap(const std::string& image, const std::string& owners) : MemoryMap(image) {
  read_units();
  read_symbols();
  assign_writers(owners);
  for (std::size_t i = 0; i < objects().size(); ++i) {
    const Object& object = objects()[i];
    for (std::size_t at = object.address; at < std::size_t{object.address} + object.size; ++at) {
      object_at_.at(at) = static_cast<std::int16_t>(i);
      writers_.at(at) = object.writers;
    }
  }
}

// Rows are `FILE LINE 0xADDRESS`, below the compilation unit that they are of.
void AvrMemoryMap::read_units() {
  Unit unit = kNoUnit;
  for_lines("avr-objdump --dwarf=decodedline " + quoted(image()), [&](const std::string& line) {
    if (line.starts_with("CU: ")) {
      unit = unit_of(line.substr(4, line.find_last_not_of(": \r") - 3));
      return;
    }
    const std::size_t hex = line.rfind("0x");
    if (unit == kNoUnit || hex == std::string::npos) return;
    const std::size_t word = std::stoul(line.substr(hex), nullptr, 16) / 2;
    if (unit_at_.size() <= word) unit_at_.resize(word + 1, kNoUnit);
    unit_at_[word] = unit;
  });
  if (units() == 1) throw std::runtime_error(image() + ": has no line numbers");
}

// A row stands for the instructions up to the next one, or to a symbol without one: a library's.
void AvrMemoryMap::fill_units(const std::set<std::size_t>& symbols) {
  for (std::size_t word = 1; word < unit_at_.size(); ++word) {
    if (unit_at_[word] == kNoUnit && !symbols.contains(word)) unit_at_[word] = unit_at_[word - 1];
  }
}

void AvrMemoryMap::take_symbol(const std::string& name, const GElf_Sym& symbol,
                               const std::string& source) {
  if (name == "__bss_end") variables_end_ = static_cast<std::uint16_t>(symbol.st_value);
  if (name == "__stack") stack_top_ = static_cast<std::uint16_t>(symbol.st_value);
  if (GELF_ST_TYPE(symbol.st_info) != STT_OBJECT) return;
  if (symbol.st_value < kRam || symbol.st_value >= kRamEnd) return;
  add({name, static_cast<std::uint32_t>(symbol.st_value - kRam),
       static_cast<std::uint32_t>(symbol.st_size), 0});
  if (GELF_ST_BIND(symbol.st_info) == STB_LOCAL) defined_in_[name] = source;
}

void AvrMemoryMap::read_symbols() {
  elf_version(EV_CURRENT);
  const int file = ::open(image().c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) throw std::runtime_error(image() + ": cannot be read");
  const std::unique_ptr<Elf, int (*)(Elf*)> elf(elf_begin(file, ELF_C_READ, nullptr), elf_end);
  std::set<std::size_t> code;
  std::string source;
  for (Elf_Scn* section = nullptr; (section = elf_nextscn(elf.get(), section)) != nullptr;) {
    GElf_Shdr header;
    if (gelf_getshdr(section, &header) == nullptr || header.sh_type != SHT_SYMTAB) continue;
    Elf_Data* const data = elf_getdata(section, nullptr);
    GElf_Sym symbol;
    for (int i = 0; gelf_getsym(data, i, &symbol) != nullptr; ++i) {
      const std::string name = elf_strptr(elf.get(), header.sh_link, symbol.st_name);
      if (GELF_ST_TYPE(symbol.st_info) == STT_FILE) source = name;
      if (symbol.st_value < kRam && symbol.st_shndx != SHN_ABS) code.insert(symbol.st_value / 2);
      take_symbol(name, symbol, source);
    }
  }
  ::close(file);
  fill_units(code);
  if (variables_end_ == 0 || stack_top_ == 0) {
    throw std::runtime_error(image() + ": does not tell where its variables and its stack end");
  }
}

void AvrMemoryMap::assign_writers(const std::string& owners) {
  const std::set<std::string> named = read_owners(owners);
  for (std::size_t i = 0; i < objects().size(); ++i) {
    const std::string& name = objects()[i].name;
    if (named.contains(name)) continue;
    const auto defined = defined_in_.find(name);
    if (defined == defined_in_.end()) {
      throw std::runtime_error(owners + ": does not say who may write " + name);
    }
    set_writers(i, units_ending(defined->second));
  }
}

const AvrMemoryMap::Object* AvrMemoryMap::object_at(std::uint16_t address) const {
  const std::int16_t index = object_at_.at(address);
  return index < 0 ? nullptr : &objects()[static_cast<std::size_t>(index)];
}

std::string AvrMemoryMap::place_of(std::uint32_t pc) const {
  char command[32];
  std::snprintf(command, sizeof command, " -f 0x%x", static_cast<unsigned>(pc));
  std::vector<std::string> lines;
  for_lines("avr-addr2line -s -e " + quoted(image()) + command,
            [&](const std::string& line) { lines.push_back(line); });
  if (lines.size() != 2) return std::string(command + 4);
  return lines[0] + " (" + lines[1].substr(0, lines[1].find(' ')) + ")";
}

}  // namespace bushd::sim
