// A lab that keeps positions, and loses its power.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "daemon/lab.h"

namespace bushd::test {

struct KeptLab : Lab {
  explicit KeptLab(const std::string& toml = hall(1, 2)) : Lab(toml) {
    keep_positions();
    connect();
  }
  void expect_refused(const std::string& motor, const std::string& why) {
    EXPECT_THAT(ask(Ask::kMoveBy, {motor}, {10}), Ends("refused", why));
  }
  void reach(const std::string& motor, std::int64_t steps) {
    EXPECT_EQ(ask(Ask::kMoveBy, {motor}, {steps}).result, "reached");
  }
  void reconnect() {
    run_for(0.1);
    ASSERT_TRUE(run_until([this] { return all_ready(); }, 20));
    run_for(1);
  }
  void cut_mcu_power() {
    bus(0).reboot(0);
    reconnect();
  }
  void cut_all_power() {
    bus(0).reboot(0);
    cut_pc_power();
    reconnect();
  }
  // The next daemon finds all as this one has left it.
  void go_on_with_next_daemon() {
    restart_daemon();
    reconnect();
  }
  void expect_at_shaft(const std::string& name, api::Trust trust) {
    EXPECT_EQ(motor(name).trust, trust) << motor(name).uncertain_reason;
    EXPECT_EQ(motor(name).position_steps, shaft_steps(name));
  }
};

}  // namespace bushd::test
