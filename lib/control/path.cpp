#include "control/path.h"

#include <cstdlib>

namespace bushd::control {

std::vector<std::string> default_paths() {
  std::vector<std::string> paths = {kSystemPath};
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && *runtime == '/') {
    paths.push_back(std::string(runtime) + "/bushd/control");
  }
  return paths;
}

}  // namespace bushd::control
