// Columns of numbers with a name each, as spreadsheets and scripts write them:
//
//   # a comment
//   energy, theta, gap
//   5000, 23.2956, 15.32
//
// Numbers are decimal, with a point. Empty lines and those that begin with # are skipped.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace bushd::csv {

struct NumberColumn {
  std::string name{};
  std::vector<double> numbers{};
};

struct NumberTable {
  std::string file{};
  std::vector<NumberColumn> columns{};  // of one length each
  std::vector<int> lines{};             // in the file, 1-based, of each row

  std::size_t rows() const { return lines.size(); }
};

// Reads the text of a file. Errors name file, line and column: names missing, empty or given twice,
// no rows or more than `most_rows`, a row of another length, what is no finite number.
Result<NumberTable> parse_numbers(std::string_view text, const std::string& file,
                                  std::size_t most_rows);

}  // namespace bushd::csv
