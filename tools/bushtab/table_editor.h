// The full-screen editor of a table without a terminal: keys come in, and what the editor then is
// can be looked at. Whatever is pressed, its content is a table that check() accepts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "code_line.h"
#include "curve.h"
#include "key.h"
#include "tables/move_time.h"
#include "tables/profiles/diagnostics.h"
#include "tables/table.h"

namespace bushtab {

class TableEditor {
 public:
  // What is looked at while codes change.
  struct Watched {
    bushd::tables::profiles::Limits limits{};
    std::vector<std::uint32_t> steps{};  // of moves whose times are shown
  };
  // Precondition: check(content) finds nothing.
  TableEditor(bushd::tables::TableContent content, std::uint32_t revision, Watched watched);

  // What the owner of the file shall do now; it answers a wish to save with saved() or refused().
  // A table in which the check finds errors is saved when that was said twice (kAskSave).
  enum class Wish { kNone, kSave, kSaveAndQuit, kSaveAs, kQuit };
  Wish press(Key key);
  // Ctrl-C: leaves what is being typed, else wants to quit.
  Wish interrupt();
  // The name of the other table of kSaveAs.
  const std::string& wished_name() const { return wished_name_; }
  void saved(std::uint32_t revision);
  void refused(std::string why);

  enum class Mode { kCodes, kPrompt, kAskQuit, kAskSave, kHelp };
  Mode mode() const { return mode_; }
  // In mode kPrompt: the question and what was typed so far.
  std::string prompt_text() const;
  const std::string& message() const { return message_; }

  const bushd::tables::TableContent& content() const { return now_.content; }
  const bushd::tables::Table& table() const { return *table_; }
  std::uint32_t revision() const { return revision_; }
  bool changed() const { return now_.content != saved_; }
  // How many findings of the check are errors.
  std::size_t errors() const;
  // What was changed since the last save; a note for the log.
  std::string note() const { return difference_text(saved_, now_.content); }

  // Places are those of code_line.h, and of the curve's steps.
  std::size_t cursor() const { return now_.cursor; }
  std::optional<CodeRange> selection() const;
  bool zoomed() const { return zoomed_; }

  const std::vector<CurveStep>& curve() const { return curve_; }
  const std::vector<bushd::tables::profiles::Diagnostic>& diagnostics() const {
    return diagnostics_;
  }
  struct Time {
    std::uint32_t steps = 0;
    bushd::tables::MoveTime move{};
  };
  const std::vector<Time>& times() const { return times_; }

 private:
  struct State {
    bushd::tables::TableContent content;
    std::size_t cursor = 0;
  };
  // A range that is moved by several keys is one change, always made from what it was before.
  struct Drag {
    State before;
    CodeRange range;
    int percent = 0;  // of speed, one on top of the other
    int codes = 0;
    bool recorded = false;  // as a change that can be undone
  };
  enum class Prompt { kCode, kGoTo, kPercent, kName };

  Wish press_command(Key key);
  Wish press_in_prompt(Key key);
  Wish press_in_question(Key key);
  Wish press_in_save_question(Key key);
  // `wish`, at once or when the question was answered.
  Wish wish_to_save(Wish wish);
  bool move(Key key);
  bool drag_by(Key key);
  void drag(int percent, int codes);
  void end_drag();
  void ask(Prompt prompt, std::string text = {});
  Wish answer();
  void enter_code(std::string_view text);
  void go_to(std::string_view text);
  void enter_percent(std::string_view text);
  void toggle_mirror();
  void remove();

  CodeRange range() const { return selection().value_or(CodeRange{cursor(), cursor()}); }
  std::string range_text() const;
  // A new state that can be undone. False: it would be no table; the message says why.
  bool change_to(bushd::tables::TableContent content);
  bool show(bushd::tables::TableContent content);
  void record(State before);
  // To a state of undo_ or redo_, the other one takes what is left.
  void step(std::deque<State>& from, std::deque<State>& to, std::string_view verb);

  Watched watched_;
  State now_;
  bushd::tables::TableContent saved_;
  std::uint32_t revision_;
  std::optional<std::size_t> mark_;
  std::deque<State> undo_;
  std::deque<State> redo_;
  std::optional<Drag> drag_;

  Mode mode_ = Mode::kCodes;
  Prompt prompt_ = Prompt::kCode;
  std::string typed_;
  std::string wished_name_;
  Wish asked_save_ = Wish::kNone;  // in mode kAskSave: what waits for the answer
  std::string message_;
  bool zoomed_ = false;

  bushd::tables::TablePtr table_;
  std::vector<CurveStep> curve_;
  std::vector<bushd::tables::profiles::Diagnostic> diagnostics_;
  std::vector<Time> times_;
};

}  // namespace bushtab
