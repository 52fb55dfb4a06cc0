// Runs a rapidcheck property as a gtest expectation. rapidcheck prints the seed ("Using
// configuration: seed=...") when it starts and, on failure, the shrunk counterexample;
// RC_PARAMS="seed=N" repeats a run.
#pragma once

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdint>
#include <string>
#include <utility>

namespace bushd::test {

template <class Property>
void holds(const std::string& description, Property&& property) {
  EXPECT_TRUE(rc::check(description, std::forward<Property>(property)));
}

// Uniform in [low, high], independent of rapidcheck's size parameter.
template <class T>
T between(T low, T high) {
  const auto wide =
      rc::gen::inRange<int64_t>(static_cast<int64_t>(low), static_cast<int64_t>(high) + 1);
  return static_cast<T>(*rc::gen::resize(rc::kNominalSize, wide));
}

}  // namespace bushd::test
