// A lab with a motor whose settings are changed.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {

// m01 has a unit, m02 has none.
inline std::string blade(const std::string& keys = "offset = 10\nsoft_limits = [-5, 5.5]\n") {
  return with_keys(hall(1, 2), "m01", "unit = \"mm\"\nsteps_per_unit = 400\n" + keys);
}

struct SettingsLab : Lab {
  explicit SettingsLab(const std::string& toml = blade(), bool kept = true) : Lab(toml) {
    if (kept) keep_positions();
    connect();
  }
  static api::Request changes(std::vector<api::Configure::Change> changes) {
    return api::Configure{.kind = api::Configure::Kind::kChange, .changes = std::move(changes)};
  }
  Answer change(const std::string& motor, const std::string& key, const std::string& value) {
    return ask(changes({{motor, key, value}}));
  }
  std::vector<std::string> show(const std::string& motor) {
    const auto number = send(api::Configure{.motors = {motor}});
    wait(number);
    return settings(number);
  }
  void expect_done(const std::string& motor, const std::string& key, const std::string& value) {
    expect_done(changes({{motor, key, value}}));
  }
  void expect_done(const api::Request& request) { EXPECT_THAT(ask(request), Ends("done")); }
  void expect_refused(const Answer& answer, const std::string& why) {
    EXPECT_THAT(answer, Ends("refused", why));
  }
  void expect_refused(const std::string& motor, const std::string& key, const std::string& value,
                      const std::string& why) {
    expect_refused(change(motor, key, value), why);
  }
  Answer move_by(const std::string& motor, std::int64_t steps) {
    return ask(Ask::kMoveBy, {motor}, {steps});
  }
  void expect_reached(const Answer& answer) {
    EXPECT_EQ(answer.result, "reached") << answer.reason;
  }
  // To a dial position, in steps.
  void move_to(const std::string& motor, std::int64_t steps) {
    expect_reached(ask(Ask::kMoveTo, {motor}, {steps}));
  }
  std::vector<api::PastMotion> past(const std::string& motor, std::int32_t most) {
    const auto number = send(api::GetHistory{.motor = motor, .most = most});
    wait(number);
    return history(number);
  }
  void connect_again() {
    ASSERT_TRUE(run_until([this] { return all_ready(); }, 20));
  }
  void restart(const std::string& toml) {
    use_configuration(toml);
    connect_again();
    run_for(0.1);
  }
};

}  // namespace bushd::test
