#include "canvas.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bushtab {
namespace {

constexpr int kDotsAcross = 2;
constexpr int kDotsDown = 4;
constexpr char32_t kBraille = 0x2800;  // the pattern without dots

}  // namespace

Canvas::Canvas(int columns, int rows)
    : columns_(columns),
      rows_(rows),
      cells_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

void Canvas::line(Place from, Place to, int colour) {
  const auto x = [&](const Place& place) { return place.across * (columns_ * kDotsAcross - 1); };
  const auto y = [&](const Place& place) { return (1 - place.up) * (rows_ * kDotsDown - 1); };
  const double across = x(to) - x(from);
  const double down = y(to) - y(from);
  const int dots = 1 + static_cast<int>(std::max(std::abs(across), std::abs(down)));
  for (int dot = 0; dot <= dots; ++dot) {
    const double share = static_cast<double>(dot) / dots;
    set(x(from) + share * across, y(from) + share * down, colour);
  }
}

void Canvas::set(double across_dots, double down_dots, int colour) {
  // Bits of a Braille pattern, by column and row of its dots.
  constexpr std::array<std::array<unsigned, kDotsDown>, kDotsAcross> kBits{
      {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}}};
  const auto column = static_cast<std::size_t>(std::lround(across_dots));
  const auto row = static_cast<std::size_t>(std::lround(down_dots));
  Cell& cell = cells_[row / kDotsDown * static_cast<std::size_t>(columns_) + column / kDotsAcross];
  cell.dots |= kBits[column % kDotsAcross][row % kDotsDown];
  cell.colour = colour;
}

char32_t Canvas::character(int column, int row) const {
  const unsigned dots = at(column, row).dots;
  return dots == 0 ? U' ' : kBraille + dots;
}

int Canvas::column_of(double across) const {
  return static_cast<int>(std::lround(across * (columns_ * kDotsAcross - 1))) / kDotsAcross;
}

}  // namespace bushtab
