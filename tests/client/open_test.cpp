// Where there is no daemon a client learns it at once: what is missing, and how to start it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "client/client.h"

namespace bushd::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Way = ClientOptions::Way;

class OpenTest : public testing::Test {
 protected:
  OpenTest() {
    std::string name = (std::filesystem::temp_directory_path() / "open_test-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    path_ = folder_ / "control";
    setenv("BUSHD_CONTROL", path_.c_str(), 1);
    unsetenv("LCM_DEFAULT_URL");
  }
  ~OpenTest() override {
    std::filesystem::remove_all(folder_);
    unsetenv("BUSHD_CONTROL");
    unsetenv("LCM_DEFAULT_URL");
  }

  // At path_, where its file stays.
  int bound_socket() const {
    const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return fd;
  }

  static std::string error_of(const ClientOptions& options) {
    const auto client = Client::open(options);
    return client ? "" : client.error().text();
  }

  std::filesystem::path folder_;
  std::filesystem::path path_;
};

TEST_F(OpenTest, WithoutASocketBushdIsNotRunning) {
  for (const Way way : {Way::kAny, Way::kSocket}) {
    EXPECT_THAT(
        error_of({.way = way}),
        AllOf(HasSubstr("no control socket at " + path_.string() + ": bushd is not running"),
              HasSubstr("sudo systemctl start bushd"), HasSubstr("bushd --config FILE"),
              HasSubstr("for another daemon use $BUSHD_CONTROL"), Not(HasSubstr("--socket")),
              Not(HasSubstr("LCM")), Not(HasSubstr("--lcm"))));
  }
  EXPECT_THAT(error_of({.another = "--bus NAME"}), HasSubstr("for another daemon use --bus NAME"));
  // A part of the path is a file.
  std::ofstream(path_) << "x";
  EXPECT_THAT(error_of({.socket = (path_ / "control").string()}),
              HasSubstr("bushd is not running"));
}

TEST_F(OpenTest, ASocketThatIsLeftIsNoDaemon) {
  ::close(bound_socket());
  EXPECT_THAT(error_of({}),
              AllOf(HasSubstr("nobody listens at the control socket " + path_.string()),
                    HasSubstr("bushd has ended"), HasSubstr("systemctl start bushd")));
}

TEST_F(OpenTest, ADaemonThatHangsIsNotWaitedForForEver) {
  const int listener = bound_socket();
  ASSERT_EQ(::listen(listener, 0), 0);
  const auto first = Client::open({});  // has the only place among those who wait
  ASSERT_TRUE(first) << first.error().text();
  EXPECT_THAT(error_of({}), AllOf(HasSubstr("bushd takes no connection at " + path_.string()),
                                  HasSubstr("its log")));
  ::close(listener);
}

TEST_F(OpenTest, LcmIsUsedIfSomebodyAsksForIt) {
  EXPECT_NE(error_of({}), "");
  const auto opened_by_lcm = [](const ClientOptions& options) {
    const auto client = Client::open(options);
    return client && (*client)->link().loses();
  };
  EXPECT_TRUE(opened_by_lcm({.url = "memq://"}));
  EXPECT_TRUE(opened_by_lcm({.way = Way::kLcm, .url = "memq://"}));
  setenv("LCM_DEFAULT_URL", "memq://", 1);
  EXPECT_TRUE(opened_by_lcm({}));
  EXPECT_TRUE(opened_by_lcm({.way = Way::kLcm}));
  EXPECT_FALSE(opened_by_lcm({.way = Way::kSocket}));
  EXPECT_EQ(lcm_url("udpm://"), "udpm://");
  EXPECT_EQ(lcm_url(""), "memq://");
  setenv("LCM_DEFAULT_URL", "", 1);
  EXPECT_EQ(lcm_url(""), kDefaultUrl);
  EXPECT_FALSE(opened_by_lcm({}));
}

}  // namespace
}  // namespace bushd::client
