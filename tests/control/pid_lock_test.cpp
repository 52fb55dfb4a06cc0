// A lock file that names its holder.
#include "control/pid_lock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "tables/temp_directory.h"

namespace bushd::control::pid_lock_test {
namespace {

TEST(PidLock, NamesTheProcessThatHoldsIt) {
  const test::TempDirectory directory;
  const std::string path = directory.path() / "lock";
  {
    const auto first = PidLock::take(path);
    ASSERT_TRUE(first.lock);
    const auto second = PidLock::take(path);
    EXPECT_FALSE(second.lock);
    EXPECT_EQ(second.holder, "pid " + std::to_string(::getpid()));
  }
  EXPECT_TRUE(PidLock::take(path).lock) << "the file stays, the lock does not";
}

TEST(PidLock, OfAMovedOneTheNewOwnerHoldsIt) {
  const test::TempDirectory directory;
  const std::string path = directory.path() / "lock";
  auto first = PidLock::take(path);
  const PidLock moved = std::move(*first.lock);
  first.lock.reset();
  EXPECT_FALSE(PidLock::take(path).lock);
}

TEST(PidLock, WhereThereCanBeNoneItSaysWhy) {
  const test::TempDirectory directory;
  const auto none = PidLock::take(directory.path() / "missing" / "lock");
  EXPECT_FALSE(none.lock);
  EXPECT_EQ(none.holder, "");
  EXPECT_NE(none.error.find("No such file"), std::string::npos);
}

}  // namespace
}  // namespace bushd::control::pid_lock_test
