#include "source_path.h"

namespace bushd::test {

std::string source_path(const std::string& below) {
  return BUSHD_SOURCE_DIR "/" + below;
}

}  // namespace bushd::test
