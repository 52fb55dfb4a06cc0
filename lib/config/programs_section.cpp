#include "config/programs_section.h"

#include "config/words.h"

namespace bushd::config {

Result<void> read_programs(const tables::TomlReader& reader, Mcu* mcu) {
  const Keys keys = Keys(reader)
                        .flag("programs_without_host", &mcu->programs_without_host)
                        .flag("programs_at_power_on", &mcu->programs_at_power_on);
  if (!keys.result()) return keys.result();
  if (!mcu->programs_at_power_on || mcu->programs_without_host) return {};
  return fail(reader.error("programs_at_power_on",
                           "no host is heard when the power comes: programs_without_host = true "
                           "is wanted as well"));
}

}  // namespace bushd::config
