#include "tables/table_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "tables/table_file.h"
#include "tables/toml_file.h"
#include "tables/toml_text.h"

namespace bushd::tables {
namespace {

constexpr std::size_t kCodesPerLine = 16;
constexpr std::size_t kCommentColumns = 98;

using Codes = std::vector<std::uint16_t>;

std::string joined(std::span<const std::uint16_t> codes) {
  std::string out;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    if (i > 0) out += i % kCodesPerLine == 0 ? ",\n  " : ", ";
    out += fmt::format("{}", codes[i]);
  }
  return out;
}

std::string array_text(std::span<const std::uint16_t> codes) {
  if (codes.size() <= kCodesPerLine) return "[" + joined(codes) + "]";
  return "[\n  " + joined(codes) + ",\n]";
}

std::string wrapped(std::string_view text) {
  std::string out;
  std::string line;
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word;) {
    if (!line.empty() && line.size() + 1 + word.size() > kCommentColumns) {
      out += "# " + line + "\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return out + "# " + line + "\n";
}

// Changes of a valid document, applied together at the end.
class Patch {
 public:
  explicit Patch(std::string_view text) : toml_(text), text_(text) {}

  const TomlText& toml() const { return toml_; }

  std::string comments_between(std::size_t begin, std::size_t end) const {
    std::string out;
    for (std::size_t at = begin; at < end; ++at) {
      if (text_[at] != '#') continue;
      const std::size_t line_end = std::min(text_.find('\n', at), text_.size());
      out += std::string(text_.substr(at, line_end - at)) + "\n  ";
      at = line_end;
    }
    return out;
  }

  bool ends_with_newline(std::size_t at) const { return at > 0 && text_[at - 1] == '\n'; }

  void replace(std::size_t begin, std::size_t end, std::string with) {
    changes_.push_back({begin, end, std::move(with)});
  }

  std::string applied() {
    std::stable_sort(changes_.begin(), changes_.end(), [](const Change& a, const Change& b) {
      return std::pair(a.begin, a.end) < std::pair(b.begin, b.end);
    });
    std::string out;
    std::size_t done = 0;
    for (const Change& change : changes_) {
      out += text_.substr(done, change.begin - done);
      out += change.with;
      done = change.end;
    }
    return out + std::string(text_.substr(done));
  }

 private:
  struct Change {
    std::size_t begin;
    std::size_t end;
    std::string with;
  };

  TomlText toml_;
  std::string_view text_;
  std::vector<Change> changes_;
};

// Replaces what differs: single codes if the number of codes stays, else all between the common
// beginning and the common end.
void patch_codes(Patch& patch, const toml::array& array, const Codes& before, const Codes& after) {
  const TomlText& toml = patch.toml();
  const auto begin_of = [&](std::size_t i) { return toml.offset(array.get(i)->source().begin); };
  const auto end_of = [&](std::size_t i) { return toml.token_end(begin_of(i)); };
  if (before.size() == after.size()) {
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (before[i] != after[i]) {
        patch.replace(begin_of(i), end_of(i), fmt::format("{}", after[i]));
      }
    }
    return;
  }
  const std::size_t shorter = std::min(before.size(), after.size());
  std::size_t head = 0;
  while (head < shorter && before[head] == after[head]) ++head;
  std::size_t tail = 0;
  while (tail < shorter - head &&
         before[before.size() - 1 - tail] == after[after.size() - 1 - tail]) {
    ++tail;
  }
  std::string middle = joined(std::span(after).subspan(head, after.size() - head - tail));
  if (tail > 0) {
    const std::size_t begin = begin_of(head);
    const std::size_t end = begin_of(before.size() - tail);
    if (!middle.empty()) middle += ", ";
    patch.replace(begin, end, patch.comments_between(begin, end) + middle);
    return;
  }
  const std::size_t begin = head > 0 ? end_of(head - 1) : toml.offset(array.source().begin) + 1;
  const std::size_t end = end_of(before.size() - 1);
  const std::string comments = patch.comments_between(begin, end);
  std::string comma;
  if (head > 0 && !middle.empty()) comma = ", ";
  if (!comments.empty()) comma = head > 0 && !middle.empty() ? ",\n  " : "\n  ";
  patch.replace(begin, end, comma + comments + middle);
}

class Rewriter {
 public:
  Rewriter(std::string_view text, const toml::table& document)
      : patch_(text), document_(document) {}

