// Which fields each message type has, so that a payload can be walked through before anything in it
// is trusted. tests/lcm holds it against the .lcm files.
#pragma once

#include <array>
#include <string_view>

namespace bushd::lcm {

// One letter a field, in the order of the .lcm file:
//   b h i l d  one byte, int16, int32, int64, double     s  text
//   n          an int32 that counts the arrays of capital letters behind it, up to the next n
//   B H I L D S  such an array                            t T  another type, an array of it: the
//                                                             next one of `nested`
struct Layout {
  std::string_view fields;
  std::array<const Layout*, 3> nested{};
};

// Of the types that travel by themselves.
template <class T>
const Layout& layout_of();

}  // namespace bushd::lcm
