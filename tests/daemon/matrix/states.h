// States in which a motor may be, and how it gets there: a row each.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "daemon/matrix/watched_lab.h"

namespace bushd::test::matrix {

struct State {
  const char* name;
  const char* motor;  // that is in it
  bool moves;         // it has made steps then, mostly
  const char* other;  // of the same bus, for requests of two
  void (*reach)(WatchedLab& lab);
};
inline void PrintTo(const State& state, std::ostream* out) {
  *out << state.name;
}
const std::vector<State>& states();

}  // namespace bushd::test::matrix
