// What a request asks for, as far as steps are concerned. A new request does not compile until it
// says so here.
#pragma once

#include <set>
#include <string>

#include "api/request.h"

namespace bushd::test::matrix {

struct Claims {
  std::set<std::string> moves{};     // these motors may make steps
  std::set<std::string> stops{};     // these make none when it is done, by what was asked before
  std::set<std::string> resumes{};   // what was asked before moves these again
  std::set<std::string> places{};    // these may be told to stand elsewhere
  std::set<std::string> programs{};  // these may be moved by modules of the crate
};
Claims claims_of(const api::Request& request);

}  // namespace bushd::test::matrix
