#include <fmt/core.h>

#include "commands.h"
#include "open_table.h"

namespace bushtab {

int check(const std::vector<std::string>& tables) {
  int result = kDone;
  for (const std::string& table : tables) {
    const auto opened = open_table(table);
    if (opened) {
      fmt::print("{}: good\n", table);
    } else {
      result = refuse(opened.error());
    }
  }
  return result;
}

}  // namespace bushtab
