// plot --svg and --png: speed over steps, speed over time and acceleration of tables, each in a
// panel of its own, all tables in the same one.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "commands.h"
#include "curve.h"
#include "drawing.h"
#include "open_table.h"
#include "tables/store/atomic_file.h"

namespace bushtab {
namespace {

constexpr int kWidth = 900;
constexpr int kPanelHeight = 240;
constexpr int kLegendLine = 20;
constexpr int kMargin = 16;
constexpr double kPlotLeft = 96;
constexpr double kPlotRight = kWidth - 28.0;
constexpr double kPlotTop = 30;     // below a panel's top, where its title is
constexpr double kPlotBottom = 44;  // above its bottom, where its axis has numbers and a unit
constexpr double kTickLength = 5;
constexpr double kCurveWidth = 1.75;
constexpr double kClosestDots = 0.5;  // pixels: more cannot be seen
constexpr int kTicks = 6;
constexpr std::uint32_t kAxisColour = 0x404040;
constexpr std::uint32_t kGridColour = 0xDDDDDD;
// Okabe and Ito's: told apart by the colour-blind too. Past them the lines are dashed.
constexpr std::array<std::uint32_t, 7> kColours{0x0072B2, 0xD55E00, 0x009E73, 0xCC79A7,
                                                0x56B4E9, 0xE69F00, 0x000000};
// Codes are whole numbers, so from one step to the next the speed stands still or jumps. The mean
// over this share of the longest move shows what a motor feels.
constexpr int kAccelerationWindows = 120;

struct Range {
  double low = 0;
  double high = 0;
};

struct Panel {
  std::string title;
  std::string x_title;
  std::vector<std::vector<Dot>> curves;  // in the units of the axes
  Range x;
  Range y;
};

Stroke stroke_of(std::size_t table) {
  return {kColours[table % kColours.size()], kCurveWidth, table >= kColours.size()};
}

// 1, 2 or 5 times a power of ten, for about kTicks of them.
double tick_distance(const Range& range) {
  const double wanted = (range.high - range.low) / kTicks;
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= wanted) return factor * power;
  }
  return 10 * power;
}

// The whole of the curves and zero, to the next ticks upwards and downwards.
Range range_of(const Panel& panel, double Dot::* axis, bool to_ticks) {
  Range range;
  for (const auto& curve : panel.curves) {
    for (const Dot& dot : curve) {
      range.low = std::min(range.low, dot.*axis);
      range.high = std::max(range.high, dot.*axis);
    }
  }
  if (range.high == range.low) range.high = 1;
  if (!to_ticks) return range;
  const double distance = tick_distance(range);
  return {std::floor(range.low / distance) * distance, std::ceil(range.high / distance) * distance};
}

void draw_panel(Drawing& drawing, const Panel& panel, double top) {
  const double upper = top + kPlotTop;
  const double lower = top + kPanelHeight - kPlotBottom;
  const auto x = [&](double value) {
    return kPlotLeft +
           (value - panel.x.low) / (panel.x.high - panel.x.low) * (kPlotRight - kPlotLeft);
  };
  const auto y = [&](double value) {
    return lower - (value - panel.y.low) / (panel.y.high - panel.y.low) * (lower - upper);
  };
  const Stroke axis{kAxisColour, 1, false};
  const Stroke grid{kGridColour, 1, false};
  drawing.text({kPlotLeft, top + kPlotTop - 10}, Anchor::kStart, panel.title);
  const double y_distance = tick_distance(panel.y);
  for (int i = static_cast<int>(std::lround(panel.y.low / y_distance));
       i * y_distance <= panel.y.high * (1 + 1e-9); ++i) {
    const double at = y(i * y_distance);
    drawing.line({{kPlotLeft, at}, {kPlotRight, at}}, i == 0 ? axis : grid);
    drawing.text({kPlotLeft - 2 * kTickLength, at + kTextSize / 3.0}, Anchor::kEnd,
                 fmt::format("{:.10g}", i * y_distance));
  }
  const double x_distance = tick_distance(panel.x);
  for (int i = 0; i * x_distance <= panel.x.high * (1 + 1e-9); ++i) {
    const double at = x(i * x_distance);
    drawing.line({{at, lower}, {at, lower + kTickLength}}, axis);
    drawing.text({at, lower + kTickLength + kTextSize}, Anchor::kMiddle,
                 fmt::format("{:.10g}", i * x_distance));
  }
  drawing.text({kPlotRight, lower + kTickLength + 2.2 * kTextSize}, Anchor::kEnd, panel.x_title);
  drawing.line({{kPlotLeft, upper}, {kPlotLeft, lower}, {kPlotRight, lower}}, axis);
  for (std::size_t i = 0; i < panel.curves.size(); ++i) {
    std::vector<Dot> dots;
    for (const Dot& value : panel.curves[i]) {
      const Dot dot{x(value.x), y(value.y)};
      const bool last = &value == &panel.curves[i].back();
      if (dots.empty() || last ||
          std::hypot(dot.x - dots.back().x, dot.y - dots.back().y) >= kClosestDots) {
        dots.push_back(dot);
      }
    }
    drawing.line(dots, stroke_of(i));
  }
}

