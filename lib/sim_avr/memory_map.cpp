#include "sim_avr/memory_map.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace bushd::sim {
namespace {

// The linker's name for addresses of RAM.
constexpr std::uint64_t kRam = 0x800000;
constexpr std::uint64_t kRamEnd = kRam + 0x10000;

void for_lines(const std::string& command, const std::function<void(const std::string&)>& take) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"),
                                                             ::pclose);
  if (!pipe) throw std::runtime_error(command + ": cannot be run");
  std::string line;
  for (int c; (c = std::fgetc(pipe.get())) != EOF;) {
    if (c != '\n') {
      line += static_cast<char>(c);
      continue;
    }
    take(line);
    line.clear();
  }
}

std::string quoted(const std::string& path) {
  return "'" + path + "'";
}

bool ends_with_path(const std::string& path, const std::string& end) {
  if (path == end) return true;
  return path.size() > end.size() && path.ends_with(end) &&
         path[path.size() - end.size() - 1] == '/';
}

}  // namespace

AvrMemoryMap::AvrMemoryMap(const std::string& image, const std::string& owners) : image_(image) {
  read_units();
  read_symbols();
  read_owners(owners);
  // Parts after what they are parts of.
  std::stable_sort(objects_.begin(), objects_.end(),
                   [](const Object& a, const Object& b) { return a.size > b.size; });
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const Object& object = objects_[i];
    for (std::size_t at = object.address; at < std::size_t{object.address} + object.size; ++at) {
      object_at_.at(at) = static_cast<std::int16_t>(i);
      writers_.at(at) = object.writers;
    }
  }
}

// Rows are `FILE LINE 0xADDRESS`, below the compilation unit that they are of.
void AvrMemoryMap::read_units() {
  Unit unit = kNoUnit;
  for_lines("avr-objdump --dwarf=decodedline " + quoted(image_), [&](const std::string& line) {
    if (line.starts_with("CU: ")) {
      std::string file = line.substr(4, line.find_last_not_of(": \r") - 3);
      while (file.starts_with("./") || file.starts_with("../")) file.erase(0, file.find('/') + 1);
      units_.push_back(file);
      unit = static_cast<Unit>(units_.size() - 1);
      return;
    }
    const std::size_t hex = line.rfind("0x");
    if (unit == kNoUnit || hex == std::string::npos) return;
    const std::size_t word = std::stoul(line.substr(hex), nullptr, 16) / 2;
    if (unit_at_.size() <= word) unit_at_.resize(word + 1, kNoUnit);
    unit_at_[word] = unit;
  });
  if (units_.size() == 1) throw std::runtime_error(image_ + ": has no line numbers");
  if (units_.size() > kUnits) throw std::runtime_error(image_ + ": has too many source files");
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
  objects_.push_back({name, static_cast<std::uint16_t>(symbol.st_value - kRam),
                      static_cast<std::uint16_t>(symbol.st_size), 0});
  if (GELF_ST_BIND(symbol.st_info) == STB_LOCAL) defined_in_[name] = source;
}

void AvrMemoryMap::read_symbols() {
  elf_version(EV_CURRENT);
  const int file = ::open(image_.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) throw std::runtime_error(image_ + ": cannot be read");
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
    throw std::runtime_error(image_ + ": does not tell where its variables and its stack end");
  }
}

std::uint64_t AvrMemoryMap::units_ending(const std::string& end) const {
  std::uint64_t found = 0;
  for (std::size_t i = 1; i < units_.size(); ++i) {
    if (end == "*" || ends_with_path(units_[i], end)) found |= std::uint64_t{1} << i;
  }
  return found;
}

AvrMemoryMap::Unit AvrMemoryMap::unit_named(const std::string& end) const {
  for (std::size_t i = 1; i < units_.size(); ++i) {
    if (ends_with_path(units_[i], end)) return static_cast<Unit>(i);
  }
  throw std::out_of_range(image_ + ": is not made of " + end);
}

void AvrMemoryMap::read_owners(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::map<std::string, std::uint64_t> owners;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string at = path + ":" + std::to_string(number) + ": ";
    std::istringstream words(line.substr(0, line.find('#')));
    std::string object;
    if (!(words >> object)) continue;
    if (std::none_of(objects_.begin(), objects_.end(),
                     [&](const Object& o) { return o.name == object; })) {
      throw std::runtime_error(at + "the image has no object " + object);
    }
    owners[object];  // without a file it is nobody's
    for (std::string end; words >> end;) {
      const std::uint64_t units = units_ending(end);
      if (units == 0) throw std::runtime_error(at + "the image has no source file " + end);
      owners[object] |= units;
    }
  }
  for (Object& object : objects_) {
    const auto named = owners.find(object.name);
    const auto defined = defined_in_.find(object.name);
    if (named != owners.end()) {
      object.writers = named->second;
    } else if (defined != defined_in_.end()) {
      object.writers = units_ending(defined->second);
    } else {
      throw std::runtime_error(path + ": says not who may write " + object.name);
    }
  }
}

const AvrMemoryMap::Object* AvrMemoryMap::object_at(std::uint16_t address) const {
  const std::int16_t index = object_at_.at(address);
  return index < 0 ? nullptr : &objects_[static_cast<std::size_t>(index)];
}

const AvrMemoryMap::Object& AvrMemoryMap::object(const std::string& name) const {
  for (const Object& object : objects_) {
    if (object.name == name) return object;
  }
  throw std::out_of_range(image_ + ": has no object " + name);
}

std::string AvrMemoryMap::place_of(std::uint32_t pc) const {
  char command[32];
  std::snprintf(command, sizeof command, " -f 0x%x", static_cast<unsigned>(pc));
  std::vector<std::string> lines;
  for_lines("avr-addr2line -s -e " + quoted(image_) + command,
            [&](const std::string& line) { lines.push_back(line); });
  if (lines.size() != 2) return std::string(command + 4);
  return lines[0] + " (" + lines[1].substr(0, lines[1].find(' ')) + ")";
}

}  // namespace bushd::sim
