// The file that moves are logged to: what is none is refused, what goes away is begun anew.
#include "daemon/shell/move_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <sstream>

#include "tables/temp_directory.h"

namespace bushd::daemon {
namespace {

using testing::HasSubstr;
using Appended = MoveLog::Appended;

class MoveLogTest : public testing::Test {
 protected:
  std::string path() const { return directory_.path() / "moves.jsonl"; }
  std::string text() const {
    std::ostringstream text;
    text << std::ifstream(path()).rdbuf();
    return text.str();
  }

  test::TempDirectory directory_;
};

TEST_F(MoveLogTest, GoesOnWhereItEnded) {
  ASSERT_EQ(MoveLog::open(path())->append("{1}"), Appended::kOn);
  ASSERT_EQ(MoveLog::open(path())->append("{2}"), Appended::kOn);
  EXPECT_EQ(text(), "{1}\n{2}\n");
}

TEST_F(MoveLogTest, AFifoIsRefusedAtOnceWithAndWithoutAReader) {
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  const auto refused = MoveLog::open(path());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), HasSubstr("must be a regular file"));
  const std::fstream reader(path());
  EXPECT_FALSE(MoveLog::open(path()));
}

TEST_F(MoveLogTest, NoFileAtAllIsRefused) {
  EXPECT_FALSE(MoveLog::open(directory_.path()));
  EXPECT_FALSE(MoveLog::open(directory_.path() / "missing" / "moves.jsonl"));
  EXPECT_TRUE(MoveLog::open("/dev/null"));
}

TEST_F(MoveLogTest, ARemovedFileIsBegunAnew) {
  auto log = MoveLog::open(path());
  ASSERT_EQ(log->append("{1}"), Appended::kOn);
  std::filesystem::remove(path());
  ASSERT_EQ(log->append("{2}"), Appended::kAnew);
  ASSERT_EQ(log->append("{3}"), Appended::kOn);
  EXPECT_EQ(text(), "{2}\n{3}\n");
}

TEST_F(MoveLogTest, ARotatedFileIsBegunAnew) {
  auto log = MoveLog::open(path());
  ASSERT_EQ(log->append("{1}"), Appended::kOn);
  std::filesystem::rename(path(), path() + ".1");
  ASSERT_EQ(log->append("{2}"), Appended::kAnew);
  EXPECT_EQ(text(), "{2}\n");
}

TEST_F(MoveLogTest, AFullFileIsRenamedAndNoMoreThanTwoAreKept) {
  auto log = MoveLog::open(path(), 9);
  ASSERT_EQ(log->append("{1}"), Appended::kOn);
  ASSERT_EQ(log->append("{2}"), Appended::kOn);
  EXPECT_EQ(log->append("{3}"), Appended::kFull);
  EXPECT_EQ(text(), "{3}\n");
  std::ostringstream full;
  full << std::ifstream(log->full_path()).rdbuf();
  EXPECT_EQ(full.str(), "{1}\n{2}\n");
  ASSERT_EQ(log->append("{4}"), Appended::kOn);
  EXPECT_EQ(log->append("{5}"), Appended::kFull);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory_.path()), {}), 2);
}

TEST_F(MoveLogTest, ALineThatIsLongerThanAFileIsWrittenNevertheless) {
  auto log = MoveLog::open(path(), 2);
  EXPECT_EQ(log->append("{1}"), Appended::kOn);
  EXPECT_EQ(log->append("{2}"), Appended::kFull);
}

TEST_F(MoveLogTest, AFullFileThatCannotBeRenamedGrowsNoFurther) {
  auto log = MoveLog::open(path(), 9);
  std::filesystem::create_directories(log->full_path() + "/x");
  ASSERT_EQ(log->append("{1}"), Appended::kOn);
  ASSERT_EQ(log->append("{2}"), Appended::kOn);
  const auto lost = log->append("{3}");
  ASSERT_FALSE(lost);
  EXPECT_THAT(lost.error().text(), HasSubstr("a line was lost: the file is full"));
  EXPECT_EQ(text(), "{1}\n{2}\n");
}

// As a full disk does: the first line in part, the next ones not at all.
TEST_F(MoveLogTest, WhatTheDiskHasNoRoomForIsLostAsAWhole) {
  auto log = MoveLog::open(path());
  ASSERT_EQ(log->append("{1}"), Appended::kOn);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit full = before;
  full.rlim_cur = 6;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const auto half = log->append("{2}");
  full.rlim_cur = 4;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const auto nothing = log->append("{3}");
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ASSERT_FALSE(half);
  EXPECT_THAT(half.error().text(), HasSubstr("a line was lost: disk full"));
  ASSERT_FALSE(nothing);
  EXPECT_THAT(nothing.error().text(), HasSubstr("a line was lost"));
  EXPECT_EQ(log->append("{4}"), Appended::kOn);
  EXPECT_EQ(text(), "{1}\n{4}\n");
}

TEST_F(MoveLogTest, ALineThatCannotBeWrittenIsAnErrorUntilTheFolderIsBack) {
  auto log = MoveLog::open(path());
  std::filesystem::remove_all(directory_.path());
  EXPECT_FALSE(log->append("{1}"));
  std::filesystem::create_directory(directory_.path());
  EXPECT_EQ(log->append("{2}"), Appended::kAnew);
}

}  // namespace
}  // namespace bushd::daemon
