#include "api/introduction.h"

namespace bushd::api {

std::optional<Introduction> introduction_of(std::string_view client_id) {
  const auto at = client_id.find('@');
  const auto random = client_id.rfind('-');
  if (at == 0 || random == std::string_view::npos || random < at) return std::nullopt;
  const auto pid = client_id.rfind('-', random - 1);
  if (pid == std::string_view::npos || pid <= at + 1) return std::nullopt;
  return Introduction{.program = client_id.substr(0, at),
                      .host = client_id.substr(at + 1, pid - at - 1)};
}

}  // namespace bushd::api
