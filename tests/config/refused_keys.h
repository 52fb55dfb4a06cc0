// Configurations that are refused: each with the line and what the message says.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>
#include <string>

#include "config/config_file.h"

namespace bushd::test {

struct RefusedKey {
  std::string text;
  int line;
  const char* error;
};

inline void expect_refused(std::span<const RefusedKey> cases) {
  for (const RefusedKey& one : cases) {
    const auto config = ConfigFile(one.text).load();
    ASSERT_FALSE(config.has_value()) << one.error;
    EXPECT_EQ(config.error().line, one.line) << config.error().text();
    EXPECT_THAT(config.error().text(), testing::HasSubstr(one.error));
  }
}

}  // namespace bushd::test
