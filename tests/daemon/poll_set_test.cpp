// Descriptors that are ready: which are handled, in which order, and how many by one look.
#include "daemon/shell/poll_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "daemon/shell/signals.h"

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Readable from raise() until lower().
class Flag {
 public:
  Flag() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  ~Flag() { ::close(fd_); }
  Flag(const Flag&) = delete;
  Flag& operator=(const Flag&) = delete;
  int fd() const { return fd_; }
  void raise() const { EXPECT_EQ(::eventfd_write(fd_, 1), 0); }
  void lower() const {
    eventfd_t value = 0;
    EXPECT_EQ(::eventfd_read(fd_, &value), 0);
  }

 private:
  int fd_;
};

class PollSetTest : public testing::Test {
 protected:
  PollSetTest() { EXPECT_TRUE(set.open()); }
  std::unique_ptr<PollSet::Watch> watch(const Flag& flag, PollSet::Turn turn,
                                        const std::string& name) {
    auto watched = set.watch(flag.fd(), turn, [this, name, &flag](std::uint32_t) {
      flag.lower();
      story.push_back(name);
    });
    EXPECT_TRUE(watched);
    return std::move(*watched);
  }
  std::vector<std::string> handled() {
    story.clear();
    const bool any = *set.handle(0);
    EXPECT_EQ(any, !story.empty());
    return story;
  }

  PollSet set;
  std::vector<std::string> story;
};

TEST_F(PollSetTest, OneLookHandlesAllThatIsReadyAndWhatMayBringAStopFirst) {
  const Flag a, b, c;
  const auto port = watch(a, PollSet::Turn::kUsual, "port");
  const auto other = watch(b, PollSet::Turn::kUsual, "other port");
  const auto clients = watch(c, PollSet::Turn::kFirst, "clients");
  EXPECT_THAT(handled(), IsEmpty());
  for (const Flag* flag : {&a, &b, &c}) flag->raise();
  EXPECT_THAT(handled(), ElementsAre("clients", "port", "other port"));
  EXPECT_THAT(handled(), IsEmpty());
}

TEST_F(PollSetTest, WhatIsNotAwaitedWaits) {
  const Flag flag;
  const auto port = watch(flag, PollSet::Turn::kUsual, "port");
  port->await(0);
  flag.raise();
  EXPECT_THAT(handled(), IsEmpty());
  port->await(EPOLLIN);
  EXPECT_THAT(handled(), ElementsAre("port"));
}

TEST_F(PollSetTest, NothingIsHandledOfWhatAnotherHandlerHasEnded) {
  const Flag a, b;
  std::unique_ptr<PollSet::Watch> port;
  const auto worker = *set.watch(a.fd(), PollSet::Turn::kFirst, [&](std::uint32_t) {
    a.lower();
    port.reset();
  });
  port = watch(b, PollSet::Turn::kUsual, "port");
  a.raise();
  b.raise();
  ASSERT_TRUE(*set.handle(0));
  EXPECT_THAT(story, IsEmpty());
  EXPECT_FALSE(*set.handle(0));
}

TEST_F(PollSetTest, OneLookHandlesNoMoreThanAFew) {
  std::vector<std::unique_ptr<Flag>> flags;
  std::vector<std::unique_ptr<PollSet::Watch>> watches;
  for (int i = 0; i < PollSet::kAtOnce + 3; ++i) {
    flags.push_back(std::make_unique<Flag>());
    watches.push_back(watch(*flags.back(), PollSet::Turn::kUsual, std::to_string(i)));
    flags.back()->raise();
  }
  EXPECT_EQ(handled().size(), std::size_t{PollSet::kAtOnce});
  EXPECT_EQ(handled().size(), 3u) << "those that have waited longest";
}

TEST_F(PollSetTest, WhatCannotBeWatchedIsAnError) {
  const auto watched = set.watch(-1, PollSet::Turn::kUsual, [](std::uint32_t) {});
  ASSERT_FALSE(watched);
  EXPECT_EQ(watched.error().text(), "event loop: epoll_ctl: Bad file descriptor");
}

TEST(Signals, ThatWaitAreTakenOneByOne) {
  sigset_t set;
  ::sigemptyset(&set);
  ::sigaddset(&set, SIGUSR1);
  ::sigaddset(&set, SIGUSR2);
  ASSERT_EQ(::pthread_sigmask(SIG_BLOCK, &set, nullptr), 0);
  Signals signals;
  ASSERT_TRUE(signals.open({SIGUSR1, SIGUSR2}));
  EXPECT_EQ(signals.take(), std::nullopt);
  for (const int signal : {SIGUSR2, SIGUSR1}) {
    ASSERT_EQ(::pthread_kill(::pthread_self(), signal), 0);
    EXPECT_EQ(signals.take(), signal);
  }
  EXPECT_EQ(signals.take(), std::nullopt);
}

}  // namespace
}  // namespace bushd::daemon
