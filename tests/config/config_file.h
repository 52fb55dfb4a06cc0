// A good configuration to spoil, and a file to put it in.
#pragma once

#include <stdexcept>
#include <string>

#include "config/config.h"
#include "results.h"
#include "tables/temp_directory.h"

namespace bushd::test {

inline constexpr const char* kTable = "name = \"t\"\ntime_unit_ns = 40000\naccel = [250, 10]\n";

// The numbers are lines.
inline const std::string kGood =
    "[lcm]\n"                           // 1
    "url = \"memq://\"\n"               // 2
    "prefix = \"TEST\"\n"               // 3
    "[[bus]]\n"                         // 4
    "name = \"hall\"\n"                 // 5
    "port = \"/dev/no-such-port-a\"\n"  // 6
    "baud = 500000\n"                   // 7
    "tick_us = 2560\n"                  // 8
    "format = \"fine\"\n"               // 9
    "[[bus]]\n"                         // 10
    "name = \"roof\"\n"                 // 11
    "port = \"/dev/no-such-port-b\"\n"  // 12
    "baud = 115200\n"                   // 13
    "tick_us = 5000\n"                  // 14
    "format = \"coarse\"\n"             // 15
    "[[mcu]]\n"                         // 16
    "bus = \"hall\"\n"                  // 17
    "address = 1\n"                     // 18
    "[[mcu]]\n"                         // 19
    "bus = \"roof\"\n"                  // 20
    "address = 255\n"                   // 21
    "[[group]]\n"                       // 22
    "name = \"goniometer\"\n"           // 23
    "table = \"bushd2-constant\"\n"     // 24
    "[[group]]\n"                       // 25
    "name = \"slits\"\n"                // 26
    "table = \"own\"\n"                 // 27
    "[[motor]]\n"                       // 28
    "name = \"theta\"\n"                // 29
    "mcu = \"hall:1\"\n"                // 30
    "output = 0\n"                      // 31
    "group = \"goniometer\"\n"          // 32
    "[[motor]]\n"                       // 33
    "name = \"slit\"\n"                 // 34
    "mcu = \"roof:255\"\n"              // 35
    "output = 15\n"                     // 36
    "group = \"slits\"\n";              // 37

// A configuration's file with its tables beside it.
class ConfigFile {
 public:
  explicit ConfigFile(const std::string& text) {
    directory_.write("own.toml", kTable);
    path_ = directory_.write("bushd.toml", text);
  }
  Result<config::Config> load() const { return config::load(path_); }
  std::string error() const { return error_of(load()); }
  const TempDirectory& directory() const { return directory_; }
  const std::string& path() const { return path_; }

 private:
  TempDirectory directory_;
  std::string path_;
};

// What the text of a good configuration says; the error of another one ends the test.
inline config::Config loaded(const std::string& text) {
  return good(ConfigFile(text).load());
}

inline std::string error_of(const std::string& configuration) {
  return ConfigFile(configuration).error();
}

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

// Lines in the first [[mcu]], "hall:1", and in the first [[motor]], "theta" at output 0 of that;
// then from line 37 on, in the second [[motor]], "slit".
inline std::string of_mcu(const std::string& keys, const std::string& text = kGood) {
  return replaced(text, "address = 1\n", "address = 1\n" + keys);
}
inline std::string of_motor(const std::string& keys, const std::string& text = kGood) {
  return replaced(text, "output = 0\n", "output = 0\n" + keys);
}
inline std::string of_slit(const std::string& keys) {
  return replaced(kGood, "output = 15\n", "output = 15\n" + keys);
}

}  // namespace bushd::test
