// A port's path may be a pattern of the shell, "/dev/ttyUSB*": an adapter that was pulled out may
// come back under another name.
#pragma once

#include <string>
#include <vector>

namespace bushd::config {

bool is_pattern(const std::string& port);

// Paths that the port may have now, sorted. One that is no pattern is its own and only one, whether
// it exists or not.
std::vector<std::string> ports_matching(const std::string& port);

// Both are there, and are one file or one device, under whatever names.
bool is_same_port(const std::string& a, const std::string& b);

// Whether one path could suit both of two different ports, of which one at least is a pattern. May
// say so of patterns that no path suits, never the other way round.
bool patterns_may_meet(const std::string& a, const std::string& b);

}  // namespace bushd::config
