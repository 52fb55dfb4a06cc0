#include "sim/avr/memory_map.h"

#include <elfutils/libdw.h>

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
  read_image();
  assign_writers(owners);
  for (std::size_t i = 0; i < objects().size(); ++i) {
    const Object& object = objects()[i];
    for (std::size_t at = object.address; at < std::size_t{object.address} + object.size; ++at) {
      object_at_.at(at) = static_cast<std::int16_t>(i);
      writers_.at(at) = object.writers;
    }
  }
}

void AvrMemoryMap::read_image() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(image().c_str(), "re"),
                                                             std::fclose);
  if (!file) throw std::runtime_error(image() + ": cannot be read");
  elf_version(EV_CURRENT);
  const std::unique_ptr<Elf, int (*)(Elf*)> elf(
      elf_begin(::fileno(file.get()), ELF_C_READ, nullptr), elf_end);
  read_units(elf.get());
  read_symbols(elf.get());
}

// Those of a compilation unit are of its source file, headers that it includes as well.
void AvrMemoryMap::read_units(Elf* elf) {
  const std::unique_ptr<Dwarf, int (*)(Dwarf*)> dwarf(dwarf_begin_elf(elf, DWARF_C_READ, nullptr),
                                                      dwarf_end);
  Dwarf_CU* compiled = nullptr;
  Dwarf_Die die;
  while (dwarf &&
         dwarf_get_units(dwarf.get(), compiled, &compiled, nullptr, nullptr, &die, nullptr) == 0) {
    Dwarf_Lines* lines = nullptr;
    std::size_t count = 0;
    const char* const file = dwarf_diename(&die);
    if (file == nullptr || dwarf_getsrclines(&die, &lines, &count) != 0) continue;
    const Unit unit = unit_of(file);
    for (std::size_t i = 0; i < count; ++i) {
      Dwarf_Line* const line = dwarf_onesrcline(lines, i);
      Dwarf_Addr address = 0;
      bool behind = false;
      dwarf_lineaddr(line, &address);
      dwarf_lineendsequence(line, &behind);
      if (behind) continue;
      if (unit_at_.size() <= address / 2) unit_at_.resize(address / 2 + 1, kNoUnit);
      unit_at_[address / 2] = unit;
    }
  }
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

void AvrMemoryMap::read_symbols(Elf* elf) {
  std::set<std::size_t> code;
  std::string source;
  for (Elf_Scn* section = nullptr; (section = elf_nextscn(elf, section)) != nullptr;) {
    GElf_Shdr header;
    if (gelf_getshdr(section, &header) == nullptr || header.sh_type != SHT_SYMTAB) continue;
    Elf_Data* const data = elf_getdata(section, nullptr);
    GElf_Sym symbol;
    for (int i = 0; gelf_getsym(data, i, &symbol) != nullptr; ++i) {
      const std::string name = elf_strptr(elf, header.sh_link, symbol.st_name);
      if (GELF_ST_TYPE(symbol.st_info) == STT_FILE) source = name;
      if (symbol.st_value < kRam && symbol.st_shndx != SHN_ABS) code.insert(symbol.st_value / 2);
      take_symbol(name, symbol, source);
    }
  }
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
  const auto place = code_place("avr-addr2line -s", image(), pc);
  if (!place) return hex(pc, 1);
  return place->function + " (" + place->line.substr(0, place->line.find(' ')) + ")";
}

}  // namespace bushd::sim
