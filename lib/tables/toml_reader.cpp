#include "tables/toml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/nearest_name.h"

namespace bushd::tables {
namespace {

constexpr std::size_t kMaxQuoted = 80;

int line_of(const toml::source_region& source) {
  return static_cast<int>(source.begin.line);
}

int column_of(const toml::source_region& source) {
  return static_cast<int>(source.begin.column);
}

std::string range(std::int64_t lowest, std::int64_t highest, std::string_view unit) {
  return fmt::format("a whole number {}..{}{}{}", lowest, highest, unit.empty() ? "" : " ", unit);
}

}  // namespace

std::string describe(const toml::node& node) {
  if (const auto* text = node.as_string()) {
    const std::string& value = text->get();
    const bool cut = value.size() > kMaxQuoted;
    return fmt::format("the string \"{}{}\"", value.substr(0, kMaxQuoted), cut ? "..." : "");
  }
  if (const auto* number = node.as_integer()) return fmt::format("{}", number->get());
  if (const auto* number = node.as_floating_point()) {
    return fmt::format("the floating-point number {}", number->get());
  }
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  if (node.is_array()) return "an array";
  if (node.is_table()) return "a table";
  return "a date or time";
}

namespace {

std::optional<double> finite(const toml::node& node) {
  if (const auto* whole = node.as_integer()) return static_cast<double>(whole->get());
  const auto* number = node.as_floating_point();
  if (number == nullptr || !std::isfinite(number->get())) return std::nullopt;
  return number->get();
}

}  // namespace

TomlReader::TomlReader(const toml::table& table, std::string file, std::string place)
    : table_(&table), file_(std::move(file)), place_(std::move(place)) {}

std::string TomlReader::full(std::string_view key) const {
  if (key.empty()) return place_;
  return place_.empty() ? std::string(key) : fmt::format("{}.{}", place_, key);
}

Error TomlReader::error(std::string_view key, std::string message) const {
  return error(key, std::nullopt, std::move(message));
}

Error TomlReader::error(std::string_view key, std::optional<std::size_t> index,
                        std::string message) const {
  Error error{.message = std::move(message), .file = file_, .key = full(key)};
  const toml::node* node = table_->get(key);
  if (node == nullptr) node = table_;
  if (index) {
    error.key += fmt::format("[{}]", *index);
    const toml::array* elements = node->as_array();
    if (elements != nullptr && *index < elements->size()) node = elements->get(*index);
  }
  error.line = line_of(node->source());
  error.column = column_of(node->source());
  return error;
}

Result<void> TomlReader::only(std::initializer_list<std::string_view> keys) const {
  const toml::key* unknown = nullptr;
  for (const auto& [key, node] : *table_) {
    if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
    // toml++ sorts keys by name; the first one in the file is the one to start with.
    if (unknown == nullptr || key.source().begin < unknown->source().begin) unknown = &key;
  }
  if (unknown == nullptr) return {};
  Error unknown_key{.message = fmt::format("unknown key; allowed here: {}{}", fmt::join(keys, ", "),
                                           did_you_mean(unknown->str(), keys)),
                    .file = file_,
                    .line = line_of(unknown->source()),
                    .key = full(unknown->str()),
                    .column = column_of(unknown->source())};
  return fail(std::move(unknown_key));
}

Result<const toml::node*> TomlReader::required(std::string_view key,
                                               std::string_view allowed) const {
  if (const toml::node* node = table_->get(key)) return node;
  return fail(error(key, fmt::format("is missing; allowed: {}", allowed)));
}

Result<std::string> TomlReader::string(std::string_view key, std::string_view allowed) const {
  const auto node = required(key, allowed);
  if (!node) return fail(node.error());
  if (const auto* text = (*node)->as_string()) return text->get();
  return fail(error(key, fmt::format("is {}; allowed: {}", describe(**node), allowed)));
}

Result<std::int64_t> TomlReader::integer(std::string_view key, std::int64_t lowest,
                                         std::int64_t highest, std::string_view unit) const {
  const auto node = required(key, range(lowest, highest, unit));
  if (!node) return fail(node.error());
  const auto* number = (*node)->as_integer();
  if (number != nullptr && number->get() >= lowest && number->get() <= highest)
    return number->get();
  return fail(error(
      key, fmt::format("is {}; allowed: {}", describe(**node), range(lowest, highest, unit))));
}

Result<double> TomlReader::number(std::string_view key, std::string_view allowed) const {
  const auto node = required(key, allowed);
  if (!node) return fail(node.error());
  if (const auto value = finite(**node)) return *value;
  return fail(error(key, fmt::format("is {}; allowed: {}", describe(**node), allowed)));
}

Result<double> TomlReader::number(std::string_view key, std::size_t index, const toml::node& node,
                                  std::string_view allowed) const {
  if (const auto value = finite(node)) return *value;
  return fail(error(key, index, fmt::format("is {}; allowed: {}", describe(node), allowed)));
}

Result<bool> TomlReader::boolean(std::string_view key) const {
  const auto node = required(key, "true or false");
  if (!node) return fail(node.error());
  if (const auto* value = (*node)->as_boolean()) return value->get();
  return fail(error(key, fmt::format("is {}; allowed: true or false", describe(**node))));
}

Result<std::int64_t> TomlReader::integer(std::string_view key, std::size_t index,
                                         const toml::node& node, std::int64_t lowest,
                                         std::int64_t highest, std::string_view unit) const {
  const auto* number = node.as_integer();
  if (number != nullptr && number->get() >= lowest && number->get() <= highest)
    return number->get();
  return fail(error(
      key, index, fmt::format("is {}; allowed: {}", describe(node), range(lowest, highest, unit))));
}

Result<TomlReader> TomlReader::section(std::string_view key, std::string_view allowed) const {
  const auto node = required(key, allowed);
  if (!node) return fail(node.error());
  if (const auto* table = (*node)->as_table()) return TomlReader(*table, file_, full(key));
  return fail(error(key, fmt::format("is {}; allowed: {}", describe(**node), allowed)));
}

Result<const toml::array*> TomlReader::array(std::string_view key, std::string_view allowed) const {
  const auto node = required(key, allowed);
  if (!node) return fail(node.error());
  if (const auto* elements = (*node)->as_array()) return elements;
  return fail(error(key, fmt::format("is {}; allowed: {}", describe(**node), allowed)));
}

}  // namespace bushd::tables
