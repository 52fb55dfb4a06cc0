#include "table_editor.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

namespace bushtab {
namespace {

namespace tables = bushd::tables;
using tables::TableContent;

// Undoing so much of a table with 65535 codes takes 65 MB.
constexpr std::size_t kMaxUndo = 500;
constexpr std::size_t kPageShare = 20;  // a page is this share of all codes
constexpr double kDragFactor = 1.01;
constexpr int kMaxDragPercent = 1200;  // 1.01^1200 is more than all codes
constexpr int kMaxDragCodes = 65535;
constexpr std::size_t kMaxTyped = tables::kMaxNameLength;

template <class Number>
std::optional<Number> number_of(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number number{};
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
  if (parsed.ec != std::errc{} || parsed.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string held_text(std::size_t held) {
  if (held == 0) return "";
  return held == 1 ? ", 1 code held by its neighbour"
                   : fmt::format(", {} codes held by their neighbours", held);
}

}  // namespace

TableEditor::TableEditor(TableContent content, std::uint32_t revision, Watched watched)
    : watched_(std::move(watched)), saved_(content), revision_(revision) {
  show(std::move(content));
}

std::optional<CodeRange> TableEditor::selection() const {
  if (!mark_) return std::nullopt;
  return CodeRange{std::min(*mark_, cursor()), std::max(*mark_, cursor())};
}

std::string TableEditor::range_text() const {
  const CodeRange all = range();
  const std::string first = place_text(content(), all.first);
  return all.first == all.last ? first : first + " to " + place_text(content(), all.last);
}

void TableEditor::saved(std::uint32_t revision) {
  saved_ = content();
  revision_ = revision;
  message_ = fmt::format("saved as revision {}", revision);
}

void TableEditor::refused(std::string why) {
  message_ = std::move(why);
}

TableEditor::Wish TableEditor::press(Key key) {
  message_.clear();
  switch (mode_) {
    case Mode::kPrompt:
      return press_in_prompt(key);
    case Mode::kAskQuit:
      return press_in_question(key);
    case Mode::kAskSave:
      return press_in_save_question(key);
    case Mode::kHelp:
      mode_ = Mode::kCodes;
      return Wish::kNone;
    case Mode::kCodes:
      break;
  }
  if (drag_by(key)) return Wish::kNone;
  end_drag();
  if (move(key)) return Wish::kNone;
  return press_command(key);
}

TableEditor::Wish TableEditor::interrupt() {
  return press(mode_ == Mode::kCodes ? U'q' : key::kEscape);
}

bool TableEditor::move(Key key) {
  const std::size_t last = code_count(content()) - 1;
  const std::size_t page = std::max<std::size_t>(last / kPageShare, 1);
  const std::size_t at = cursor();
  switch (key) {
    case key::kLeft:
      now_.cursor = at - std::min<std::size_t>(at, 1);
      return true;
    case key::kRight:
      now_.cursor = std::min(at + 1, last);
      return true;
    case key::kPageUp:
      now_.cursor = at - std::min(at, page);
      return true;
    case key::kPageDown:
      now_.cursor = std::min(at + page, last);
      return true;
    case key::kHome:
      now_.cursor = 0;
      return true;
    case key::kEnd:
      now_.cursor = last;
      return true;
    case key::kTab: {  // the cruise delay, then the end, then the beginning
      const std::size_t cruise = content().accel.size();
      now_.cursor = at < cruise ? cruise : at < last ? last : 0;
      return true;
    }
    default:
      return false;
  }
}

bool TableEditor::drag_by(Key key) {
  switch (key) {
    case key::kUp:
    case U'-':
      drag(0, -1);
      return true;
    case key::kDown:
    case U'+':
      drag(0, 1);
      return true;
    case U'>':
      drag(1, 0);
      return true;
    case U'<':
      drag(-1, 0);
      return true;
    default:
      return false;
  }
}

void TableEditor::drag(int percent, int codes) {
  if (!drag_) drag_ = Drag{now_, range()};
  Drag wanted = *drag_;
  wanted.percent = std::clamp(wanted.percent + percent, -kMaxDragPercent, kMaxDragPercent);
  wanted.codes = std::clamp(wanted.codes + codes, -kMaxDragCodes, kMaxDragCodes);
  const double factor = std::pow(kDragFactor, -wanted.percent);
  auto [changed, held] = change_codes(wanted.before.content, wanted.range, [&](std::uint16_t code) {
    return std::ceil(code * factor - 1e-6) + wanted.codes;
  });
  const bool same = changed == content();
  // Further against a neighbour leads nowhere, and would have to be taken back again.
  if (same && held > 0) {
    message_ = range_text() + ": held by the code beside it";
    return;
  }
  if (!same && !show(std::move(changed))) return;
  drag_ = std::move(wanted);
  if (!same && !drag_->recorded) {
    record(drag_->before);
    drag_->recorded = true;
  }
  message_ = range_text() + ": ";
  if (drag_->percent != 0) {
    message_ += fmt::format("speed {:+.3g} %", 100 * (std::pow(kDragFactor, drag_->percent) - 1));
  }
  if (drag_->codes != 0 || drag_->percent == 0) {
    message_ += fmt::format("{}codes {:+}", drag_->percent != 0 ? ", " : "", drag_->codes);
  }
  message_ += held_text(held);
}

void TableEditor::end_drag() {
  // Dragged there and back: nothing to undo.
  if (drag_ && drag_->recorded && drag_->before.content == content()) undo_.pop_back();
  drag_.reset();
}

TableEditor::Wish TableEditor::press_command(Key key) {
  if (key >= U'0' && key <= U'9') {
    ask(Prompt::kCode, std::string(1, static_cast<char>(key)));
    return Wish::kNone;
  }
  switch (key) {
    case U'%':
      ask(Prompt::kPercent);
      break;
    case U'g':
      ask(Prompt::kGoTo);
      break;
    case U'w':
      ask(Prompt::kName);
      break;
    case U' ':
      mark_ = mark_ ? std::nullopt : std::optional(cursor());
      break;
    case key::kEscape:
      mark_.reset();
      break;
    case U'i':
      if (change_to(with_copy(content(), cursor()))) message_ = range_text() + ": once more";
      break;
    case U'd':
    case key::kDelete:
      remove();
      break;
    case U'm':
      toggle_mirror();
      break;
    case U'u':
      step(undo_, redo_, "undo");
      break;
    case U'r':
    case key::kCtrlR:
      step(redo_, undo_, "redo");
      break;
    case U'z':
      zoomed_ = !zoomed_;
      break;
    case U'?':
      mode_ = Mode::kHelp;
      break;
    case U's':
    case key::kCtrlS:
      if (changed()) return wish_to_save(Wish::kSave);
      message_ = "nothing to save";
      break;
    case U'q':
      if (!changed()) return Wish::kQuit;
      mode_ = Mode::kAskQuit;
      break;
    default:
      message_ = "? lists the keys";
  }
  return Wish::kNone;
}

TableEditor::Wish TableEditor::press_in_question(Key key) {
  mode_ = Mode::kCodes;
  if (key == U's') return wish_to_save(Wish::kSaveAndQuit);
  return key == U'd' ? Wish::kQuit : Wish::kNone;
}

TableEditor::Wish TableEditor::press_in_save_question(Key key) {
  mode_ = Mode::kCodes;
  return key == U'y' ? asked_save_ : Wish::kNone;
}

TableEditor::Wish TableEditor::wish_to_save(Wish wish) {
  if (errors() == 0) return wish;
  asked_save_ = wish;
  mode_ = Mode::kAskSave;
  return Wish::kNone;
}

std::size_t TableEditor::errors() const {
  return static_cast<std::size_t>(
      std::count_if(diagnostics_.begin(), diagnostics_.end(), [](const auto& diagnostic) {
        return diagnostic.severity == tables::profiles::Severity::kError;
      }));
}

void TableEditor::ask(Prompt prompt, std::string text) {
  mode_ = Mode::kPrompt;
  prompt_ = prompt;
  typed_ = std::move(text);
}

std::string TableEditor::prompt_text() const {
  switch (prompt_) {
    case Prompt::kCode:
      return fmt::format("{}, code {}..{}: {}", range_text(), tables::kCode.least,
                         tables::kCode.most, typed_);
    case Prompt::kGoTo:
      return "go to (12: accel[12], d12: decel[12], c: cruise): " + typed_;
    case Prompt::kPercent:
      return fmt::format("{}, percent faster (-5: slower): {}", range_text(), typed_);
    case Prompt::kName:
      break;
  }
  return "save as another table: " + typed_;
}

TableEditor::Wish TableEditor::press_in_prompt(Key key) {
  if (key == key::kEnter) {
    mode_ = Mode::kCodes;
    return answer();
  }
  if (key == key::kEscape) mode_ = Mode::kCodes;
  type_key(typed_, key, kMaxTyped);
  return Wish::kNone;
}

TableEditor::Wish TableEditor::answer() {
  switch (prompt_) {
    case Prompt::kCode:
      enter_code(typed_);
      break;
    case Prompt::kGoTo:
      go_to(typed_);
      break;
    case Prompt::kPercent:
      enter_percent(typed_);
      break;
    case Prompt::kName:
      if (typed_.empty()) break;
      wished_name_ = typed_;
      return wish_to_save(Wish::kSaveAs);
  }
  return Wish::kNone;
}

void TableEditor::enter_code(std::string_view text) {
  const auto code = number_of<std::uint16_t>(text);
  if (!code || *code == 0) {
    message_ = fmt::format("\"{}\" is not a code; allowed: {}..{}", text, tables::kCode.least,
                           tables::kCode.most);
    return;
  }
  if (change_to(with_code(content(), range(), *code))) {
    message_ = fmt::format("{}: {}", range_text(), *code);
  }
}

void TableEditor::go_to(std::string_view text) {
  const std::size_t cruise = content().accel.size();
  if (text == "c") {
    now_.cursor = cruise;
    return;
  }
  const bool decel = text.starts_with('d');
  const std::size_t codes = decel ? code_count(content()) - cruise - 1 : cruise;
  const auto index = number_of<std::size_t>(decel ? text.substr(1) : text);
  if (!index || *index >= codes) {
    message_ = fmt::format("\"{}\" is nowhere; allowed: {}0..{}", text, decel ? "d" : "",
                           (decel ? "d" : "") + std::to_string(codes - 1));
    return;
  }
  now_.cursor = *index + (decel ? cruise + 1 : 0);
}

void TableEditor::enter_percent(std::string_view text) {
  const auto percent = number_of<double>(text);
  if (!percent || !std::isfinite(*percent) || *percent <= -100) {
    message_ = fmt::format("\"{}\" is not a number of percent; allowed: above -100", text);
    return;
  }
  const double factor = 1 / (1 + *percent / 100);
  auto [changed, held] =
      change_codes(content(), range(), [factor](std::uint16_t code) { return code * factor; });
  if (changed == content()) {
    message_ = range_text() + ": no code changes" + held_text(held);
  } else if (change_to(std::move(changed))) {
    message_ = fmt::format("{}: speed {:+} %{}", range_text(), *percent, held_text(held));
  }
}

void TableEditor::toggle_mirror() {
  TableContent content = now_.content;
  if (content.decel) {
    content.decel.reset();
  } else {
    content.decel.emplace(content.accel.rbegin(), content.accel.rend());
  }
  if (!change_to(std::move(content))) return;
  message_ = now_.content.decel ? "each side is changed by itself" : "decel is the mirror of accel";
}

void TableEditor::remove() {
  const std::string what = range_text();
  const std::size_t first = range().first;
  TableContent content = without_codes(now_.content, range());
  if (content == now_.content) {
    message_ = what + ": goes with the last code of accel";
  } else if (change_to(std::move(content))) {
    now_.cursor = std::min(first, code_count(now_.content) - 1);
    mark_.reset();
    message_ = what + ": deleted";
  }
}

bool TableEditor::change_to(TableContent content) {
  if (content == now_.content) return true;
  State before = now_;
  if (!show(std::move(content))) return false;
  record(std::move(before));
  return true;
}

void TableEditor::record(State before) {
  redo_.clear();
  undo_.push_back(std::move(before));
  if (undo_.size() > kMaxUndo) undo_.pop_front();
}

bool TableEditor::show(TableContent content) {
  auto table = tables::make(content);
  if (!table) {
    message_ = table.error().text();
    return false;
  }
  table_ = std::move(*table);
  now_.content = std::move(content);
  const std::size_t last = code_count(now_.content) - 1;
  now_.cursor = std::min(now_.cursor, last);
  if (mark_) mark_ = std::min(*mark_, last);
  curve_ = curve_of(*table_);
  diagnostics_ = tables::profiles::diagnostics(*table_, watched_.limits);
  times_.clear();
  for (const std::uint32_t steps : watched_.steps) {
    times_.push_back({steps, tables::move_time(table_->view(), steps)});
  }
  return true;
}

void TableEditor::step(std::deque<State>& from, std::deque<State>& to, std::string_view verb) {
  if (from.empty()) {
    message_ = fmt::format("nothing to {}", verb);
    return;
  }
  State next = std::move(from.back());
  from.pop_back();
  to.push_back(now_);
  mark_.reset();
  message_ = fmt::format("{}: {}", verb, difference_text(now_.content, next.content));
  show(std::move(next.content));
  now_.cursor = next.cursor;
}

}  // namespace bushtab
