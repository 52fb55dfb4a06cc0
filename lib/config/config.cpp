#include "config/config.h"

#include <algorithm>
#include <utility>

#include "config/checks.h"
#include "config/sections.h"
#include "tables/toml_file.h"
#include "tables/toml_reader.h"

namespace bushd::config {

Result<Config> load(const std::filesystem::path& path) {
  const auto text = tables::read_text(path);
  if (!text) return fail(text.error());
  return parse(*text, path);
}

Result<Config> parse(std::string_view text, const std::filesystem::path& path) {
  const auto document = tables::parse_toml(text, path.string());
  if (!document) return fail(document.error());
  Loading loading;
  loading.config.path = path.string();
  const tables::TomlReader root(*document, loading.config.path);
  if (const auto read = read_sections(root, &loading); !read) return fail(read.error());
  if (const auto checked = check_together(loading); !checked) return fail(checked.error());
  return std::move(loading.config);
}

bool same_but_for_tables(const Config& a, const Config& b) {
  const auto bus = [](const Bus& x, const Bus& y) {
    return x.name == y.name && x.port == y.port && x.baud == y.baud && x.tick_us == y.tick_us &&
           x.format == y.format && x.table_runs == y.table_runs && x.table_ticks == y.table_ticks &&
           x.emergency_stop == y.emergency_stop;
  };
  const auto mcu = [](const Mcu& x, const Mcu& y) {
    return x.bus == y.bus && x.address == y.address;
  };
  const auto group = [](const Group& x, const Group& y) { return x.name == y.name; };
  const auto motor = [](const Motor& x, const Motor& y) {
    return x.name == y.name && x.mcu == y.mcu && x.output == y.output && x.group == y.group;
  };
  return a.lcm.url == b.lcm.url && a.lcm.prefix == b.lcm.prefix &&
         std::ranges::equal(a.buses, b.buses, bus) && std::ranges::equal(a.mcus, b.mcus, mcu) &&
         std::ranges::equal(a.groups, b.groups, group) &&
         std::ranges::equal(a.motors, b.motors, motor);
}

}  // namespace bushd::config