double speed_at(const std::vector<CurveStep>& steps, double time_s) {
  const auto after = std::find_if(steps.begin(), steps.end(), [time_s](const CurveStep& step) {
    return step.middle_s() >= time_s;
  });
  if (after == steps.begin()) return after->speed_hz();
  if (after == steps.end()) return steps.back().speed_hz();
  const CurveStep& before = *(after - 1);
  const double share = (time_s - before.middle_s()) / (after->middle_s() - before.middle_s());
  return before.speed_hz() + share * (after->speed_hz() - before.speed_hz());
}

std::vector<Dot> accelerations(const std::vector<CurveStep>& steps, double window_s) {
  std::vector<Dot> dots;
  const double end_s = steps.back().middle_s();
  for (double from_s = steps.front().middle_s(); from_s < end_s; from_s += window_s) {
    const double to_s = std::min(from_s + window_s, end_s);
    const double value = (speed_at(steps, to_s) - speed_at(steps, from_s)) / (to_s - from_s);
    dots.push_back({from_s * 1e3, value});
    dots.push_back({to_s * 1e3, value});
  }
  return dots;
}

std::vector<Panel> panels_of(const std::vector<Curve>& curves) {
  Panel over_steps{"Speed in steps/s over steps", "step", {}, {}, {}};
  Panel over_time{"Speed in steps/s over time", "ms", {}, {}, {}};
  Panel acceleration{"Acceleration in steps/s² over time", "ms", {}, {}, {}};
  double longest_s = 0;
  for (const Curve& curve : curves) longest_s = std::max(longest_s, curve.steps.back().middle_s());
  for (const Curve& curve : curves) {
    auto& steps = over_steps.curves.emplace_back();
    auto& times = over_time.curves.emplace_back();
    for (const CurveStep& step : curve.steps) {
      steps.push_back({static_cast<double>(step.step), step.speed_hz()});
      times.push_back({step.middle_s() * 1e3, step.speed_hz()});
    }
    acceleration.curves.push_back(accelerations(curve.steps, longest_s / kAccelerationWindows));
  }
  std::vector<Panel> panels{over_steps, over_time, acceleration};
  for (Panel& panel : panels) {
    panel.x = range_of(panel, &Dot::x, false);
    panel.y = range_of(panel, &Dot::y, true);
  }
  // One above the other, so that a time is at the same place in both.
  panels[2].x = panels[1].x;
  return panels;
}

void draw(Drawing& drawing, const std::string& heading, const std::vector<Curve>& curves,
          const std::vector<Panel>& panels) {
  double top = kMargin;
  drawing.text({kPlotLeft, top + kTextSize}, Anchor::kStart, heading);
  top += kLegendLine;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const double middle = top + kLegendLine / 2.0;
    drawing.line({{kPlotLeft, middle}, {kPlotLeft + 32, middle}}, stroke_of(i));
    drawing.text({kPlotLeft + 42, middle + kTextSize / 3.0}, Anchor::kStart, curves[i].legend);
    top += kLegendLine;
  }
  for (const Panel& panel : panels) {
    draw_panel(drawing, panel, top);
    top += kPanelHeight;
  }
}

}  // namespace

int draw_pictures(const Places& places, const Plot& wanted) {
  std::vector<Curve> curves;
  for (const std::string& name : wanted.tables) {
    const auto table = open_table(places, name);
    if (!table) return refuse(table.error());
    std::string legend = (*table)->name();
    if ((*table)->revision() > 0) legend += fmt::format(", revision {}", (*table)->revision());
    curves.push_back({legend, curve_of(**table)});
  }
  const auto written =
      write_pictures("Moves that just come to cruise:", curves, wanted.svg, wanted.png);
  return written ? kDone : refuse(written.error());
}

bushd::Result<void> write_pictures(const std::string& heading, const std::vector<Curve>& curves,
                                   const std::string& svg, const std::string& png) {
  const std::vector<Panel> panels = panels_of(curves);
  const int height = kMargin + kLegendLine * static_cast<int>(1 + curves.size()) +
                     kPanelHeight * static_cast<int>(panels.size());
  const auto write = [&](const std::string& path, auto make_drawing) -> bushd::Result<void> {
    if (path.empty()) return {};
    const auto drawing = make_drawing(kWidth, height);
    draw(*drawing, heading, curves, panels);
    const auto bytes = drawing->finish();
    if (!bytes) return bushd::fail(bytes.error());
    return bushd::tables::store::replace_file(path, *bytes);
  };
  if (auto written = write(svg, svg_drawing); !written) return written;
  return write(png, png_drawing);
}

}  // namespace bushtab
