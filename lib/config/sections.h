// Private to lib/config: from sections of the file to the vectors of Config, each section by
// itself.
#pragma once

#include <vector>

#include "base/result.h"
#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// A Config in the making, and where each of its elements stands in the file.
struct Loading {
  Config config;
  std::vector<tables::TomlReader> buses;
  std::vector<tables::TomlReader> groups;
  std::vector<tables::TomlReader> motors;
};

// Fills `loading`: all keys and types, all names resolved, nothing given twice, tables loaded.
Result<void> read_sections(const tables::TomlReader& root, Loading* loading);

}  // namespace bushd::config
