#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <system_error>

#include "base/nearest_name.h"
#include "tables/table_file.h"

namespace bushd::tables {

bool is_table_name(std::string_view name) {
  return !name.empty() && name.front() != '.' && name.size() <= kMaxNameLength &&
         std::none_of(name.begin(), name.end(), [](unsigned char c) {
           return c == '/' || c == '@' || c < 0x20 || c == 0x7F;
         });
}

namespace {

namespace fs = std::filesystem;

// Whether it is there. What cannot be looked at is an error, as is a link to nothing: a table of
// the same name farther on would be taken for it.
Result<bool> is_there(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error)) return true;
  if (error) return fail(Error{.message = "cannot be read: " + error.message(), .file = path});
  if (!fs::is_symlink(fs::symlink_status(path, error))) return false;
  return fail(
      Error{.message = "is a link to nothing; make what it leads to, or remove it", .file = path});
}

// As far as they can be seen: a hint needs no more.
std::vector<std::string> names_in(std::span<const std::filesystem::path> directories) {
  std::vector<std::string> names;
  for (const fs::path& directory : directories) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(directory, error)) {
      if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
    }
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace

Result<std::filesystem::path> find(std::string_view name,
                                   std::span<const std::filesystem::path> directories) {
  if (!is_table_name(name)) {
    return fail(
        fmt::format("\"{}\" is not a table's name; allowed: 1..{} characters without '/' and '@', "
                    "not beginning with '.' (the name of a file without \".toml\")",
                    name.substr(0, kMaxNameLength), kMaxNameLength));
  }
  std::string looked_in;
  for (const std::filesystem::path& directory : directories) {
    const auto searched = is_there(directory);
    if (!searched) return fail(searched.error());
    if (*searched && !fs::is_directory(directory)) {
      return fail(
          Error{.message = "is no folder, and tables are looked for in it", .file = directory});
    }
    const fs::path path = directory / fmt::format("{}.toml", name);
    const auto found = is_there(path);
    if (!found) return fail(found.error());
    if (*found) return path;
    looked_in += (looked_in.empty() ? "" : ", ") + directory.string();
  }
  return fail(fmt::format("there is no table \"{}\": no file {}.toml in {}{}", name, name,
                          looked_in, did_you_mean(name, names_in(directories))));
}

std::vector<std::filesystem::path> shipped_directories() {
  std::vector<std::filesystem::path> directories;
  if (const char* chosen = std::getenv("BUSHD_TABLES_DIR"); chosen != nullptr && *chosen != '\0') {
    directories.emplace_back(chosen);
  }
#ifdef BUSHD_SOURCE_TABLES
  directories.emplace_back(BUSHD_SOURCE_TABLES);
#endif
  // The program tells the prefix: it may be installed anywhere.
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    directories.push_back((program.parent_path() / BUSHD_TABLES_FROM_PROGRAM).lexically_normal());
  }
  return directories;
}

}  // namespace bushd::tables
