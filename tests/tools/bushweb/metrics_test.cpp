// Numbers for Prometheus.
#include "tools/bushweb/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>

#include "source_path.h"

namespace bushweb {
namespace {

namespace api = bushd::api;
using testing::HasSubstr;
using testing::Not;

Measured told_of(std::vector<bushd::lcm::StateMessage> states,
                 std::vector<bushd::lcm::HealthMessage> healths) {
  Measured daemon{.daemon = "d", .connected = true};
  daemon.status.states = std::move(states);
  daemon.status.healths = std::move(healths);
  return daemon;
}

TEST(Metrics, APositionThatNobodyKnowsIsLeftOut) {
  bushd::lcm::StateMessage mcu;
  mcu.snapshot = {.mcu = "hall:1", .state = api::McuState::kReady};
  mcu.snapshot.motors = {{.name = "a", .position_steps = 5, .user = 0.5},
                         {.name = "b\"\\\n", .trust = api::Trust::kUnknown}};
  const std::string text = open_metrics({told_of({mcu}, {})});
  EXPECT_THAT(text,
              HasSubstr("bushd_motor_position{daemon=\"d\",mcu=\"hall:1\",motor=\"a\"} 0.5\n"));
  EXPECT_THAT(text,
              Not(HasSubstr("bushd_motor_position_steps{daemon=\"d\",mcu=\"hall:1\",motor=\"b")));
  EXPECT_THAT(text, HasSubstr("motor=\"b\\\"\\\\\\n\",bushd_motor_trust=\"unknown\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("bushd_mcu_ready{daemon=\"d\",mcu=\"hall:1\"} 1\n"));
  EXPECT_TRUE(text.ends_with("# EOF\n"));
}

TEST(Metrics, ClassesOfLatencyAddUp) {
  bushd::lcm::HealthMessage bus;
  bus.snapshot.bus = "b";
  bus.snapshot.latency = {{1000, 3}, {2000, 4}, {std::numeric_limits<std::int64_t>::max(), 1}};
  const std::string text = open_metrics({told_of({}, {bus})});
  EXPECT_THAT(text, HasSubstr("_bucket{daemon=\"d\",bus=\"b\",le=\"0.002\"} 7\n"));
  EXPECT_THAT(text, HasSubstr("_bucket{daemon=\"d\",bus=\"b\",le=\"+Inf\"} 8\n"));
  EXPECT_THAT(text, HasSubstr("_count{daemon=\"d\",bus=\"b\"} 8\n"));
}

// What a name in a query of the dashboard begins with, and what families are called.
TEST(Metrics, TheDashboardAsksForWhatIsTold) {
  bushd::lcm::HealthMessage bus;
  bus.snapshot.latency = {{std::numeric_limits<std::int64_t>::max(), 1}};
  bus.snapshot.mcus = {{.mcu = "m"}};
  bushd::lcm::StateMessage mcu;
  mcu.snapshot.motors = {{.name = "a"}};
  Measured daemon = told_of({mcu}, {bus});
  daemon.cpu_s = 1;
  const std::string told = open_metrics({daemon});
  std::ifstream file(bushd::test::source_path("tools/bushweb/grafana.json"));
  const auto dashboard = nlohmann::json::parse(file);
  const std::regex name("bushd_[a-z_]+(?=\\{)");
  int asked = 0;
  for (const auto& panel : dashboard["panels"]) {
    for (const auto& target : panel["targets"]) {
      const std::string query = target["expr"];
      for (std::sregex_iterator at(query.begin(), query.end(), name), end; at != end; ++at) {
        ++asked;
        EXPECT_THAT(told, HasSubstr("\n" + at->str() + "{")) << query;
      }
    }
  }
  EXPECT_EQ(asked, 11);
}

TEST(Metrics, ADaemonThatIsNotThereIsDown) {
  EXPECT_THAT(open_metrics({Measured{.daemon = "d"}}), HasSubstr("bushd_up{daemon=\"d\"} 0\n"));
}

}  // namespace
}  // namespace bushweb
