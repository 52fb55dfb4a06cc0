// Every request that a client can make, of a motor: a row each, and what it asks for. One that says
// that it neither begins nor ends motion asks for no steps.
#pragma once

#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "api/request.h"

namespace bushd::test::matrix {

struct Row {
  std::string_view name;
  api::Request (*of)(const std::string& motor, const std::string& other, std::mt19937& random);
};
const std::vector<Row>& requests();

// What a request asks for, as far as steps are concerned.
struct Claims {
  std::set<std::string> moves{};     // these motors may make steps
  std::set<std::string> stops{};     // these make none when it is done, by what was asked before
  std::set<std::string> resumes{};   // what was asked before moves these again
  std::set<std::string> places{};    // these may be told to stand elsewhere
  std::set<std::string> programs{};  // these may be moved by modules of the crate
};
Claims claims_of(const api::Request& request);

}  // namespace bushd::test::matrix
