// The file of tokens, and whatever may lie in its place. Who has a right to it:
// tests/tools/bushctl/web_token_test.py.
#include "tokens/token_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <thread>

#include "tables/killed_at.h"
#include "tables/temp_directory.h"

namespace bushd::tokens {
namespace {

using test::TempDirectory;
using testing::HasSubstr;

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::set<std::string> files_of(const TempDirectory& directory) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory.path())) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

std::set<std::string> names_in(const std::string& path) {
  std::set<std::string> names;
  const auto tokens = read(path);
  EXPECT_TRUE(tokens) << tokens.error().text();
  if (!tokens) return names;
  for (const Token& token : *tokens) names.insert(token.name);
  return names;
}

// Each has another hash.
Token token(const std::string& name, std::int64_t expires_s = 2000, std::int64_t made_s = 1000) {
  static int count = 0;
  const std::string digits = std::to_string(++count);
  return {.name = name,
          .expires_s = expires_s,
          .made_s = made_s,
          .made_by = "anna",
          .hash = std::string(64 - digits.size(), 'f') + digits};
}

mode_t mode_of(const std::filesystem::path& path) {
  struct stat status{};
  EXPECT_EQ(stat(path.c_str(), &status), 0);
  return status.st_mode & 07777;
}

class TokenFile : public testing::Test {
 protected:
  TempDirectory directory_;
  std::string path_ = (directory_.path() / "tokens").string();

  std::string error_of(const Result<void>& result) {
    EXPECT_FALSE(result);
    return result ? "" : result.error().text();
  }
};

TEST_F(TokenFile, IsMadeByTheFirstTokenAndKeepsCommentsOfPeople) {
  EXPECT_TRUE(names_in(path_).empty());
  ASSERT_TRUE(add(path_, token("anna")));
  EXPECT_THAT(content(path_), HasSubstr("# Tokens of bushd-web"));
  std::ofstream(path_, std::ios::app) << "# the tablet in the hutch, without a newline";
  ASSERT_TRUE(add(path_, token("tablet")));
  ASSERT_TRUE(add(path_, token("otto")));
  EXPECT_EQ(names_in(path_), (std::set<std::string>{"anna", "otto", "tablet"}));
  ASSERT_TRUE(revoke(path_, "tablet"));
  EXPECT_EQ(names_in(path_), (std::set<std::string>{"anna", "otto"}));
  EXPECT_THAT(content(path_), HasSubstr("# the tablet in the hutch, without a newline\n"));
  EXPECT_EQ(files_of(directory_), (std::set<std::string>{".tokens.lock", "tokens"}));
}

TEST_F(TokenFile, IsForItsGroupWhateverTheUmask) {
  const mode_t before = umask(0077);
  const bool added = add(path_, token("anna")).has_value();
  umask(before);
  ASSERT_TRUE(added);
  EXPECT_EQ(mode_of(path_), 0660u);
  EXPECT_EQ(mode_of(directory_.path() / ".tokens.lock"), 0660u);
  ASSERT_TRUE(add(path_, token("otto")));
  EXPECT_EQ(mode_of(path_), 0660u);
}

TEST_F(TokenFile, HasANameOnceUnlessItHasExpired) {
  ASSERT_TRUE(add(path_, token("anna", 2000, 1000)));
  const std::string before = content(path_);
  EXPECT_THAT(
      error_of(add(path_, token("anna", 3000, 1999))),
      HasSubstr("Give another name, or remove that one with 'bushctl web-token --revoke anna'"));
  EXPECT_EQ(content(path_), before);
  ASSERT_TRUE(add(path_, token("anna", 3000, 2000)));
  ASSERT_EQ(read(path_)->size(), 1u);
  EXPECT_EQ(read(path_)->front().expires_s, 3000);
}

TEST_F(TokenFile, TakesNoMoreThanCanBeRead) {
  std::vector<Token> tokens;
  for (int i = 0; i < 1000; ++i) tokens.push_back(token("t" + std::to_string(i)));
  directory_.write("tokens", text_of(tokens));
  EXPECT_THAT(error_of(add(path_, token("anna"))), HasSubstr("has 1000 tokens already"));
  ASSERT_TRUE(revoke(path_, "t7"));
  ASSERT_TRUE(add(path_, token("anna")));
  EXPECT_EQ(read(path_)->size(), 1000u);
  directory_.write("tokens", std::string(1024 * 1024, '#'));
  EXPECT_THAT(error_of(add(path_, token("anna"))), HasSubstr("bytes; allowed: 1048576"));
  EXPECT_EQ(content(path_), std::string(1024 * 1024, '#'));
  EXPECT_THAT(error_of(add(path_, token("an na"))), HasSubstr("allowed"));
}

TEST_F(TokenFile, RevokesOnlyWhatIsThere) {
  ASSERT_TRUE(add(path_, token("tablet")));
  EXPECT_THAT(error_of(revoke(path_, "tablett")), HasSubstr("did you mean \"tablet\"?"));
  ASSERT_TRUE(revoke(path_, "tablet"));
  EXPECT_THAT(error_of(revoke(path_, "tablet")), HasSubstr("'bushctl web-token --list'"));
}

