#include "curve_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "canvas.h"

namespace bushtab {
namespace {

constexpr int kLabelColumns = 11;  // "123456.7 |"
constexpr int kMinCurveColumns = 20;

// The steps that are drawn, and what lies at the borders of the drawing.
struct Span {
  std::size_t from = 0;
  std::size_t count = 0;
  double low_hz = 0;
  double top_hz = 0;

  Canvas::Place place(const std::vector<CurveStep>& curve, std::size_t at) const {
    const std::size_t shown = std::clamp(at, from, from + count - 1);
    const auto last = static_cast<double>(std::max<std::size_t>(count - 1, 1));
    return {static_cast<double>(shown - from) / last,
            (curve[shown].speed_hz() - low_hz) / (top_hz - low_hz)};
  }
};

Span span_of(const TableEditor& editor, int columns) {
  const auto& curve = editor.curve();
  const auto near = static_cast<std::size_t>(columns);
  Span span{.from = 0, .count = curve.size()};
  if (editor.zoomed() && span.count > near) {
    span.count = near;
    span.from =
        std::min(editor.cursor() - std::min(editor.cursor(), near / 2), curve.size() - near);
  }
  const auto begin = curve.begin() + static_cast<std::ptrdiff_t>(span.from);
  const auto [slowest, fastest] = std::minmax_element(
      begin, begin + static_cast<std::ptrdiff_t>(span.count),
      [](const CurveStep& a, const CurveStep& b) { return a.speed_hz() < b.speed_hz(); });
  span.top_hz = fastest->speed_hz();
  // All of it stands on zero; nearby, differences matter.
  const bool flat = slowest->delay_ns == fastest->delay_ns;
  span.low_hz = editor.zoomed() && !flat ? slowest->speed_hz() : 0;
  return span;
}

void draw_axes(CellGrid& grid, const Span& span, int row, int height, int left) {
  const int axis = row + height;
  for (int column = left; column < grid.columns(); ++column) {
    grid.put(axis, column, U'─', Style::kFaint);
  }
  if (left == 0) return;
  for (int y = row; y < axis; ++y) grid.put(y, left - 1, U'│', Style::kFaint);
  grid.put(axis, left - 1, U'└', Style::kFaint);
  grid.put_text(row, 0, fmt::format("{:>9.6g}", span.top_hz), Style::kFaint);
  grid.put_text(axis - 1, 0, fmt::format("{:>9.6g}", span.low_hz), Style::kFaint);
  if (height > 2) grid.put_text(row + 1, 2, "steps/s", Style::kFaint);
  grid.put_text(axis, left + 1, fmt::format(" step {} ", span.from + 1), Style::kFaint);
  const std::string end = fmt::format(" {} ", span.from + span.count);
  grid.put_text(axis, grid.columns() - 1 - static_cast<int>(end.size()), end, Style::kFaint);
}

}  // namespace

void draw_curve(const TableEditor& editor, CellGrid& grid, int row, int rows) {
  const auto& curve = editor.curve();
  const int left = grid.columns() >= kLabelColumns + kMinCurveColumns ? kLabelColumns : 0;
  const int columns = grid.columns() - left;
  const int height = rows - 1;  // the axis is below
  const Span span = span_of(editor, columns);
  Canvas canvas(columns, height);
  for (std::size_t at = span.from; at < span.from + span.count; ++at) {
    canvas.line(span.place(curve, at - std::min<std::size_t>(at, 1)), span.place(curve, at), 0);
  }

  const auto column_of = [&](std::size_t at) {
    return canvas.column_of(span.place(curve, at).across);
  };
  const int cursor = column_of(editor.cursor());
  std::optional<std::pair<int, int>> selected;
  if (const auto range = editor.selection()) {
    selected = {column_of(range->first), column_of(range->last)};
  }
  const auto style_of = [&](int column) {
    if (column == cursor) return Style::kCursor;
    const bool inside = selected && column >= selected->first && column <= selected->second;
    return inside ? Style::kSelected : Style::kCurve;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (canvas.has_dots(x, y)) {
        grid.put(row + y, left + x, canvas.character(x, y), style_of(x));
      } else if (x == cursor) {
        grid.put(row + y, left + x, U'│', Style::kFaint);
      }
    }
  }
  draw_axes(grid, span, row, height, left);
}

}  // namespace bushtab
