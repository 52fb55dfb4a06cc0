// Tables with a share of their acceleration, for motors that take no more of it than that: those of
// scale_acceleration(), each made once.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "base/result.h"
#include "tables/table.h"

namespace bushd::tables {

class Gentler {
 public:
  // Codes of both sides together. Making a table takes about a microsecond a code, and whoever asks
  // waits for it.
  static constexpr std::size_t kMostCodes = 16384;

  // `table` itself for a share of 1; else its speeds with so much of its acceleration: same name
  // and revision, another content, of no file. The same table and share give the same object, which
  // lives as long as this.
  //   share  above 0, at most 1
  // Error: more than kMostCodes codes.
  Result<TablePtr> of(const TablePtr& table, double share);

 private:
  // By revision, name and content.
  std::map<std::pair<std::string, double>, TablePtr> made_;
};

}  // namespace bushd::tables
