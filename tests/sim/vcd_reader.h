// A small reader of VCD files that knows only the standard: it shares nothing with the writer.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bushd::sim {

struct VcdChange {
  std::int64_t time;
  bool level;
};

struct VcdFile {
  std::string timescale;
  std::map<std::string, std::vector<VcdChange>> wires;  // by "scope.name", with the initial values
  std::map<std::string, std::vector<std::pair<std::int64_t, double>>> reals;
  std::vector<std::int64_t> stamps;
};

inline VcdFile read_vcd(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot open " + path);
  VcdFile file;
  std::map<std::string, std::string> name_of;
  std::vector<std::string> scope;
  std::string word;
  const auto section = [&] {
    std::vector<std::string> words;
    while (in >> word && word != "$end") words.push_back(word);
    if (word != "$end") throw std::runtime_error("a section has no $end");
    return words;
  };
  bool head = true;
  std::int64_t now = -1;
  while (in >> word) {
    if (word == "$timescale") {
      for (const std::string& w : section()) file.timescale += w;
    } else if (word == "$scope") {
      scope.push_back(section().at(1));
    } else if (word == "$upscope") {
      section();
      scope.pop_back();
    } else if (word == "$var") {
      const auto words = section();
      const bool real = words.at(0) == "real" && words.at(1) == "64";
      if (!real && (words.at(0) != "wire" || words.at(1) != "1")) {
        throw std::runtime_error("not a wire");
      }
      const std::string name = scope.at(0) + "." + words.at(3);
      if (!name_of.emplace(words.at(2), name).second) throw std::runtime_error("code used twice");
      if (real) {
        file.reals[name];
      } else if (!file.wires.emplace(name, std::vector<VcdChange>()).second) {
        throw std::runtime_error("name used twice: " + name);
      }
    } else if (word == "$enddefinitions") {
      section();
      head = false;
    } else if (word == "$dumpvars" || word == "$end") {
      continue;
    } else if (word.front() == '$') {
      section();
    } else if (head) {
      throw std::runtime_error("a value before the end of the definitions: " + word);
    } else if (word.front() == '#') {
      const std::int64_t stamp = std::stoll(word.substr(1));
      if (stamp <= now) throw std::runtime_error("time does not rise at " + word);
      now = stamp;
      file.stamps.push_back(stamp);
    } else if (word.front() == '0' || word.front() == '1') {
      file.wires.at(name_of.at(word.substr(1))).push_back({now, word.front() == '1'});
    } else if (word.front() == 'r') {
      const double value = std::stod(word.substr(1));
      if (!(in >> word)) throw std::runtime_error("a real without its code");
      file.reals.at(name_of.at(word)).emplace_back(now, value);
    } else {
      throw std::runtime_error("what is " + word);
    }
  }
  if (!scope.empty()) throw std::runtime_error("a scope is left open");
  return file;
}

}  // namespace bushd::sim
