#include "editor_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "curve_view.h"
#include "diagnostic_text.h"
#include "utf8.h"

namespace bushtab {
namespace {

using bushd::tables::profiles::Severity;

constexpr int kRoomyRows = 12;  // from here on messages have a line of their own
constexpr int kTallRows = 20;   // from here on there is room for several diagnostics
constexpr int kMaxDiagnosticLines = 5;
constexpr int kMaxMessageLines = 4;
constexpr int kMinCurveRows = 5;
constexpr int kCodeLabelColumns = 13;  // "accel[65534] "
constexpr int kCodeColumns = 6;
constexpr const char* kQuestion =
    "Changes are not saved. s: save and quit, d: discard them, any other key: go on";
constexpr std::array<std::pair<const char*, const char*>, 9> kShortHelp{{{"?", "keys"},
                                                                         {"←→", "move"},
                                                                         {"↑↓", "speed"},
                                                                         {"0-9", "code"},
                                                                         {"Space", "mark"},
                                                                         {"u", "undo"},
                                                                         {"r", "redo"},
                                                                         {"s", "save"},
                                                                         {"q", "quit"}}};

// Where things are, from top to bottom. A window that is too small for all has less of it, what
// matters most stays.
struct Layout {
  int title = 0;
  int curve = 0;
  int info = 0;
  int codes = 0;
  int times = 0;
  int diagnostics = 0;
  int message = 0;
  int help = 0;
};

Layout lay_out(int rows, int message_lines, int diagnostic_lines, int first_diagnostic_lines,
               int code_rows) {
  Layout layout;
  int left = rows;
  const auto take = [&left](int wanted) {
    const int taken = std::clamp(wanted, 0, left);
    left -= taken;
    return taken;
  };
  if (rows >= kRoomyRows) {
    layout.help = take(1);
    layout.message = take(std::clamp(message_lines, 1, kMaxMessageLines));
  } else {
    layout.message = take(std::min(message_lines, kMaxMessageLines));
    if (layout.message == 0) layout.help = take(1);
  }
  layout.codes = take(1);
  layout.info = take(1);
  layout.title = take(1);
  layout.diagnostics = take(1);
  layout.times = take(1);
  if (rows >= kRoomyRows) {
    const int wanted = rows >= kTallRows ? diagnostic_lines : first_diagnostic_lines;
    layout.diagnostics += take(std::min(wanted, kMaxDiagnosticLines) - 1);
  }
  const int codes_too = std::min(left / 3, code_rows - layout.codes);
  if (left - codes_too >= kMinCurveRows) layout.curve = take(left - codes_too);
  layout.codes += take(left);
  return layout;
}

std::vector<std::string> wrapped(const std::string& text, int columns) {
  std::vector<std::string> lines;
  std::string line;
  std::size_t width = 0;
  for (const char32_t c : from_utf8(text)) {
    if (width == static_cast<std::size_t>(columns)) {
      // At a blank, if there is one in the line's second half.
      const std::size_t blank = line.rfind(' ');
      std::string rest;
      if (c != U' ' && blank != std::string::npos && blank > line.size() / 2) {
        rest = line.substr(blank + 1);
        line.resize(blank);
      }
      lines.push_back(std::move(line));
      width = from_utf8(rest).size();
      line = std::move(rest);
      if (c == U' ') continue;
    }
    append_utf8(line, c);
    ++width;
  }
  if (!line.empty()) lines.push_back(std::move(line));
  return lines;
}

std::string said(const TableEditor& editor) {
  switch (editor.mode()) {
    case TableEditor::Mode::kPrompt:
      return editor.prompt_text() + "_";
    case TableEditor::Mode::kAskQuit:
      return kQuestion;
    case TableEditor::Mode::kAskSave:
      return fmt::format(
          "The check finds {} in this table (above). y: save nevertheless, any other key: go on",
          editor.errors() == 1 ? "an error" : fmt::format("{} errors", editor.errors()));
    default:
      return editor.message();
  }
}

// Rows of a side each begin at an index that is a multiple of their length, so that a code keeps
// its place while others are looked at.
struct CodeRows {
  int left = 0;  // columns of the labels
  std::vector<CodeRange> rows;
  std::size_t cursor_row = 0;
};

CodeRows code_rows_of(const TableEditor& editor, int columns) {
  CodeRows all;
  if (columns >= kCodeLabelColumns + kCodeColumns) all.left = kCodeLabelColumns;
  const auto room = static_cast<std::size_t>(std::max((columns - all.left) / kCodeColumns, 1));
  const std::size_t per_row = room >= 10 ? room / 10 * 10 : room;
  const auto add = [&](std::size_t first, std::size_t end) {
    for (std::size_t at = first; at < end; at += per_row) {
      const CodeRange row{at, std::min(at + per_row, end) - 1};
      if (row.contains(editor.cursor())) all.cursor_row = all.rows.size();
      all.rows.push_back(row);
    }
  };
  const std::size_t cruise = editor.content().accel.size();
  add(0, cruise);
  add(cruise, cruise + 1);
  add(cruise + 1, code_count(editor.content()));
  return all;
}

// What the check found, as wide as the window.
struct DiagnosticLine {
  std::string text;
  Style style = Style::kWarning;
  std::size_t of = 0;  // index of its diagnostic
};

std::vector<DiagnosticLine> diagnostic_lines(const TableEditor& editor, int columns) {
  std::vector<DiagnosticLine> all;
  const auto& found = editor.diagnostics();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Style style = found[i].severity == Severity::kError ? Style::kError : Style::kWarning;
    for (std::string& line : wrapped(text_of(found[i]), columns)) {
      all.push_back({std::move(line), style, i});
    }
  }
  return all;
}

class View {
 public:
  View(const TableEditor& editor, const Window& window)
      : editor_(editor),
        grid_(window.rows, window.columns, window.unicode),
        code_rows_(code_rows_of(editor, window.columns)),
        diagnostics_(diagnostic_lines(editor, window.columns)) {}

