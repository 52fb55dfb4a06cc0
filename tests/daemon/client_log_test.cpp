#include "daemon/client_log.h"

#include <gtest/gtest.h>

#include <string>

namespace bushd::daemon {
namespace {

using Verdict = ClientLog::Verdict;

reply_t answer(const std::string& client, std::int64_t number, const std::string& reason) {
  reply_t reply;
  reply.client_id = client;
  reply.number = number;
  reply.reason = reason;
  return reply;
}

TEST(ClientLog, RepeatedCommandHasItsAnswersSoFar) {
  ClientLog log;
  EXPECT_EQ(log.note("a", 1), Verdict::kNew);
  EXPECT_EQ(log.note("a", 1), Verdict::kRepeated) << "not yet answered, and not run again";
  EXPECT_TRUE(log.replies("a", 1).empty());
  log.record(answer("a", 1, "accepted"));
  EXPECT_EQ(log.note("a", 2), Verdict::kNew);
  log.record(answer("a", 2, "other"));
  log.record(answer("a", 1, "result"));
  EXPECT_EQ(log.note("a", 1), Verdict::kRepeated);
  ASSERT_EQ(log.replies("a", 1).size(), 2u);
  EXPECT_EQ(log.replies("a", 1)[0].reason, "accepted");
  EXPECT_EQ(log.replies("a", 1)[1].reason, "result");
}

TEST(ClientLog, NumbersNeedNotFollowButMustGrow) {
  ClientLog log;
  EXPECT_EQ(log.note("a", -5), Verdict::kNew) << "a client may begin anywhere";
  EXPECT_EQ(log.note("a", 1'700'000'000'000), Verdict::kNew);
  EXPECT_EQ(log.note("a", 3), Verdict::kTooOld);
  EXPECT_EQ(log.note("a", -5), Verdict::kRepeated);
  EXPECT_EQ(log.note("a", INT64_MAX), Verdict::kNew);
  EXPECT_EQ(log.note("a", INT64_MIN), Verdict::kTooOld);
}

TEST(ClientLog, ClientsAreIndependent) {
  ClientLog log;
  EXPECT_EQ(log.note("a", 7), Verdict::kNew);
  EXPECT_EQ(log.note("b", 7), Verdict::kNew);
  EXPECT_EQ(log.note("b", 6), Verdict::kTooOld);
  log.record(answer("a", 7, "for a"));
  EXPECT_TRUE(log.replies("b", 7).empty());
  EXPECT_EQ(log.note("", 1), Verdict::kNew);
}

TEST(ClientLog, OldestAnswersAreForgottenAndNeverRunAgain) {
  ClientLog log;
  const auto kept = static_cast<std::int64_t>(ClientLog::kCommandsPerClient);
  for (std::int64_t n = 1; n <= kept; ++n) {
    EXPECT_EQ(log.note("a", n), Verdict::kNew);
    log.record(answer("a", n, std::to_string(n)));
  }
  EXPECT_EQ(log.note("a", 1), Verdict::kRepeated) << "exactly that many are kept";
  EXPECT_EQ(log.note("a", kept + 1), Verdict::kNew);
  EXPECT_EQ(log.note("a", 1), Verdict::kTooOld);
  EXPECT_TRUE(log.replies("a", 1).empty());
  EXPECT_EQ(log.note("a", 2), Verdict::kRepeated);
  EXPECT_EQ(log.replies("a", 2).at(0).reason, "2");
  log.record(answer("a", 1, "late result of a forgotten command"));
  EXPECT_EQ(log.note("a", 1), Verdict::kTooOld);
}

TEST(ClientLog, LongestSilentClientIsForgottenFirst) {
  ClientLog log;
  const auto name = [](std::size_t i) { return "client " + std::to_string(i); };
  for (std::size_t i = 0; i < ClientLog::kClients; ++i) log.note(name(i), 5);
  EXPECT_EQ(log.note(name(0), 5), Verdict::kRepeated) << "all are kept; 0 was heard again";
  EXPECT_EQ(log.note("newcomer", 1), Verdict::kNew);
  EXPECT_EQ(log.note(name(0), 5), Verdict::kRepeated);
  EXPECT_EQ(log.note(name(2), 4), Verdict::kTooOld) << "still known";
  log.record(answer(name(1), 5, "nobody there"));
  EXPECT_TRUE(log.replies(name(1), 5).empty()) << "1 was silent longest";
  EXPECT_EQ(log.note(name(1), 4), Verdict::kNew);
}

TEST(ClientLog, AnswersOfUnknownCommandsAreIgnored) {
  ClientLog log;
  log.record(answer("nobody", 1, ""));
  EXPECT_TRUE(log.replies("nobody", 1).empty());
  EXPECT_EQ(log.note("nobody", 1), Verdict::kNew);
  log.record(answer("nobody", 2, "never asked"));
  EXPECT_EQ(log.note("nobody", 2), Verdict::kNew);
  EXPECT_TRUE(log.replies("nobody", 2).empty());
}

}  // namespace
}  // namespace bushd::daemon
