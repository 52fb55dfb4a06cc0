// Lines in a terminal: each character is a Braille pattern of 2 x 4 dots.
#pragma once

#include <cstddef>
#include <vector>

namespace bushtab {

class Canvas {
 public:
  // In characters.
  Canvas(int columns, int rows);

  // From one place to another, dot by dot. Places are shares of the canvas, 0..1, from its left and
  // from its bottom; of two lines in a character the later one's colour counts.
  struct Place {
    double across = 0;
    double up = 0;
  };
  void line(Place from, Place to, int colour);

  // A character that has no dots is a blank.
  char32_t character(int column, int row) const;
  bool has_dots(int column, int row) const { return at(column, row).dots != 0; }
  int colour(int column, int row) const { return at(column, row).colour; }
  // The column that a place is in.
  int column_of(double across) const;

 private:
  struct Cell {
    unsigned dots = 0;
    int colour = 0;
  };
  const Cell& at(int column, int row) const {
    return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
  }
  void set(double across_dots, double down_dots, int colour);

  int columns_;
  int rows_;
  std::vector<Cell> cells_;
};

}  // namespace bushtab
