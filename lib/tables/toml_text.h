// The text of a TOML document as people wrote it, and the places in it that toml++ tells: for
// changes that leave everything else as it is.
#pragma once

#include <toml++/toml.h>

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

namespace bushd::tables {

// Offsets are in bytes from the beginning of the text, which outlives this.
class TomlText {
 public:
  explicit TomlText(std::string_view text) : text_(text) {
    line_begins_.push_back(0);
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '\n') line_begins_.push_back(i + 1);
    }
  }

  std::string_view text() const { return text_; }

  // toml++ counts columns in code points.
  std::size_t offset(const toml::source_position& position) const {
    std::size_t at = line_begins_.at(position.line - 1);
    for (std::size_t column = 1; column < position.column; ++column) {
      do ++at;
      while (at < text_.size() && (static_cast<unsigned char>(text_[at]) & 0xC0) == 0x80);
    }
    return std::min(at, text_.size());
  }

  // Where the value ends that begins at node.source().begin: toml++ tells that of strings; numbers
  // end with their token, arrays of these and inline tables behind their bracket.
  std::size_t value_end(const toml::node& node) const {
    if (node.is_string()) return offset(node.source().end);
    if (const toml::table* table = node.as_table()) return table_end(*table);
    const toml::array* array = node.as_array();
    if (array == nullptr) return token_end(offset(node.source().begin));
    return array_end(array->empty() ? offset(node.source().begin) + 1
                                    : token_end(offset(array->back().source().begin)));
  }
  std::size_t token_end(std::size_t at) const {
    return std::min(text_.find_first_of(" \t\r\n,]#}", at), text_.size());
  }

  std::size_t line_begin(std::size_t at) const {
    return *std::prev(std::ranges::upper_bound(line_begins_, at));
  }
  // Behind its newline, if there is one.
  std::size_t line_end(std::size_t at) const {
    const std::size_t newline = text_.find('\n', at);
    return newline == std::string_view::npos ? text_.size() : newline + 1;
  }

 private:
  // Behind the '}' of an inline table, which has no comments.
  std::size_t table_end(const toml::table& table) const {
    std::size_t at = offset(table.source().begin) + 1;
    for (const auto& [key, value] : table) at = std::max(at, value_end(value));
    return std::min(text_.find('}', at), text_.size() - 1) + 1;
  }

  // Behind the ']' of an array whose last element, or '[', ends at `at`.
  std::size_t array_end(std::size_t at) const {
    while (at < text_.size() && text_[at] != ']') {
      at = text_[at] == '#' ? std::min(text_.find('\n', at), text_.size()) : at + 1;
    }
    return std::min(at + 1, text_.size());
  }

  std::string_view text_;
  std::vector<std::size_t> line_begins_;
};

}  // namespace bushd::tables
