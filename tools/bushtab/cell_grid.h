// Characters on a screen, each with what it is: how that looks is for the terminal to say.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace bushtab {

enum class Style { kPlain, kTitle, kCursor, kSelected, kCurve, kFaint, kKey, kWarning, kError };

struct Cell {
  char32_t character = U' ';
  Style style = Style::kPlain;
};

class CellGrid {
 public:
  // Without `unicode` every character becomes one of ASCII.
  CellGrid(int rows, int columns, bool unicode)
      : rows_(rows),
        columns_(columns),
        unicode_(unicode),
        cells_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns)) {}

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  const Cell& at(int row, int column) const { return cells_[index(row, column)]; }
  // What lies outside is left out.
  void put(int row, int column, char32_t character, Style style);
  // Returns the column behind it.
  int put_text(int row, int column, std::string_view utf8, Style style);

 private:
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  int rows_;
  int columns_;
  bool unicode_;
  std::vector<Cell> cells_;
};

}  // namespace bushtab
