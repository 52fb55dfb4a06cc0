// Who may what, by what a browser says of itself and where it comes from.
#include "tools/bushweb/access.h"

#include <gtest/gtest.h>

namespace bushweb {
namespace {

Visit visit_to(const std::string& host, const std::string& origin = "") {
  return {.host = host, .origin = origin, .peer = "127.0.0.1"};
}

TEST(WebAccess, AddressesAndNamesOfThisPcAreAnswered) {
  const AccessOptions options{.hosts = {"hutch.lab"}};
  for (const char* host : {"localhost", "LOCALHOST:8260", "127.0.0.1:8260", "10.1.2.3", "[::1]:80",
                           "[fe80::1]", "hutch.lab", "Hutch.Lab:443"}) {
    EXPECT_EQ(why_not_host(visit_to(host), options), "") << host;
  }
  // A name that an attacker has made lead here, and what only looks like an address.
  for (const char* host : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example",
                           "[evil]", "127.0.0.256", "1", "hutch.lab.evil.example"}) {
    EXPECT_NE(why_not_host(visit_to(host), options), "") << host;
  }
}

TEST(WebAccess, AnOriginIsThePageThatWasAsked) {
  EXPECT_FALSE(is_foreign(visit_to("pc:8260", "http://pc:8260"), {}));
  EXPECT_FALSE(is_foreign(visit_to("PC:8260", "https://pc:8260"), {}));
  EXPECT_FALSE(is_foreign(visit_to("pc:8260"), {}));  // no browser
  for (const char* origin : {"null", "http://pc", "http://pc:8261", "http://evil.example",
                             "http://pc:8260.evil.example", "http://evil.example/pc:8260"}) {
    EXPECT_TRUE(is_foreign(visit_to("pc:8260", origin), {})) << origin;
  }
}

TEST(WebAccess, WherePagesHaveTlsOneWithoutIsForeign) {
  for (const AccessOptions& options :
       {AccessOptions{.tls = true}, AccessOptions{.behind_proxy = true}}) {
    EXPECT_TRUE(is_foreign(visit_to("pc:443", "http://pc:443"), options));
    EXPECT_FALSE(is_foreign(visit_to("pc:443", "https://pc:443"), options));
  }
}

TEST(WebAccess, FindsItsCookieAmongOthers) {
  EXPECT_EQ(token_of("bushd_web=abc"), "abc");
  EXPECT_EQ(token_of("x=1; bushd_web=abc; y=2"), "abc");
  EXPECT_EQ(token_of("bushd_web2=no;bushd_web=abc"), "abc");
  EXPECT_EQ(token_of("bushd_web"), "");
  EXPECT_EQ(token_of("x=bushd_web=abc"), "");
  EXPECT_EQ(token_of(";;;"), "");
}

TEST(WebAccess, StopsNeedNoTokenWhereTheBrowserIsOnThisPc) {
  const auto may_stop = [](const char* peer, const AccessOptions& options) {
    return rights_of({.peer = peer}, std::nullopt, options).may_stop;
  };
  EXPECT_TRUE(may_stop("127.0.0.1", {}));
  EXPECT_TRUE(may_stop("::1", {}));
  EXPECT_TRUE(may_stop("::ffff:127.0.0.1", {}));
  EXPECT_FALSE(may_stop("10.0.0.1", {}));
  EXPECT_FALSE(may_stop("127.example", {}));
  EXPECT_FALSE(may_stop("127.0.0.1", {.behind_proxy = true}));  // that is the proxy
  EXPECT_TRUE(may_stop("10.0.0.1", {.stops = WhoStops::kAnyone}));
  EXPECT_FALSE(may_stop("127.0.0.1", {.stops = WhoStops::kNobody}));
  const Rights with_token = rights_of({.peer = "10.0.0.1"}, "anna", {.stops = WhoStops::kNobody});
  EXPECT_TRUE(with_token.may_command && with_token.may_stop);
  EXPECT_FALSE(rights_of({.peer = "127.0.0.1"}, std::nullopt, {}).may_command);
}

}  // namespace
}  // namespace bushweb
