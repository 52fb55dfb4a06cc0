#include "config/state_section.h"

#include "config/words.h"

namespace bushd::config {

Result<void> read_state(const tables::TomlReader& reader, Config* config) {
  return Keys(reader)
      .only({"path", "required"})
      .text("path", &config->state.path, "an absolute path of a folder, or \"\" to keep nothing",
            [](const std::string& path) { return path.empty() || path.starts_with('/'); })
      .flag("required", &config->state.required)
      .result();
}

Result<void> read_restored(const tables::TomlReader& reader, Motor* motor) {
  return Keys(reader).word("restored", &motor->restored_refused, {"allow", "refuse"}).result();
}

}  // namespace bushd::config
