#include "config/config.h"

#include <utility>

#include "config/checks.h"
#include "config/sections.h"
#include "tables/toml_file.h"
#include "tables/toml_reader.h"

namespace bushd::config {

Result<Config> load(const std::filesystem::path& path) {
  const auto text = tables::read_text(path);
  if (!text) return fail(text.error());
  const auto document = tables::parse_toml(*text, path.string());
  if (!document) return fail(document.error());
  Loading loading;
  loading.config.path = path.string();
  const tables::TomlReader root(*document, loading.config.path);
  if (const auto read = read_sections(root, &loading); !read) return fail(read.error());
  if (const auto checked = check_together(loading); !checked) return fail(checked.error());
  return std::move(loading.config);
}

}  // namespace bushd::config
