#include "config/config.h"

#include <system_error>
#include <utility>

#include "config/checks.h"
#include "config/sections.h"
#include "tables/table_file.h"
#include "tables/toml_file.h"
#include "tables/toml_reader.h"

namespace bushd::config {

Result<Config> load(const std::filesystem::path& path) {
  const auto text = tables::read_text(
      path, "a configuration of hundreds of motors needs a tenth of that: is it the right file?");
  if (!text) return fail(text.error());
  return parse(*text, path);
}

Result<Config> parse(std::string_view text, const std::filesystem::path& path) {
  const auto document = tables::parse_toml(text, path.string());
  if (!document) return fail(document.error());
  Loading loading;
  loading.config.path = path.string();
  std::error_code error;
  loading.config.absolute_path = std::filesystem::absolute(path, error).string();
  loading.config.text_sha256 = tables::text_sha256(text);
  const tables::TomlReader root(*document, loading.config.path);
  if (const auto read = read_sections(root, &loading); !read) return fail(read.error());
  if (const auto checked = check_together(loading); !checked) return fail(checked.error());
  return std::move(loading.config);
}

std::vector<std::filesystem::path> table_directories(const std::filesystem::path& path) {
  const std::filesystem::path beside = path.parent_path();
  std::vector<std::filesystem::path> directories = {
      beside.empty() ? std::filesystem::path(".") : beside, beside / "tables"};
  for (auto& shipped : tables::shipped_directories()) directories.push_back(std::move(shipped));
  return directories;
}

}  // namespace bushd::config
