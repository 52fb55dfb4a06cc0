// The .lcm files and docs/messages.md, by what the types declare.
//
//   message_types SOURCE            tells which files say something else, with exit code 1
//   message_types SOURCE --write    writes them
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "lcm/type_description.h"

namespace {

using Files = std::map<std::filesystem::path, std::string>;

// Words in the meaning of a field that is told by words: it has to know them.
bool has_known_words(const bushd::test::TypeDescriptions& types) {
  bool good = true;
  for (const auto& type : types) {
    for (const auto& field : type.fields) {
      for (const std::string& word : field.wrong_words) {
        std::cerr << type.name << "." << field.name << " cannot be \"" << word << "\"\n";
        good = false;
      }
    }
  }
  return good;
}

Files declared(const std::filesystem::path& source, const bushd::test::TypeDescriptions& types) {
  Files files;
  for (const auto& type : types) {
    files[source / "lib/lcm/types" / (type.name + ".lcm")] = bushd::test::lcm_file(type);
  }
  files[source / "docs/messages.md"] = bushd::test::page(types);
  return files;
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

int main(int argc, char** argv) {
  const bool writes = argc == 3 && std::string(argv[2]) == "--write";
  if (argc != 2 && !writes) {
    std::cerr << "message_types SOURCE [--write]\n";
    return 2;
  }
  const std::filesystem::path source = argv[1];
  const auto types = bushd::test::all_types();
  if (!has_known_words(types)) return 1;
  const Files files = declared(source, types);
  int differ = 0;
  for (const auto& [path, text] : files) {
    if (text_of(path) == text) continue;
    ++differ;
    if (writes) {
      std::ofstream(path) << text;
    } else {
      std::cerr << path.string() << " differs from what the types declare\n";
    }
  }
  for (const auto& entry : std::filesystem::directory_iterator(source / "lib/lcm/types")) {
    if (files.contains(entry.path())) continue;
    ++differ;
    if (writes) {
      std::filesystem::remove(entry.path());
    } else {
      std::cerr << entry.path().string() << ": no message has this type\n";
    }
  }
  if (writes || differ == 0) return 0;
  std::cerr << "write them: build/release/bin/message_types . --write\n";
  return 1;
}
