#include "tables/store/store.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "tables/store/atomic_file.h"
#include "tables/table_file.h"
#include "tables/table_text.h"
#include "tables/toml_file.h"

namespace bushd::tables::store {
namespace {

constexpr std::size_t kMaxTagLength = 63;

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

Result<Stored> stored(std::string text, const std::string& path) {
  auto content = parse_content(text, path);
  if (!content) return fail(content.error());
  return Stored{std::move(text), std::move(*content)};
}

}  // namespace

Result<Stored> Store::read(const std::string& name) const {
  const std::filesystem::path path = path_of(name);
  auto text = read_text(path);
  if (!text) return fail(text.error());
  return stored(std::move(*text), path.string());
}

Result<std::uint32_t> Store::record_found(History& history, const std::string& name) const {
  const auto last = history.last(name);
  if (!last) return fail(last.error());
  const auto found = read(name);
  if (!found) return *last;  // nothing there, or nothing that could be used
  const auto known = history.text(name, found->content.revision);
  if (!known) return fail(known.error());
  if (*known == found->text) return *last;
  const std::uint32_t number = std::max(*last + 1, found->content.revision);
  const auto added = history.add(
      name, {.number = number, .note = "found", .content_hash = content_hash(found->content)},
      found->text);
  if (!added) return fail(added.error());
  return number;
}

Result<void> Store::settle(History& history, const std::string& name) const {
  const auto announced = history.announced(name);
  if (!announced) return fail(announced.error());
  if (!*announced) return {};
  const auto now = read_text(path_of(name));
  if (now && *now == (*announced)->text) return history.confirm(name);
  const auto last = history.last(name);
  if (!last) return fail(last.error());
  const auto before = history.text(name, *last);
  if (!before) return fail(before.error());
  const bool never_came = now ? *before == *now : *last == 0;
  return never_came ? history.withdraw(name) : history.confirm(name);
}

void Store::settle_if_allowed(History& history, const std::string& name) const {
  const auto announced = history.announced(name);
  if (!announced || !*announced) return;
  const auto lock = FileLock::take(directory_ / ".lock");
  if (!lock || !history.begin()) return;
  if (settle(history, name)) {
    (void)history.commit();
  } else {
    history.roll_back();
  }
}

Result<std::uint32_t> Store::write(const std::string& name, const std::optional<std::string>& from,
                                   const std::string& text, const std::string& note) {
  const std::filesystem::path path = path_of(name);
  auto content = parse_content(text, path.string());
  if (!content) return fail(content.error());
  const auto lock = FileLock::take(directory_ / ".lock");
  if (!lock) return fail(lock.error());

  std::error_code ignored;
  const bool is_there = std::filesystem::exists(path, ignored);
  if (!from && is_there) {
    return fail(Error{.message = "is there already; use another name, or --replace",
                      .file = path.string()});
  }
  if (from) {
    const auto now = read_text(path);
    if (!now) return fail(now.error());
    if (*now != *from) {
      return fail(Error{.message = "was changed by someone else meanwhile; nothing was written. "
                                   "Look at it and make your change again",
                        .file = path.string()});
    }
  }

  remove_leftovers(path);
  auto history = History::open(history_path_);
  if (!history) return fail(history.error());
  if (auto begun = history->begin(); !begun) return fail(begun.error());
  if (auto settled = settle(*history, name); !settled) return fail(settled.error());
  const auto last = record_found(*history, name);
  if (!last) return fail(last.error());
  content->revision = *last + 1;
  const auto numbered = rewrite(text, *content, path.string());
  if (!numbered) return fail(numbered.error());
  const auto announced = history->announce(
      name, {.number = content->revision, .note = note, .content_hash = content_hash(*content)},
      *numbered);
  if (!announced) return fail(announced.error());
  if (auto committed = history->commit(); !committed) return fail(committed.error());
  if (auto replaced = replace_file(path, *numbered); !replaced) {
    (void)history->withdraw(name);  // else the next use does
    return fail(replaced.error());
  }
  // The revision is in the history already; what cannot be confirmed now is at the next use.
  if (history->begin() && history->confirm(name)) (void)history->commit();
  return content->revision;
}

Result<std::uint32_t> Store::create(const std::string& name, const std::string& text,
                                    const std::string& note) {
  return write(name, std::nullopt, text, note);
}

Result<std::uint32_t> Store::save(const std::string& name, const std::string& from,
                                  const std::string& text, const std::string& note) {
  return write(name, from, text, note);
}

Result<std::uint32_t> Store::number_of(const History& history, const std::string& name,
                                       std::string_view at) const {
  if (is_number(at)) {
    std::uint32_t number = 0;
    const auto parsed = std::from_chars(at.data(), at.data() + at.size(), number);
    if (parsed.ec == std::errc{}) return number;
  } else {
    const auto tagged = history.tagged(name, std::string(at));
    if (!tagged) return fail(tagged.error());
    if (*tagged) return **tagged;
  }
  return fail(
      fmt::format("table \"{}\" has no revision and no tag \"{}\"; \"bushtab log {}\" lists them",
                  name, at, name));
}

std::optional<Stored> Store::without_history(const std::string& name, std::string_view at) const {
  auto found = read(name);
  const bool is_it =
      found && found->content.revision > 0 && std::to_string(found->content.revision) == at;
  return is_it ? std::optional(std::move(*found)) : std::nullopt;
}

Result<Stored> Store::read(const std::string& name, std::string_view at) const {
  std::error_code ignored;
  if (!std::filesystem::exists(history_path_, ignored)) {
    if (auto found = without_history(name, at)) return std::move(*found);
    // Opening it would make one, where nobody has changed a table yet.
    return fail(Error{
        .message = fmt::format("table \"{}\" has no history, so no revision \"{}\"", name, at),
        .file = path_of(name).string()});
  }
  auto history = History::open(history_path_);
  if (!history) return fail(history.error());
  settle_if_allowed(*history, name);
  const auto number = number_of(*history, name, at);
  if (!number) return fail(number.error());
  auto text = history->text(name, *number);
  if (!text) return fail(text.error());
  if (!*text) {
    if (auto found = without_history(name, at)) return std::move(*found);
    return fail(fmt::format("table \"{}\" has no revision {}; \"bushtab log {}\" lists them", name,
                            *number, name));
  }
  auto found = stored(std::move(**text), fmt::format("{}@{}", path_of(name).string(), *number));
  // A text that was found and not made by bushtab need not say which revision it became.
  if (found) found->content.revision = *number;
  return found;
}

Result<std::vector<Revision>> Store::log(const std::string& name) const {
  std::error_code ignored;
  if (!std::filesystem::exists(history_path_, ignored)) return std::vector<Revision>{};
  auto history = History::open(history_path_);
  if (!history) return fail(history.error());
  settle_if_allowed(*history, name);
  return history->log(name);
}

Result<std::uint32_t> Store::tag(const std::string& name, const std::string& tag,
                                 std::string_view at) {
  if (tag.empty() || tag.size() > kMaxTagLength || is_number(tag) ||
      tag.find_first_of("@/ \t\n") != std::string::npos) {
    return fail(
        fmt::format("\"{}\" is not a tag; allowed: 1..{} bytes without '@', '/' and blanks, "
                    "not a number",
                    tag.substr(0, kMaxTagLength), kMaxTagLength));
  }
  const auto lock = FileLock::take(directory_ / ".lock");
  if (!lock) return fail(lock.error());
  auto history = History::open(history_path_);
  if (!history) return fail(history.error());
  if (auto begun = history->begin(); !begun) return fail(begun.error());
  if (auto settled = settle(*history, name); !settled) return fail(settled.error());
  const auto newest = record_found(*history, name);
  if (!newest) return fail(newest.error());
  const auto number = at.empty() ? newest : number_of(*history, name, at);
  if (!number) return fail(number.error());
  const auto text = history->text(name, *number);
  if (!text) return fail(text.error());
  if (!*text) return fail(fmt::format("table \"{}\" has no revision {}", name, *number));
  if (auto tagged = history->tag(name, tag, *number); !tagged) return fail(tagged.error());
  if (auto committed = history->commit(); !committed) return fail(committed.error());
  return *number;
}

}  // namespace bushd::tables::store
