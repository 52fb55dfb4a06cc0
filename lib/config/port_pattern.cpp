#include "config/port_pattern.h"

#include <fnmatch.h>
#include <glob.h>
#include <sys/stat.h>

#include <string_view>

namespace bushd::config {
namespace {

constexpr std::string_view kWild = "*?[";

bool begins_alike(std::string_view a, std::string_view b) {
  return a.starts_with(b) || b.starts_with(a);
}
bool ends_alike(std::string_view a, std::string_view b) {
  return a.ends_with(b) || b.ends_with(a);
}

// What every match begins and ends with.
std::string_view head(std::string_view pattern) {
  return pattern.substr(0, pattern.find_first_of(kWild));
}
std::string_view tail(std::string_view pattern) {
  return pattern.substr(pattern.find_last_of("*?]") + 1);
}

}  // namespace

bool is_pattern(const std::string& port) {
  return port.find_first_of(kWild) != std::string::npos;
}

std::vector<std::string> ports_matching(const std::string& port) {
  if (!is_pattern(port)) return {port};
  std::vector<std::string> paths;
  glob_t found{};
  if (::glob(port.c_str(), GLOB_NOESCAPE, nullptr, &found) == 0) {
    paths.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  }
  ::globfree(&found);
  return paths;
}

// std::filesystem::equivalent does not answer for devices.
bool is_same_port(const std::string& a, const std::string& b) {
  struct stat one{};
  struct stat other{};
  if (::stat(a.c_str(), &one) != 0 || ::stat(b.c_str(), &other) != 0) return false;
  if (S_ISCHR(one.st_mode) && S_ISCHR(other.st_mode)) return one.st_rdev == other.st_rdev;
  return one.st_dev == other.st_dev && one.st_ino == other.st_ino;
}

bool patterns_may_meet(const std::string& a, const std::string& b) {
  if (!is_pattern(a) && !is_pattern(b)) return false;
  if (!is_pattern(a)) return ::fnmatch(b.c_str(), a.c_str(), FNM_PATHNAME | FNM_NOESCAPE) == 0;
  if (!is_pattern(b)) return ::fnmatch(a.c_str(), b.c_str(), FNM_PATHNAME | FNM_NOESCAPE) == 0;
  return begins_alike(head(a), head(b)) && ends_alike(tail(a), tail(b));
}

}  // namespace bushd::config
