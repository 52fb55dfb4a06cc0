#include <fmt/core.h>

#include "commands.h"
#include "open_table.h"
#include "tables/table_file.h"

namespace bushtab {

int check(const std::vector<std::string>& files) {
  int result = kDone;
  for (const std::string& file : files) {
    const auto table = bushd::tables::load(file);
    if (table) {
      fmt::print("{}: good\n", file);
    } else {
      result = refuse(table.error());
    }
  }
  return result;
}

}  // namespace bushtab
