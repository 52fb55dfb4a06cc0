#include "tables/table_file.h"

#include <fmt/format.h>

#include <cstdint>
#include <utility>

#include "tables/toml_file.h"
#include "tables/toml_keys.h"

namespace bushd::tables {
namespace {

constexpr std::string_view kUnits = "(time units)";

Result<std::vector<std::uint16_t>> read_codes(const TomlReader& reader, std::string_view key) {
  const auto elements = reader.array(
      key, fmt::format("an array of whole numbers {}..{} {}", kCode.least, kCode.most, kUnits));
  if (!elements) return fail(elements.error());
  std::vector<std::uint16_t> codes;
  codes.reserve((*elements)->size());
  for (const toml::node& node : **elements) {
    const auto code = reader.integer(key, codes.size(), node, kCode.least, kCode.most, kUnits);
    if (!code) return fail(code.error());
    codes.push_back(static_cast<std::uint16_t>(*code));
  }
  return codes;
}

Result<TableContent> read_content(const TomlReader& reader) {
  const auto known =
      reader.only({"name", "description", "revision", "time_unit_ns", "accel", "decel", "cruise"});
  if (!known) return fail(known.error());
  TableContent content;
  auto name = reader.string("name", fmt::format("a string of 1..{} bytes", kMaxNameLength));
  if (!name) return fail(name.error());
  content.name = std::move(*name);
  const Keys unit = Keys(reader).needed_whole("time_unit_ns", &content.time_unit_ns, 1,
                                              kMaxTimeUnitNs, "(nanoseconds)");
  if (!unit.result()) return fail(unit.result().error());
  auto accel = read_codes(reader, "accel");
  if (!accel) return fail(accel.error());
  content.accel = std::move(*accel);
  if (reader.has("decel")) {
    auto decel = read_codes(reader, "decel");
    if (!decel) return fail(decel.error());
    content.decel = std::move(*decel);
  }
  const Keys keys = Keys(reader)
                        .whole("cruise", &content.cruise, kCode.least, kCode.most, kUnits)
                        .whole("revision", &content.revision, 1, kMaxRevision)
                        .text("description", &content.description, "a string");
  if (!keys.result()) return fail(keys.result().error());
  return content;
}

}  // namespace

Result<TableContent> parse_content(std::string_view text, const std::string& path) {
  const auto document = parse_toml(text, path);
  if (!document) return fail(document.error());
  const TomlReader reader(*document, path);
  auto content = read_content(reader);
  if (!content) return fail(content.error());
  if (auto fault = check(*content)) {
    return fail(reader.error(fault->key, fault->index, std::move(fault->message)));
  }
  return content;
}

Result<TablePtr> parse(std::string_view text, const std::string& path) {
  auto content = parse_content(text, path);
  if (!content) return fail(content.error());
  return make(std::move(*content), path);
}

Result<TablePtr> load(const std::filesystem::path& path) {
  const auto text = read_text(path);
  if (!text) return fail(text.error());
  return parse(*text, path.string());
}

}  // namespace bushd::tables
