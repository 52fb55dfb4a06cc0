// Keys out of the bytes of a terminal.
#include "tools/bushctl/keys.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace bushctl {
namespace {

std::vector<Key> keys_of(std::string bytes, bool all = true) {
  std::vector<Key> keys;
  while (const auto key = take_key(bytes, all)) keys.push_back(*key);
  return keys;
}

TEST(Keys, ArrowsComeInBothOfTheirWays) {
  const std::vector<Key> arrows = {Key::kUp, Key::kDown, Key::kRight, Key::kLeft};
  EXPECT_EQ(keys_of("\x1b[A\x1b[B\x1b[C\x1b[D"), arrows);
  EXPECT_EQ(keys_of("\x1bOA\x1bOB\x1bOC\x1bOD"), arrows);
}

TEST(Keys, OthersAreThemselves) {
  EXPECT_EQ(keys_of("+-x"), (std::vector<Key>{Key::kPlus, Key::kMinus, Key::kOther}));
  EXPECT_EQ(keys_of("\x04"), std::vector<Key>{Key::kEnd});
}

TEST(Keys, AnythingThatIsNotKnownIsOneKey) {
  EXPECT_EQ(keys_of("\x1b"), std::vector<Key>{Key::kOther});
  EXPECT_EQ(keys_of("\x1b[5~"), std::vector<Key>{Key::kOther});
  EXPECT_EQ(keys_of("\x1bx"), std::vector<Key>{Key::kOther});
}

TEST(Keys, WhatIsNotCompleteIsWaitedFor) {
  std::string bytes = "\x1b[";
  EXPECT_FALSE(take_key(bytes, false));
  bytes += "C";
  EXPECT_EQ(take_key(bytes, false), Key::kRight);
  EXPECT_TRUE(bytes.empty());
}

}  // namespace
}  // namespace bushctl
