// bushtab as a user runs it: a command line, and what comes of it.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tables/temp_directory.h"

namespace bushd::test {

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline Outcome bushtab(const std::string& arguments, const std::string& environment = "",
                       const std::string& input = "/dev/null") {
  const TempDirectory directory;
  const std::string out = directory.path() / "out";
  const std::string err = directory.path() / "err";
  const int status = std::system(
      (environment + " " BUSHTAB " " + arguments + " <" + input + " >" + out + " 2>" + err)
          .c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out), read_file(err)};
}

}  // namespace bushd::test
