// Who may do what with a file, by owner, group and mode. Access control lists are not looked at.
#pragma once

#include <algorithm>

#include "observations.h"

namespace bushctl::doctor {

inline bool has_bits(const Rights& rights, const User& user, std::uint32_t bits) {
  if (user.is_root()) return true;
  const bool member = std::ranges::find(user.groups, rights.gid) != user.groups.end();
  const unsigned shift = user.uid == rights.uid ? 6 : member ? 3 : 0;
  return (rights.mode >> shift & bits) == bits;
}

inline bool may_read(const Rights& rights, const User& user) {
  return has_bits(rights, user, 04);
}
// To read and to write.
inline bool may_use(const Rights& rights, const User& user) {
  return has_bits(rights, user, 06);
}
// To make files in it.
inline bool may_write_folder(const Rights& rights, const User& user) {
  return has_bits(rights, user, 03);
}

}  // namespace bushctl::doctor
