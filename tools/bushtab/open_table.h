#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"
#include "tables/store/store.h"
#include "tables/table.h"

namespace bushtab {

// Where tables are kept: --dir and --history. Empty: the defaults.
struct Places {
  std::string directory;
  std::string history;
};

// A table given on the command line is a file's path (it contains '/', ends in ".toml" or names a
// file that is there) or a name: NAME.toml in the directory of tables, else a shipped one. With
// "@REV" behind it, it is that revision or tag.
bushd::Result<bushd::tables::TablePtr> open_table(const Places& places, const std::string& table);

// Where a table that is changed lives. Its history is that of --history, else that of the machine
// for the machine's tables, else a file beside it.
struct Home {
  bushd::tables::store::Store store;
  std::string name;
};
bushd::Result<Home> home_of(const Places& places, const std::string& table);

// The table in its file. Of one that is only shipped, the error says how to get one's own.
bushd::Result<bushd::tables::store::Stored> read_home(const Home& home);
// Makes a new table in it; its directory too, which is said on stderr.
bushd::Result<std::uint32_t> create_in(Home& home, const std::string& text,
                                       const std::string& note);

// The directories in which names are looked for.
std::vector<std::filesystem::path> directories(const Places& places);
// All names there, sorted.
std::vector<std::string> table_names(const Places& places);

// Prints the error to stderr and returns kRefused.
int refuse(const bushd::Error& error);

}  // namespace bushtab
