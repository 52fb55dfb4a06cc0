// tui: the editor on a terminal, over a table of the store.
#include <fmt/core.h>

#include <optional>
#include <string>
#include <utility>

#include "commands.h"
#include "open_table.h"
#include "tables/store/atomic_file.h"
#include "tables/table_text.h"
#include "terminal.h"

namespace bushtab {
namespace {

namespace tables = bushd::tables;

// The table that is edited, as it stands in its file.
class Original {
 public:
  Original(Home home, tables::store::Stored stored)
      : home_(std::move(home)), stored_(std::move(stored)), name_(stored_.content.name) {}

  bushd::Result<std::string> text_with(tables::TableContent content) const {
    content.name = name_;
    return tables::rewrite(stored_.text, content, path().string());
  }

  bushd::Result<std::uint32_t> save(const tables::TableContent& content, const std::string& note) {
    const auto text = text_with(content);
    if (!text) return bushd::fail(text.error());
    return taken(home_.store.save(home_.name, stored_.text, *text, note));
  }

  // From then on the other table is the one that is edited.
  bushd::Result<std::uint32_t> save_as(Home home, const tables::TableContent& content) {
    Original other(std::move(home), stored_);
    other.name_ = other.home_.name;
    const auto text = other.text_with(content);
    if (!text) return bushd::fail(text.error());
    auto created = other.taken(create_in(other.home_, *text, "tui, copy of " + home_.name));
    if (created) *this = std::move(other);
    return created;
  }

  std::filesystem::path path() const { return home_.store.path_of(home_.name); }
  const std::string& name() const { return home_.name; }

 private:
  // What the next save starts from is what this one wrote, not what may stand there by now.
  bushd::Result<std::uint32_t> taken(bushd::Result<std::uint32_t> revision) {
    if (!revision) return revision;
    auto written = home_.store.read(home_.name, std::to_string(*revision));
    if (!written) return bushd::fail(written.error());
    stored_ = std::move(*written);
    return revision;
  }

  Home home_;
  tables::store::Stored stored_;
  std::string name_;
};

// Returns whether all was saved.
bool answer(TableEditor& editor, const bushd::Result<std::uint32_t>& saved) {
  if (saved) {
    editor.saved(*saved);
  } else {
    editor.refused(saved.error().text() +
                   ". Your changes are still here: w saves them as another table");
  }
  return saved.has_value();
}

// Returns false when the editor is done with.
bool grant(const Places& places, Original& original, TableEditor& editor, TableEditor::Wish wish) {
  switch (wish) {
    case TableEditor::Wish::kNone:
      return true;
    case TableEditor::Wish::kQuit:
      return false;
    case TableEditor::Wish::kSave:
    case TableEditor::Wish::kSaveAndQuit: {
      const bool saved = answer(editor, original.save(editor.content(), "tui: " + editor.note()));
      return !saved || wish == TableEditor::Wish::kSave;
    }
    case TableEditor::Wish::kSaveAs:
      break;
  }
  // Another table lives beside this one, unless it is given as a path.
  const Places beside{original.path().parent_path().string(), places.history};
  auto home = home_of(beside, editor.wished_name());
  if (home) {
    answer(editor, original.save_as(std::move(*home), editor.content()));
  } else {
    editor.refused(home.error().text());
  }
  return true;
}

// False: the terminal went away, or the program was told to end.
bool edit_in(Terminal& terminal, const Places& places, Original& original, TableEditor& editor) {
  while (true) {
    // A held key that comes faster than it can be drawn leaves nothing to draw when it is let go.
    if (!terminal.key_waits()) terminal.draw(render(editor, terminal.window()));
    const Terminal::Input input = terminal.wait();
    switch (input.event) {
      case Terminal::Event::kResized:
        break;
      case Terminal::Event::kGone:
        return false;
      case Terminal::Event::kInterrupted:
        if (!grant(places, original, editor, editor.interrupt())) return true;
        break;
      case Terminal::Event::kKey:
        if (!grant(places, original, editor, editor.press(input.key))) return true;
        break;
    }
  }
}

// What is to be said once the terminal is as it was; nothing: all was saved.
std::optional<bushd::Error> keep_aside(const Original& original, const TableEditor& editor) {
  if (!editor.changed()) return std::nullopt;
  const auto text = original.text_with(editor.content());
  if (!text) return text.error();
  const auto kept =
      tables::store::keep_aside(original.path().parent_path(), original.name(), *text);
  if (!kept) return kept.error();
  return bushd::Error{
      .message = fmt::format("was not saved and stays as it was; what it would be is in {}",
                             kept->string()),
      .file = original.path().string()};
}

}  // namespace

int tui(const Places& places, const Tui& wanted) {
  if (!Terminal::is_there()) {
    return refuse(bushd::Error{
        .message = "tui needs a terminal for input and output; in scripts use set, insert, delete, "
                   "scale and resample"});
  }
  auto limits = load_limits(wanted.limits);
  if (!limits) return refuse(limits.error());
  auto home = home_of(places, wanted.table);
  if (!home) return refuse(home.error());
  auto stored = read_home(*home);
  if (!stored) return refuse(stored.error());
  TableEditor editor(stored->content, stored->content.revision,
                     {.limits = std::move(*limits), .steps = wanted.steps});
  Original original(std::move(*home), std::move(*stored));

  tell_kept(original.path(), original.name());
  std::optional<bushd::Error> unsaved;
  {
    auto terminal = Terminal::open();
    if (!terminal) return refuse(terminal.error());
    // Kept before the terminal is given back: that lets signals through, and the next may kill.
    if (!edit_in(**terminal, places, original, editor)) unsaved = keep_aside(original, editor);
  }
  return unsaved ? refuse(*unsaved) : kDone;
}

}  // namespace bushtab
