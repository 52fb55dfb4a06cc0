#include <fmt/core.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "base/printable.h"
#include "commands.h"
#include "json.h"
#include "open_table.h"
#include "tables/store/atomic_file.h"
#include "tables/table_file.h"
#include "tables/table_text.h"
#include "tables/toml_file.h"

namespace bushtab {
namespace {

namespace tables = bushd::tables;
namespace fs = std::filesystem;

int unchanged(const Home& home, bool json) {
  const std::string path = home.store.path_of(home.name).string();
  if (json) return show(Places{}, {{path, true}});
  fmt::print("{}: nothing to change\n", bushd::printable(path));
  return kDone;
}

// The editor may have arguments of its own ("code --wait"), so a shell runs it; the file is a
// parameter of that shell and not part of its text.
bool run_editor(const std::string& editor, const fs::path& file) {
  // Ctrl-C is the editor's, as long as it runs.
  const auto on_interrupt = std::signal(SIGINT, SIG_IGN);
  const auto on_quit = std::signal(SIGQUIT, SIG_IGN);
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGQUIT, on_quit);
    std::signal(SIGPIPE, SIG_DFL);
    const std::string command = editor + " \"$1\"";
    execl("/bin/sh", "sh", "-c", command.c_str(), "sh", file.c_str(), nullptr);
    _exit(127);
  }
  int status = -1;
  while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGQUIT, on_quit);
  return child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bushd::Error editor_failure(const std::string& editor) {
  return {.message = fmt::format(
              "the editor \"{}\" failed; nothing was changed. Set VISUAL or EDITOR", editor)};
}

int kept_there(const fs::path& table, const fs::path& aside, const bushd::Error& why) {
  fmt::print(stderr, "{} stays as it was; your text is in {}\n", bushd::printable(table.string()),
             bushd::printable(aside.string()));
  return refuse(why);
}

std::string editor_of_user() {
  for (const char* variable : {"VISUAL", "EDITOR"}) {
    const char* editor = std::getenv(variable);
    if (editor != nullptr && *editor != '\0') return editor;
  }
  return "vi";
}

}  // namespace

int change(const Places& places, const TableOptions& options, const std::string& note,
           const Change& change) {
  auto home = home_of(places, options.table);
  if (!home) return refuse(home.error());
  const auto old = read_home(*home);
  if (!old) return refuse(old.error());
  const auto content = change(old->content);
  if (!content) return refuse(content.error());
  if (*content == old->content) return unchanged(*home, options.json);
  const auto text = tables::rewrite(old->text, *content, home->store.path_of(home->name).string());
  if (!text) return refuse(text.error());
  return saved(*home, home->store.save(home->name, old->text, *text, note), options.json);
}

void tell_kept(const fs::path& table, const std::string& name) {
  for (const fs::path& kept : tables::store::kept_aside(table.parent_path(), name)) {
    fmt::print(stderr, "{}: a text of this table that was never saved is in {}; it stays there\n",
               bushd::printable(table.string()), bushd::printable(kept.string()));
  }
}

int edit(const Places& places, const TableOptions& options) {
  auto home = home_of(places, options.table);
  if (!home) return refuse(home.error());
  const auto old = read_home(*home);
  if (!old) return refuse(old.error());
  const fs::path path = home->store.path_of(home->name);
  tell_kept(path, home->name);
  const auto aside = tables::store::keep_aside(path.parent_path(), home->name, old->text);
  if (!aside) return refuse(aside.error());
  const std::string editor = editor_of_user();
  const bool edited = run_editor(editor, *aside);
  const auto text = tables::read_text(*aside);
  std::error_code ignored;
  if (text && *text == old->text) {
    fs::remove(*aside, ignored);
    return edited ? unchanged(*home, options.json) : refuse(editor_failure(editor));
  }
  if (text && edited) {
    const auto revision = home->store.save(home->name, old->text, *text, "edit");
    if (revision) {
      fs::remove(*aside, ignored);
      return saved(*home, revision, options.json);
    }
    return kept_there(path, *aside, revision.error());
  }
  // An editor may fail after it has written; what cannot be read may still be what was typed.
  if (!fs::exists(*aside, ignored)) return refuse(editor_failure(editor));
  if (!text) return kept_there(path, *aside, text.error());
  return kept_there(path, *aside, editor_failure(editor));
}

int copy(const Places& places, const Copy& wanted) {
  const auto source = open_table(places, wanted.table);
  if (!source) return refuse(source.error());
  auto home = home_of(places, wanted.to);
  if (!home) return refuse(home.error());
  const auto text = tables::read_text((*source)->path());
  if (!text) return refuse(text.error());
  auto content = tables::parse_content(*text, (*source)->path());
  if (!content) return refuse(content.error());
  content->name = home->name;
  const auto renamed = tables::rewrite(*text, *content, (*source)->path());
  if (!renamed) return refuse(renamed.error());
  return saved(*home, create_in(*home, *renamed, "copy of " + wanted.table), wanted.json);
}

int log(const Places& places, const TableOptions& options) {
  const auto home = home_of(places, options.table);
  if (!home) return refuse(home.error());
  const auto revisions = home->store.log(home->name);
  if (!revisions) return refuse(revisions.error());
  if (revisions->empty()) {
    return refuse(bushd::Error{.message = fmt::format("table \"{}\" has no history", home->name)});
  }
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const auto& revision : *revisions) {
    all.push_back({{"revision", revision.number},
                   {"time", revision.time},
                   {"note", revision.note},
                   {"sha256", revision.content_hash},
                   {"tags", revision.tags}});
    if (options.json) continue;
    std::string tags;
    for (const std::string& tag : revision.tags) tags += "  [" + bushd::printable(tag) + "]";
    fmt::print("{:>5}  {}  {}  {}{}\n", revision.number, revision.time,
               revision.content_hash.substr(0, tables::kShortHashLength),
               bushd::printable(revision.note), tags);
  }
  if (options.json) print_json(all);
  return kDone;
}

int revert(const Places& places, const Revert& wanted) {
  auto home = home_of(places, wanted.table);
  if (!home) return refuse(home.error());
  const auto now = home->store.read(home->name);
  const auto then = home->store.read(home->name, wanted.revision);
  if (!then) return refuse(then.error());
  const std::string note = fmt::format("revert to {}", then->content.revision);
  // The file may be gone, or be no table any more; what else stands there is not written over.
  if (!now) return saved(*home, create_in(*home, then->text, note), wanted.json);
  return saved(*home, home->store.save(home->name, now->text, then->text, note), wanted.json);
}

int tag(const Places& places, const Tag& wanted) {
  auto home = home_of(places, wanted.table);
  if (!home) return refuse(home.error());
  const auto number = home->store.tag(home->name, wanted.tag, wanted.revision);
  if (!number) {
    const auto now = read_home(*home);
    return refuse(now ? number.error() : now.error());
  }
  if (wanted.json) {
    print_json({{"name", home->name}, {"revision", *number}, {"tag", wanted.tag}});
  } else {
    fmt::print("{}: revision {} is {}\n", bushd::printable(home->name), *number,
               bushd::printable(wanted.tag));
  }
  return kDone;
}

}  // namespace bushtab
