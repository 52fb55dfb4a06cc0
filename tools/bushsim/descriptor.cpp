#include "descriptor.h"

#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace bushsim {

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

bushd::Error system_error(const std::string& what) {
  return {.message = what + ": " + std::generic_category().message(errno)};
}

}  // namespace bushsim
