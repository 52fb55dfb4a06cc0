// Every request that a client can make, of a motor: a row each.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "api/request.h"

namespace bushd::test::matrix {

struct Row {
  const char* name;
  api::Request (*of)(const std::string& motor, const std::string& other, std::mt19937& random);
};
const std::vector<Row>& requests();

// As many rows of each type of request as there are.
std::vector<int> rows_of_each_type();

}  // namespace bushd::test::matrix