  CellGrid draw() {
    const auto lines = wrapped(said(editor_), grid_.columns());
    const Layout layout =
        lay_out(grid_.rows(), static_cast<int>(lines.size()),
                static_cast<int>(std::max<std::size_t>(diagnostics_.size(), 1)),
                static_cast<int>(std::max<std::ptrdiff_t>(
                    std::ranges::count(diagnostics_, 0U, &DiagnosticLine::of), 1)),
                static_cast<int>(code_rows_.rows.size()));
    int row = 0;
    if (layout.title > 0) draw_title(row);
    row += layout.title;
    const int body = layout.curve + layout.info + layout.codes + layout.times + layout.diagnostics;
    if (editor_.mode() == TableEditor::Mode::kHelp) {
      draw_keys(row, body);
    } else {
      draw_body(row, layout);
    }
    row += body;
    for (int i = 0; i < layout.message && i < static_cast<int>(lines.size()); ++i) {
      grid_.put_text(row + i, 0, lines[static_cast<std::size_t>(i)], Style::kKey);
    }
    row += layout.message;
    if (layout.help > 0) draw_help(row);
    return std::move(grid_);
  }

 private:
  void draw_body(int row, const Layout& layout) {
    if (layout.curve > 0) draw_curve(editor_, grid_, row, layout.curve);
    row += layout.curve;
    if (layout.info > 0) grid_.put_text(row, 0, info_text(), Style::kPlain);
    row += layout.info;
    draw_codes(row, layout.codes);
    row += layout.codes;
    if (layout.times > 0) draw_times(row);
    row += layout.times;
    draw_diagnostics(row, layout.diagnostics);
  }

  void draw_title(int row) {
    for (int column = 0; column < grid_.columns(); ++column) {
      grid_.put(row, column, U' ', Style::kTitle);
    }
    grid_.put_text(
        row, 0,
        fmt::format(" {}  {}{}{}", editor_.content().name,
                    editor_.revision() > 0 ? fmt::format("revision {}", editor_.revision())
                                           : "no revision yet",
                    editor_.changed() ? ", changed" : "",
                    editor_.content().decel ? "" : "  (decel mirrors accel)"),
        Style::kTitle);
  }

