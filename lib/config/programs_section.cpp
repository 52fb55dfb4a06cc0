#include "config/programs_section.h"

#include <utility>

namespace bushd::config {

Result<void> read_programs(const tables::TomlReader& reader, Mcu* mcu) {
  for (const auto& [key, may] : {std::pair{"programs_without_host", &mcu->programs_without_host},
                                 std::pair{"programs_at_power_on", &mcu->programs_at_power_on}}) {
    if (!reader.has(key)) continue;
    const auto value = reader.boolean(key);
    if (!value) return fail(value.error());
    *may = *value;
  }
  if (!mcu->programs_at_power_on || mcu->programs_without_host) return {};
  return fail(reader.error("programs_at_power_on",
                           "no host is heard when the power comes: programs_without_host = true "
                           "is wanted as well"));
}

}  // namespace bushd::config
