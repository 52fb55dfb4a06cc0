#include "state/record.h"

namespace bushd::state {

const Setting* in_force(const Settings& settings, const std::string& key,
                        const std::string& in_file) {
  const auto found = settings.find(key);
  return found != settings.end() && found->second.replaces == in_file ? &found->second : nullptr;
}

}  // namespace bushd::state
