// plot: the speed over time of a table's two sides, or that of an envelope over its way, in the
// terminal.
#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "base/printable.h"
#include "canvas.h"
#include "commands.h"
#include "curve.h"
#include "open_table.h"
#include "utf8.h"

namespace bushtab {
namespace {

constexpr int kDefaultColumns = 80;
constexpr int kMinColumns = 40;
constexpr int kWidestPlot = 400;
constexpr int kRows = 16;
constexpr int kLabelColumns = 11;  // "123456.7 |" and a space
constexpr std::array<const char*, 6> kAnsiColours{"36", "33", "35", "32", "31", "34"};

const char* colour_of(int table) {
  return kAnsiColours[static_cast<std::size_t>(table) % kAnsiColours.size()];
}

int columns() {
  winsize size{};
  int wanted = kDefaultColumns;
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    wanted = size.ws_col;
  } else if (const char* text = std::getenv("COLUMNS"); text != nullptr && std::atoi(text) > 0) {
    wanted = std::atoi(text);
  }
  return std::clamp(wanted, kMinColumns, kWidestPlot);
}

std::string row_text(const Canvas& canvas, int width, int row, bool coloured) {
  std::string text;
  for (int column = 0; column < width; ++column) {
    std::string glyph;
    append_utf8(glyph, canvas.character(column, row));
    text += coloured && canvas.has_dots(column, row)
                ? fmt::format("\033[{}m{}\033[0m", colour_of(canvas.colour(column, row)), glyph)
                : glyph;
  }
  return text;
}

}  // namespace

int plot(const Places& places, const std::vector<std::string>& names) {
  std::vector<bushd::tables::TablePtr> all;
  for (const std::string& name : names) {
    auto table = open_table(places, name);
    if (!table) return refuse(table.error());
    all.push_back(std::move(*table));
  }
  draw_in_terminal(all, names);
  return kDone;
}

void draw_in_terminal(const std::vector<bushd::tables::TablePtr>& all,
                      const std::vector<std::string>& names) {
  std::vector<Curve> curves;
  for (std::size_t i = 0; i < all.size(); ++i) curves.push_back({names[i], curve_of(*all[i])});
  draw_in_terminal("steps/s of a move that just comes to cruise", curves, Over::kTime);
}

void draw_in_terminal(const std::string& title, const std::vector<Curve>& curves, Over over) {
  double end_s = 0;
  double top_hz = 0;
  std::uint64_t end_step = 1;
  for (const Curve& curve : curves) {
    for (const CurveStep& step : curve.steps) top_hz = std::max(top_hz, step.speed_hz());
    end_s = std::max(end_s, static_cast<double>(curve.steps.back().time_ns) * 1e-9);
    end_step = std::max(end_step, curve.steps.back().step);
  }
  const int width = columns() - kLabelColumns;
  const bool coloured = isatty(STDOUT_FILENO) == 1 && std::getenv("NO_COLOR") == nullptr;
  Canvas canvas(width, kRows);
  const auto place = [&](const CurveStep& step) {
    const double across = over == Over::kTime
                              ? step.middle_s() / end_s
                              : static_cast<double>(step.step) / static_cast<double>(end_step);
    return Canvas::Place{across, step.speed_hz() / top_hz};
  };
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const auto& curve = curves[i].steps;
    for (std::size_t step = 0; step < curve.size(); ++step) {
      canvas.line(place(curve[step == 0 ? 0 : step - 1]), place(curve[step]), static_cast<int>(i));
    }
  }

  fmt::print("{}\n", bushd::printable(title));
  constexpr int kRowsPerLabel = 5;
  for (int row = 0; row < kRows; ++row) {
    const double speed_hz = top_hz * (1 - static_cast<double>(row) / (kRows - 1));
    const std::string label =
        row % kRowsPerLabel == 0 ? fmt::format("{:.6g}", speed_hz) : std::string();
    fmt::print("{:>9} │{}\n", label, row_text(canvas, width, row, coloured));
  }
  std::string axis;
  for (int i = 0; i < width; ++i) axis += "─";
  const std::string end = over == Over::kTime ? fmt::format("{:.6g} ms", end_s * 1e3)
                                              : fmt::format("{} steps", end_step);
  fmt::print("{:>9} └{}\n{:>11}0{:>{}}\n", "", axis, "", end, width - 1);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::string name = bushd::printable(curves[i].legend);
    if (coloured) {
      fmt::print("\033[{}m{}\033[0m\n", colour_of(static_cast<int>(i)), name);
    } else {
      fmt::print("{}\n", name);
    }
  }
}

}  // namespace bushtab
