// What the full-screen editor looks like in a window of any size: a grid of characters.
#pragma once

#include "cell_grid.h"
#include "table_editor.h"

namespace bushtab {

struct Window {
  int rows = 24;  // at least 1 of both
  int columns = 80;
  bool unicode = true;  // false: ASCII only
};

CellGrid render(const TableEditor& editor, const Window& window);

}  // namespace bushtab
