// What a client says of itself by its id.
#pragma once

#include <optional>
#include <string_view>

namespace bushd::api {

// Parts of the id, if that is PROGRAM@HOST-PID-RANDOM as bushd's own clients make it. Nobody checks
// that it is true.
struct Introduction {
  std::string_view program;
  std::string_view host;
};
std::optional<Introduction> introduction_of(std::string_view client_id);

}  // namespace bushd::api
