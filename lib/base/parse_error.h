// What CLI11 makes of a command line that it does not run: an answer to --help, or a fault, in
// which stands what somebody has typed.
#pragma once

#include <cstdio>
#include <sstream>

#include "base/printable.h"

namespace bushd {

// `App` and `ParseError` are those of CLI, which takes long to compile. Returns whether it was an
// answer.
template <class App, class ParseError>
bool answered(const App& app, const ParseError& error) {
  std::ostringstream answer;
  std::ostringstream fault;
  const bool asked = app.exit(error, answer, fault) == 0;
  std::fputs(answer.str().c_str(), stdout);
  std::fputs(printable_lines(fault.str()).c_str(), stderr);
  return asked;
}

}  // namespace bushd
