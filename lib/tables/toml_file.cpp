#include "tables/toml_file.h"

#include <fmt/core.h>
#include <glib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <system_error>

namespace bushd::tables {
namespace {

// Ours nest two deep ("lcm.url").
constexpr int kMaxDottedDepth = 16;

// toml++ 3.3 bounds nested values (256) but not dotted keys: "a.a.a. ..." makes a tree as deep as
// the file is long, and freeing it overflows the stack. So keys that nest deeper than any of ours
// are found before it sees them. Dots are counted outside of strings and comments and start anew at
// whatever cannot stand within a key, so that numbers and text cost nothing. The lexer need only
// agree with TOML up to the first syntax error: there toml++ stops as well.
class DottedKeyGuard {
 public:
  explicit DottedKeyGuard(std::string_view text) : rest_(text) {}

  // Where the first key goes too deep, if one does.
  std::optional<std::size_t> find() {
    const std::size_t size = rest_.size();
    while (!rest_.empty()) {
      const char c = rest_.front();
      if (c == '"' || c == '\'') {
        skip_string(c);
        continue;
      }
      if (c == '#') {
        rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
        continue;
      }
      if (c == '.') {
        if (++dots_ >= kMaxDottedDepth) return size - rest_.size();
      } else if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) {
        dots_ = 0;
      }
      skip(1);
    }
    return std::nullopt;
  }

 private:
  void skip(std::size_t count) { rest_.remove_prefix(std::min(count, rest_.size())); }

  void skip_string(char quote) {
    const std::string_view three = quote == '"' ? "\"\"\"" : "'''";
    const bool many_lines = rest_.starts_with(three);
    const std::string_view end = many_lines ? three : three.substr(0, 1);
    skip(end.size());
    while (!rest_.empty() && !rest_.starts_with(end)) {
      if (!many_lines && rest_.front() == '\n') return;
      skip(rest_.front() == '\\' && quote == '"' ? 2 : 1);
    }
    skip(end.size());
    // One or two more quotes before the closing three belong to the text.
    for (int i = 0; many_lines && i < 2 && rest_.starts_with(quote); ++i) skip(1);
  }

  std::string_view rest_;
  int dots_ = 0;
};

// Precondition: what comes before is UTF-8.
tl::unexpected<Error> fail_at(std::string_view text, std::size_t offset, const std::string& path,
                              std::string message) {
  const std::string_view before = text.substr(0, offset);
  const std::string_view line = before.substr(before.rfind('\n') + 1);  // npos + 1 is 0
  const auto characters = std::count_if(line.begin(), line.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xC0) != 0x80;
  });
  return fail(Error{.message = std::move(message),
                    .file = path,
                    .line = 1 + static_cast<int>(std::count(before.begin(), before.end(), '\n')),
                    .column = 1 + static_cast<int>(characters)});
}

}  // namespace

Result<std::string> read_text(const std::filesystem::path& path, std::string_view largest) {
  return read_text(path, TextLimit{.bytes = kMaxFileBytes, .told = largest});
}

std::string text_sha256(std::string_view text) {
  gchar* const sum = g_compute_checksum_for_data(
      G_CHECKSUM_SHA256, reinterpret_cast<const guchar*>(text.data()), text.size());
  std::string out = sum;
  g_free(sum);
  return out;
}

Result<toml::table> parse_toml(std::string_view text, const std::string& path) {
  const char* end = text.data();
  if (!text.empty() &&
      g_utf8_validate(text.data(), static_cast<gssize>(text.size()), &end) == FALSE) {
    return fail_at(
        text, static_cast<std::size_t>(end - text.data()), path,
        fmt::format("byte 0x{:02x} is not text; allowed: UTF-8", static_cast<unsigned char>(*end)));
  }
  if (const auto offset = DottedKeyGuard(text).find()) {
    return fail_at(text, *offset, path,
                   fmt::format("a key of more than {} parts; allowed: the keys of the "
                               "documentation, which have two at most",
                               kMaxDottedDepth));
  }
  try {
    return toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    return fail(Error{.message = fmt::format("not TOML: {}", error.description()),
                      .file = path,
                      .line = static_cast<int>(error.source().begin.line),
                      .column = static_cast<int>(error.source().begin.column)});
  } catch (const std::exception& error) {
    return fail(Error{.message = fmt::format("cannot be parsed: {}", error.what()), .file = path});
  }
}

}  // namespace bushd::tables
