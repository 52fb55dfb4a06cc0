// plot: the speed over time of a table's two sides, in the terminal. Each character is a Braille
// pattern of 2 x 4 dots.
#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "commands.h"
#include "curve.h"
#include "open_table.h"

namespace bushtab {
namespace {

constexpr int kDotsAcross = 2;
constexpr int kDotsDown = 4;
constexpr int kDefaultColumns = 80;
constexpr int kMinColumns = 40;
constexpr int kMaxColumns = 400;
constexpr int kRows = 16;
constexpr int kLabelColumns = 11;  // "123456.7 |" and a space
constexpr std::array<const char*, 6> kColours{"36", "33", "35", "32", "31", "34"};

int columns() {
  winsize size{};
  int wanted = kDefaultColumns;
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    wanted = size.ws_col;
  } else if (const char* text = std::getenv("COLUMNS"); text != nullptr && std::atoi(text) > 0) {
    wanted = std::atoi(text);
  }
  return std::clamp(wanted, kMinColumns, kMaxColumns);
}

class Canvas {
 public:
  Canvas(int width, double end_s, double top_hz)
      : width_(width),
        end_s_(end_s),
        top_hz_(top_hz),
        cells_(static_cast<std::size_t>(width) * kRows) {}

  // Lines between the points, dot by dot.
  void draw(const std::vector<CurveStep>& curve, int colour) {
    for (std::size_t i = 0; i < curve.size(); ++i) {
      const CurveStep& to = curve[i];
      const CurveStep& from = i == 0 ? to : curve[i - 1];
      const double across = std::abs(x(to) - x(from));
      const double down = std::abs(y(to) - y(from));
      const int dots = 1 + static_cast<int>(std::max(across, down));
      for (int dot = 0; dot <= dots; ++dot) {
        const double share = static_cast<double>(dot) / dots;
        set(x(from) + share * (x(to) - x(from)), y(from) + share * (y(to) - y(from)), colour);
      }
    }
  }

  std::string row(int row, bool coloured) const {
    std::string text;
    for (int column = 0; column < width_; ++column) {
      const Cell& cell = cells_[static_cast<std::size_t>(row * width_ + column)];
      const unsigned point = 0x2800U + cell.dots;
      std::string glyph{static_cast<char>(0xE0 | (point >> 12)),
                        static_cast<char>(0x80 | ((point >> 6) & 0x3F)),
                        static_cast<char>(0x80 | (point & 0x3F))};
      if (cell.dots == 0) glyph = " ";
      text += coloured && cell.dots != 0
                  ? fmt::format("\033[{}m{}\033[0m",
                                kColours[static_cast<std::size_t>(cell.colour) % kColours.size()],
                                glyph)
                  : glyph;
    }
    return text;
  }

 private:
  struct Cell {
    unsigned dots = 0;
    int colour = 0;
  };

  double x(const CurveStep& point) const {
    return point.middle_s() / end_s_ * (width_ * kDotsAcross - 1);
  }
  double y(const CurveStep& point) const {
    return (1 - point.speed_hz() / top_hz_) * (kRows * kDotsDown - 1);
  }

  void set(double across, double down, int colour) {
    // Bits of a Braille pattern, by column and row of its dots.
    constexpr std::array<std::array<unsigned, kDotsDown>, kDotsAcross> kBits{
        {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}}};
    const auto column = static_cast<std::size_t>(std::lround(across));
    const auto row = static_cast<std::size_t>(std::lround(down));
    Cell& cell = cells_[row / kDotsDown * static_cast<std::size_t>(width_) + column / kDotsAcross];
    cell.dots |= kBits[column % kDotsAcross][row % kDotsDown];
    cell.colour = colour;
  }

  int width_;
  double end_s_;
  double top_hz_;
  std::vector<Cell> cells_;
};

}  // namespace

int plot(const Places& places, const std::vector<std::string>& names) {
  std::vector<std::vector<CurveStep>> curves;
  double end_s = 0;
  double top_hz = 0;
  for (const std::string& name : names) {
    const auto table = open_table(places, name);
    if (!table) return refuse(table.error());
    curves.push_back(curve_of(**table));
    for (const CurveStep& step : curves.back()) top_hz = std::max(top_hz, step.speed_hz());
    end_s = std::max(end_s, static_cast<double>(curves.back().back().time_ns) * 1e-9);
  }
  const int width = columns() - kLabelColumns;
  const bool coloured = isatty(STDOUT_FILENO) == 1 && std::getenv("NO_COLOR") == nullptr;
  Canvas canvas(width, end_s, top_hz);
  for (std::size_t i = 0; i < curves.size(); ++i) canvas.draw(curves[i], static_cast<int>(i));

  fmt::print("steps/s of a move that just comes to cruise\n");
  constexpr int kRowsPerLabel = 5;
  for (int row = 0; row < kRows; ++row) {
    const double speed_hz = top_hz * (1 - static_cast<double>(row) / (kRows - 1));
    const std::string label =
        row % kRowsPerLabel == 0 ? fmt::format("{:.6g}", speed_hz) : std::string();
    fmt::print("{:>9} │{}\n", label, canvas.row(row, coloured));
  }
  std::string axis;
  for (int i = 0; i < width; ++i) axis += "─";
  const std::string end = fmt::format("{:.6g} ms", end_s * 1e3);
  fmt::print("{:>9} └{}\n{:>11}0{:>{}}\n", "", axis, "", end, width - 1);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (coloured) {
      fmt::print("\033[{}m{}\033[0m\n", kColours[i % kColours.size()], names[i]);
    } else {
      fmt::print("{}\n", names[i]);
    }
  }
  return kDone;
}

}  // namespace bushtab
