#include "sim/memory_map.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace bushd::sim {
namespace {

bool ends_with_path(const std::string& path, const std::string& end) {
  if (path == end) return true;
  return path.size() > end.size() && path.ends_with(end) &&
         path[path.size() - end.size() - 1] == '/';
}

}  // namespace

MemoryMap::Unit MemoryMap::unit_of(std::string file) {
  while (file.starts_with("./") || file.starts_with("../")) file.erase(0, file.find('/') + 1);
  const auto found = std::find(units_.begin(), units_.end(), file);
  if (found != units_.end()) return static_cast<Unit>(found - units_.begin());
  if (units_.size() == kMaxUnits) throw std::runtime_error(image_ + ": has too many source files");
  units_.push_back(std::move(file));
  return static_cast<Unit>(units_.size() - 1);
}

MemoryMap::Units MemoryMap::units_ending(const std::string& end) const {
  Units found;
  for (std::size_t i = 1; i < units_.size(); ++i) {
    if (end == "*" || ends_with_path(units_[i], end)) found.set(i);
  }
  return found;
}

MemoryMap::Unit MemoryMap::unit_named(const std::string& end) const {
  for (std::size_t i = 1; i < units_.size(); ++i) {
    if (ends_with_path(units_[i], end)) return static_cast<Unit>(i);
  }
  throw std::out_of_range(image_ + ": is not made of " + end);
}

const MemoryMap::Object& MemoryMap::object(const std::string& name) const {
  const auto found = std::find_if(objects_.begin(), objects_.end(),
                                  [&](const Object& object) { return object.name == name; });
  if (found == objects_.end()) throw std::out_of_range(image_ + ": has no object " + name);
  return *found;
}

std::set<std::string> MemoryMap::read_owners(const std::string& path) {
  // The larger one of those that begin together is the whole.
  std::stable_sort(objects_.begin(), objects_.end(), [](const Object& a, const Object& b) {
    return a.address != b.address ? a.address < b.address : a.size > b.size;
  });
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::map<std::string, Units> owners;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string at = path + ":" + std::to_string(number) + ": ";
    std::istringstream words(line.substr(0, line.find('#')));
    std::string name;
    if (!(words >> name)) continue;
    if (std::none_of(objects_.begin(), objects_.end(),
                     [&](const Object& object) { return object.name == name; })) {
      throw std::runtime_error(at + "the image has no object " + name);
    }
    owners[name];  // without a file it is nobody's
    for (std::string end; words >> end;) {
      const Units units = units_ending(end);
      if (units.none()) throw std::runtime_error(at + "the image has no source file " + end);
      owners[name] |= units;
    }
  }
  std::set<std::string> named;
  for (const auto& [name, units] : owners) named.insert(name);
  for (Object& object : objects_) {
    const auto found = owners.find(object.name);
    if (found != owners.end()) object.writers = found->second;
  }
  return named;
}

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

std::string hex(std::uint32_t value, int digits) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%0*x", digits, value);
  return text;
}

std::optional<CodePlace> code_place(const std::string& addr2line, const std::string& image,
                                    std::uint32_t pc) {
  std::vector<std::string> lines;
  for_lines(addr2line + " -f -e " + quoted(image) + " " + hex(pc, 1),
            [&](const std::string& line) { lines.push_back(line); });
  if (lines.size() != 2) return std::nullopt;
  return CodePlace{lines[0], lines[1]};
}

}  // namespace bushd::sim
