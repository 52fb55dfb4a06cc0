// Keys as they are typed, for tests of the editor.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/bushtab/table_editor.h"

namespace bushtab::test {

inline TableEditor::Wish type(TableEditor& editor, std::u32string_view keys) {
  auto wish = TableEditor::Wish::kNone;
  for (const Key key : keys) wish = editor.press(key);
  return wish;
}

inline TableEditor::Watched watching(std::vector<std::uint32_t> steps,
                                     std::optional<double> max_hz = {}) {
  TableEditor::Watched watched;
  watched.limits.max_hz = max_hz;
  watched.steps = std::move(steps);
  return watched;
}

inline TableEditor editor_of(std::vector<std::uint16_t> accel,
                             std::optional<std::vector<std::uint16_t>> decel = {},
                             std::optional<std::uint16_t> cruise = {}) {
  return TableEditor({.name = "t",
                      .time_unit_ns = 1000,
                      .accel = std::move(accel),
                      .decel = std::move(decel),
                      .cruise = cruise},
                     7, watching({5}));
}

}  // namespace bushtab::test
