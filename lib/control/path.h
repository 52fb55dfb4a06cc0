// Where the control socket is, for the daemon that makes it and for the clients that look for it.
#pragma once

#include <string>
#include <vector>

namespace bushd::control {

inline constexpr const char* kSystemPath = "/run/bushd/control";

// In the order in which they are tried: the system's, and without rights there
// $XDG_RUNTIME_DIR/bushd/control.
std::vector<std::string> default_paths();

}  // namespace bushd::control
