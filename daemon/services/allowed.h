// What is said of a range that a field declares.
#pragma once

#include <string>

#include "base/fields.h"

namespace bushd::daemon {

// "; allowed: 50 to 10000"
template <class T>
std::string allowed(fields::Range<T> range) {
  return "; allowed: " + std::to_string(range.least) + " to " + std::to_string(range.most);
}

}  // namespace bushd::daemon