TEST_F(TokenFile, ThatIsSpoiledIsLeftAsItIs) {
  ASSERT_TRUE(add(path_, token("anna")));
  std::ofstream(path_, std::ios::app) << "half of a li";
  const std::string spoiled = content(path_);
  EXPECT_THAT(error_of(add(path_, token("otto"))), HasSubstr("tokens:4: has 4 fields"));
  EXPECT_THAT(error_of(revoke(path_, "anna")), HasSubstr("tokens:4: has 4 fields"));
  EXPECT_FALSE(read(path_));
  EXPECT_EQ(content(path_), spoiled);
}

TEST_F(TokenFile, IsNeverReadOrWrittenThroughALink) {
  const std::string other = directory_.write("other", "").string();
  std::filesystem::create_symlink("other", path_);
  EXPECT_THAT(error_of(add(path_, token("anna"))), HasSubstr("it is a link"));
  EXPECT_FALSE(read(path_));
  EXPECT_EQ(content(other), "");
  std::filesystem::remove(path_);
  // What root would make, or write, for somebody who may write the folder.
  std::filesystem::remove(directory_.path() / ".tokens.lock");
  std::filesystem::create_symlink("lock", directory_.path() / ".tokens.lock");
  EXPECT_THAT(error_of(add(path_, token("anna"))), HasSubstr("it is a link"));
  std::filesystem::remove(directory_.path() / ".tokens.lock");
  std::filesystem::create_symlink("other", directory_.path() / ".tokens.new");
  ASSERT_TRUE(add(path_, token("anna")));
  EXPECT_EQ(content(other), "");
  EXPECT_EQ(files_of(directory_), (std::set<std::string>{".tokens.lock", "other", "tokens"}));
}

TEST_F(TokenFile, IsARegularFile) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THAT(error_of(add(path_, token("anna"))), HasSubstr("is no regular file"));
  std::filesystem::remove(path_);
  std::filesystem::create_directory(path_);
  EXPECT_THAT(error_of(add(path_, token("anna"))), HasSubstr("is no regular file"));
  EXPECT_THAT(error_of(add(path_ + "/", token("anna"))), HasSubstr("is a folder"));
}

TEST_F(TokenFile, WithoutItsFolderNamesThePackage) {
  EXPECT_THAT(error_of(add(path_ + "/none/tokens", token("anna"))),
              HasSubstr("the package bushd-web makes it"));
  EXPECT_FALSE(read(path_ + "/none/tokens"));
}

TEST_F(TokenFile, ThatCannotBeWrittenStaysAsItWas) {
  std::vector<Token> tokens;
  for (int i = 0; i < 100; ++i) tokens.push_back(token("t" + std::to_string(i)));
  const std::string before = text_of(tokens);
  directory_.write("tokens", before);
  // As on a disk that is full in the middle.
  struct rlimit all{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &all), 0);
  const auto old_action = std::signal(SIGXFSZ, SIG_IGN);
  const struct rlimit some{.rlim_cur = 4096, .rlim_max = all.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &some), 0);
  const auto added = add(path_, token("anna"));
  setrlimit(RLIMIT_FSIZE, &all);
  std::signal(SIGXFSZ, old_action);
  EXPECT_THAT(error_of(added), HasSubstr("disk not full?"));
  EXPECT_EQ(content(path_), before);
  EXPECT_EQ(files_of(directory_), (std::set<std::string>{".tokens.lock", "tokens"}));
}

TEST_F(TokenFile, LosesNothingOfThoseWhoChangeItAtOnce) {
  constexpr int kThreads = 4;
  constexpr int kEach = 8;
  std::vector<std::vector<Token>> lists(kThreads);
  std::set<std::string> expected;
  for (int i = 0; i < kThreads * kEach; ++i) {
    lists[i % kThreads].push_back(token("t" + std::to_string(i)));
    expected.insert("t" + std::to_string(i));
  }
  std::vector<std::thread> threads;
  for (const auto& list : lists) {
    threads.emplace_back([&] {
      for (const Token& each : list) EXPECT_TRUE(add(path_, each));
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(names_in(path_), expected);
}

TEST(TokenFileCrash, LeavesOldOrNewAtAnySystemCall) {
  // What counts here is the order of the calls: a disk that syncs would only make it slow.
  if (access("/dev/shm", W_OK) == 0) setenv("TMPDIR", "/dev/shm", 1);
  const Token first = token("first");
  const Token second = token("second");
  const Token third = token("third");
  int left_old = 0;
  int left_new = 0;
  for (int n = 1;; ++n) {
    const TempDirectory directory;
    const std::string path = (directory.path() / "tokens").string();
    ASSERT_TRUE(add(path, first));
    const std::string old_text = content(path);
    const auto end = test::killed_at(n, [&] { return add(path, second).has_value(); });
    if (end == test::End::kNotTraced) GTEST_SKIP() << "no tracing of children here";
    const std::string found = content(path);
    ASSERT_TRUE(found == old_text || found == old_text + text_of({second}))
        << "killed at stop " << n << ": " << found;
    (found == old_text ? left_old : left_new)++;
    // The next one is not hindered by what was left behind.
    ASSERT_TRUE(add(path, third));
    ASSERT_EQ(content(path), found + text_of({third}));
    ASSERT_EQ(files_of(directory), (std::set<std::string>{".tokens.lock", "tokens"}));
    if (end == test::End::kFinished) break;
  }
  EXPECT_GT(left_old, 10);
  EXPECT_GT(left_new, 2);
}

}  // namespace
}  // namespace bushd::tokens
