#include "config/keys.h"

#include <fmt/format.h>

namespace bushd::config {

Result<std::vector<tables::TomlReader>> read_elements(const tables::TomlReader& parent,
                                                      const std::string& file, std::string_view key,
                                                      const std::string& place) {
  const std::string allowed = fmt::format("sections [[{}]]", place);
  const auto elements = parent.array(key, allowed);
  if (!elements) return fail(elements.error());
  std::vector<tables::TomlReader> readers;
  for (const toml::node& node : **elements) {
    const toml::table* table = node.as_table();
    if (table == nullptr) {
      return fail(parent.error(key, readers.size(),
                               fmt::format("is {}; allowed: {}", tables::describe(node), allowed)));
    }
    readers.emplace_back(*table, file, fmt::format("{}[{}]", place, readers.size()));
  }
  return readers;
}

}  // namespace bushd::config
