// Changes of bushd.toml as text, with every comment and the order of everything kept.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "base/result.h"
#include "config/setting.h"

namespace bushd::config {

struct Edit {
  std::string motor{};
  SettingKey key = SettingKey::kOffset;
  std::string value{};  // as text_of() makes it
};

// `text` with these values. What is none has no key. `path` is what errors say, and
// where tables are looked for. Errors: `text` is no configuration, or has no such motor; a value
// does not fit it; it is written in a way that cannot be changed in place.
// A configuration that comes out is read again: it says what was asked for, and all else as before.
Result<std::string> edited(std::string_view text, std::span<const Edit> edits,
                           const std::string& path);

}  // namespace bushd::config
