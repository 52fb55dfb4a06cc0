#pragma once

#include "cell_grid.h"
#include "table_editor.h"

namespace bushtab {

// Speed over steps, with axes, in `rows` rows from `row` on; at least two. Each step is as wide as
// the next, so the cursor moves evenly.
void draw_curve(const TableEditor& editor, CellGrid& grid, int row, int rows);

}  // namespace bushtab
