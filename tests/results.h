// Results, in tests.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "base/result.h"

namespace bushd::test {

// What there should be; without it, its error ends the test.
template <class Value>
Value good(Result<Value> result) {
  if (!result) throw std::runtime_error(result.error().text());
  return std::move(*result);
}

// "no error" where there is none.
template <class Value>
std::string error_of(const Result<Value>& result) {
  return result ? "no error" : result.error().text();
}

}  // namespace bushd::test