  // A key's whole lines, its value ending at `value_end`.
  void remove(std::string_view key, std::size_t value_end) {
    const std::size_t begin = patch_.toml().line_begin(key_offset(key));
    const std::size_t end = patch_.toml().line_end(value_end);
    std::string comments = patch_.comments_between(begin, end);
    while (comments.ends_with(' ')) comments.pop_back();
    patch_.replace(begin, end, comments);
  }

  void add(std::string_view key, const std::string& value, std::string_view behind) {
    const std::size_t at = patch_.toml().line_end(value_end(behind));
    patch_.replace(
        at, at, fmt::format("{}{} = {}\n", patch_.ends_with_newline(at) ? "" : "\n", key, value));
  }

  void set_integer(std::string_view key, std::optional<std::uint32_t> before,
                   std::optional<std::uint32_t> after, std::string_view behind) {
    if (before == after) return;
    if (!after) return remove(key, value_end(key));
    const std::string value = fmt::format("{}", *after);
    if (!before) return add(key, value, behind);
    patch_.replace(value_offset(key), value_end(key), value);
  }

  void set_codes(std::string_view key, const std::optional<Codes>& before,
                 const std::optional<Codes>& after, std::string_view behind) {
    if (before == after) return;
    if (!after) return remove(key, value_end(key));
    if (!before) return add(key, array_text(*after), behind);
    patch_codes(patch_, *document_[key].as_array(), *before, *after);
  }

  void set_text(std::string_view key, const std::string& before, const std::string& after) {
    if (before == after) return;
    if (!document_.contains(key)) return add(key, quoted_toml(after), "name");
    patch_.replace(value_offset(key), value_end(key), quoted_toml(after));
  }

  std::string text() { return patch_.applied(); }

 private:
  std::size_t key_offset(std::string_view key) const {
    return patch_.toml().offset(document_.find(key)->first.source().begin);
  }
  std::size_t value_offset(std::string_view key) const {
    return patch_.toml().offset(document_.get(key)->source().begin);
  }
  std::size_t value_end(std::string_view key) const {
    return patch_.toml().value_end(*document_.get(key));
  }

  Patch patch_;
  const toml::table& document_;
};

}  // namespace

std::string quoted_toml(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string to_text(const TableContent& content, const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += wrapped(comment);
  text += fmt::format("name = {}\n", quoted_toml(content.name));
  if (!content.description.empty()) {
    text += fmt::format("description = {}\n", quoted_toml(content.description));
  }
  if (content.revision > 0) text += fmt::format("revision = {}\n", content.revision);
  text += fmt::format("time_unit_ns = {}\n", content.time_unit_ns);
  text += fmt::format("accel = {}\n", array_text(content.accel));
  if (content.decel) text += fmt::format("decel = {}\n", array_text(*content.decel));
  if (content.cruise) text += fmt::format("cruise = {}\n", *content.cruise);
  return text;
}

Result<std::string> rewrite(std::string_view text, const TableContent& content,
                            const std::string& path) {
  const auto before = parse_content(text, path);
  if (!before) return fail(before.error());
  const auto document = parse_toml(text, path);
  if (!document) return fail(document.error());
  const auto number = [](std::uint32_t value) {
    return value == 0 ? std::nullopt : std::optional(value);
  };
  Rewriter rewriter(text, *document);
  rewriter.set_text("name", before->name, content.name);
  rewriter.set_text("description", before->description, content.description);
  rewriter.set_integer("revision", number(before->revision), number(content.revision), "name");
  rewriter.set_integer("time_unit_ns", before->time_unit_ns, content.time_unit_ns, "name");
  rewriter.set_codes("accel", before->accel, content.accel, "name");
  rewriter.set_codes("decel", before->decel, content.decel, "accel");
  rewriter.set_integer("cruise", before->cruise, content.cruise, "accel");
  std::string out = rewriter.text();
  const auto after = parse_content(out, path);
  if (after && *after == content) return out;
  return fail(Error{.message =
                        "is written in a way that cannot be changed in place; write one key a "
                        "line, as bushtab does",
                    .file = path});
}

}  // namespace bushd::tables
