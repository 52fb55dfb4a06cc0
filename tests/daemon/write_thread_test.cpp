// Lines that are written by a thread: none keeps anybody waiting, and none is lost unseen.
#include "daemon/shell/write_thread.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <future>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/shell/move_log_writer.h"
#include "tables/temp_directory.h"

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr WriteThread::Limits kFew = {.lines = 3, .bytes = 100, .end = std::chrono::seconds(60)};

// What is written, and a terminal that can be stopped as by Ctrl-S.
struct Terminal {
  std::mutex mutex;
  std::vector<std::string> lines;
  std::promise<void> goes_on;
  std::shared_future<void> gone_on = goes_on.get_future().share();
  std::promise<void> stopped;

  void write(const std::string& line) {
    const std::lock_guard lock(mutex);
    lines.push_back(line);
  }
  WriteThread::Write writing(const std::string& line) {
    return [this, line] { write(line); };
  }
  WriteThread::TellDropped telling() {
    return [this](std::uint64_t dropped) { write(std::to_string(dropped) + " lost"); };
  }
  // The thread is in this write, and stays there.
  void stop(WriteThread& thread) {
    thread.post(1, [this] {
      stopped.set_value();
      gone_on.wait();
    });
    stopped.get_future().wait();
  }
};

TEST(WriteThread, WritesInOrderAndAllOfItBeforeItEnds) {
  Terminal terminal;
  WriteThread thread({.lines = 100, .bytes = 1000, .end = std::chrono::seconds(60)},
                     terminal.telling());
  for (int i = 0; i < 50; ++i) thread.post(1, terminal.writing(std::to_string(i)));
  EXPECT_TRUE(thread.end());
  ASSERT_EQ(terminal.lines.size(), 50u);
  EXPECT_EQ(terminal.lines.back(), "49");
}

TEST(WriteThread, WhatFindsNoRoomIsCountedAndToldWhenThereIsSome) {
  Terminal terminal;
  WriteThread thread(kFew, terminal.telling());
  terminal.stop(thread);
  for (int i = 0; i < 10; ++i) thread.post(1, terminal.writing(std::to_string(i)));
  terminal.goes_on.set_value();
  EXPECT_TRUE(thread.end());
  EXPECT_THAT(terminal.lines, ElementsAre("0", "1", "2", "7 lost"));
}

TEST(WriteThread, LongLinesFindNoRoomSooner) {
  Terminal terminal;
  WriteThread thread(kFew, terminal.telling());
  terminal.stop(thread);
  thread.post(90, terminal.writing("long"));
  thread.post(20, terminal.writing("another"));
  thread.post(10, terminal.writing("short"));
  terminal.goes_on.set_value();
  EXPECT_TRUE(thread.end());
  EXPECT_THAT(terminal.lines, ElementsAre("long", "short", "1 lost"));
}

TEST(WriteThread, OneThatCannotWriteKeepsNobodyFromEnding) {
  const auto terminal = std::make_shared<Terminal>();
  std::promise<void> over;
  {
    WriteThread thread({.lines = 3, .bytes = 100, .end = std::chrono::milliseconds(0)},
                       [terminal, &over](std::uint64_t) { over.set_value(); });
    terminal->stop(thread);
    for (int i = 0; i < 4; ++i) thread.post(1, terminal->writing("late"));
    EXPECT_FALSE(thread.end());
  }
  terminal->goes_on.set_value();  // and it goes on with what it has
  over.get_future().wait();
  EXPECT_THAT(terminal->lines, ElementsAre("late", "late", "late"));
}

class MoveLogWriterTest : public testing::Test {
 protected:
  std::string path() const { return directory_.path() / "moves.jsonl"; }
  std::string text() const {
    std::ifstream file(path());
    return {std::istreambuf_iterator<char>(file), {}};
  }
  MoveLogWriter::Tell telling() {
    return [this](LogLevel, const std::string& text) { terminal_.write(text); };
  }

  test::TempDirectory directory_;
  Terminal terminal_;
};

TEST_F(MoveLogWriterTest, AppendsAllOfItBeforeItEnds) {
  {
    MoveLogWriter log(std::move(*MoveLog::open(path())), telling());
    log.append("{1}");
    log.append("{2}");
  }
  EXPECT_EQ(text(), "{1}\n{2}\n");
  EXPECT_TRUE(terminal_.lines.empty());
}

TEST_F(MoveLogWriterTest, TellsThatTheFileIsBegunAnew) {
  {
    MoveLogWriter log(std::move(*MoveLog::open(path())), telling());
    std::filesystem::remove(path());
    log.append("{1}");
  }
  EXPECT_EQ(text(), "{1}\n");
  EXPECT_THAT(terminal_.lines, ElementsAre(HasSubstr("was removed or renamed")));
}

TEST_F(MoveLogWriterTest, LinesBeyondItsRoomAreCounted) {
  {
    MoveLogWriter log(std::move(*MoveLog::open(path())), telling(),
                      {.lines = 10, .bytes = 3, .end = std::chrono::seconds(60)});
    log.append("{too long}");
  }
  EXPECT_THAT(terminal_.lines, ElementsAre(HasSubstr("1 lines were lost")));
}

}  // namespace
}  // namespace bushd::daemon