  void draw_help(int row) {
    int column = 0;
    for (const auto& [key, what] : kShortHelp) {
      column = grid_.put_text(row, column, key, Style::kKey) + 1;
      column = grid_.put_text(row, column, what, Style::kPlain) + 2;
    }
  }

  void draw_keys(int row, int rows) {
    constexpr int kWhatColumn = 14;
    for (const KeyHelp& help : key_help()) {
      if (rows-- <= 0) return;
      grid_.put_text(row, 0, help.keys, Style::kKey);
      grid_.put_text(row++, kWhatColumn, help.what, Style::kPlain);
    }
  }

  std::string info_text() const {
    const auto& content = editor_.content();
    const auto& curve = editor_.curve();
    const std::size_t at = editor_.cursor();
    const CurveStep& step = curve[at];
    std::string where = place_text(content, at);
    if (step.part == CurveStep::Part::kCruise && !content.cruise) where += " (as last of accel)";
    std::string out =
        fmt::format("{}  code {}  {:.10g} us  {:.6g} steps/s", where, code_at(content, at),
                    static_cast<double>(step.delay_ns) * 1e-3, step.speed_hz());
    out += fmt::format("  step {} of {}", at + 1, curve.size());
    if (const auto marked = editor_.selection()) {
      out += fmt::format("  {} codes marked", marked->last - marked->first + 1);
    }
    if (at > 0) out += fmt::format("  {:.6g} steps/s²", acceleration(curve[at - 1], step));
    return out;
  }

  void draw_times(int row) {
    std::string line;
    for (const auto& [steps, move] : editor_.times()) {
      line += fmt::format("{}{} steps {:.3f} ms", line.empty() ? "" : "   ", steps,
                          static_cast<double>(move.time_ns) * 1e-6);
    }
    grid_.put_text(row, 0, line, Style::kPlain);
  }

  void draw_diagnostics(int row, int rows) {
    if (rows > 0 && diagnostics_.empty()) {
      grid_.put_text(row, 0, "check: nothing found", Style::kFaint);
      return;
    }
    const auto shown =
        std::min<std::size_t>(static_cast<std::size_t>(std::max(rows, 0)), diagnostics_.size());
    for (std::size_t i = 0; i < shown; ++i) {
      const DiagnosticLine& line = diagnostics_[i];
      const bool last = i + 1 == shown;
      const std::size_t more = last ? diagnostics_.size() - shown : 0;
      const std::size_t hidden = last ? editor_.diagnostics().size() - line.of - 1 : 0;
      std::string text = line.text;
      if (hidden > 0) {
        text = fmt::format("({} more) {}", hidden, text);
      } else if (more > 0) {
        text = "(goes on) " + text;
      }
      grid_.put_text(row++, 0, text, line.style);
    }
  }

  void draw_codes(int row, int rows);

  const TableEditor& editor_;
  CellGrid grid_;
  CodeRows code_rows_;
  std::vector<DiagnosticLine> diagnostics_;
};

void View::draw_codes(int row, int rows) {
  const auto shown = static_cast<std::size_t>(std::max(rows, 0));
  const std::size_t half_above = code_rows_.cursor_row - std::min(code_rows_.cursor_row, shown / 2);
  const std::size_t all = code_rows_.rows.size();
  const std::size_t top = all <= shown ? 0 : std::min(half_above, all - shown);
  const auto selected = editor_.selection();
  for (std::size_t i = top; i < all && i < top + shown; ++i, ++row) {
    const CodeRange& codes = code_rows_.rows[i];
    int column = code_rows_.left;
    if (column > 0) {
      grid_.put_text(row, 0, place_text(editor_.content(), codes.first), Style::kFaint);
    }
    for (std::size_t at = codes.first; at <= codes.last; ++at, column += kCodeColumns) {
      Style style = selected && selected->contains(at) ? Style::kSelected : Style::kPlain;
      if (at == editor_.cursor()) style = Style::kCursor;
      grid_.put_text(row, column, fmt::format("{:>5}", code_at(editor_.content(), at)), style);
    }
  }
}

}  // namespace

CellGrid render(const TableEditor& editor, const Window& window) {
  return View(editor, window).draw();
}

}  // namespace bushtab
