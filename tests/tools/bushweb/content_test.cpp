// The files of the page.
#include "tools/bushweb/content.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace bushweb {
namespace {

class ContentTest : public testing::Test {
 protected:
  ContentTest() { std::filesystem::create_directories(folder_ / "within"); }
  ~ContentTest() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("content-" + std::to_string(getpid()));
};

TEST_F(ContentTest, HasFilesOfItsFolderOnly) {
  write("index.html", "page");
  write("app.js", "plain");
  write("app.js.gz", "small");
  write("within/secret", "secret");
  const auto content = Content::load(folder_.string());
  ASSERT_TRUE(content) << content.error().text();
  EXPECT_EQ(*content->find("/", false)->body, "page");
  EXPECT_EQ(content->find("/", true)->type, "text/html; charset=utf-8");
  EXPECT_EQ(*content->find("/app.js", false)->body, "plain");
  const Answer* compressed = content->find("/app.js", true);
  EXPECT_EQ(*compressed->body, "small");
  EXPECT_EQ(compressed->type, "text/javascript; charset=utf-8");
  EXPECT_EQ(compressed->headers.back(),
            (std::pair<std::string, std::string>{"content-encoding", "gzip"}));
  for (const char* path : {"", "/app.js.gz", "/within/secret", "/../secret", "app.js", "/none"}) {
    EXPECT_EQ(content->find(path, true), nullptr) << path;
  }
}

TEST_F(ContentTest, WithoutAPageSaysWhereToGetIt) {
  const auto content = Content::load(folder_.string());
  ASSERT_FALSE(content);
  EXPECT_NE(content.error().text().find("tools/setup --web"), std::string::npos);
  EXPECT_FALSE(Content::load("/nowhere/at/all"));
}

}  // namespace
}  // namespace bushweb
