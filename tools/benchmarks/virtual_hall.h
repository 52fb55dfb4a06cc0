// A daemon's core whose 256 motors are online and at rest, on a virtual bus whose time stands still
// once they are: what it does then is planning, and never waits for a line.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "config/config.h"
#include "daemon/core/core.h"
#include "sim/bus.h"

namespace bench {

class VirtualHall final : public bushd::daemon::Outputs {
 public:
  static constexpr int kMcus = 16;

  // Fails if the MCUs do not go online.
  VirtualHall();

  bushd::daemon::Core& core() { return *core_; }
  std::int64_t now_us() const { return now_ns_ / 1000; }
  const bushd::config::Config& config() const { return config_; }

 private:
  void send(bushd::BusId, std::span<const std::uint8_t> bytes) override;
  void publish(bushd::McuId, const bushd::api::StateSnapshot& state) override;
  void publish(bushd::McuId, const bushd::api::Description&) override {}
  void publish(bushd::BusId, const bushd::api::HealthSnapshot&) override {}
  void move_log(const std::string&) override {}
  void log(bushd::daemon::LogLevel, bushd::daemon::LogSubject, const std::string&) override {}
  void read_tables(std::uint64_t, const std::vector<std::string>&) override {}
  void keep_tables(std::uint64_t, const std::vector<std::string>&) override {}
  void serve_tables(const bushd::api::Asker&, const bushd::api::Request&) override {}
  std::int64_t wall_clock_us() override { return now_us(); }
  bool all_ready() const;

  bushd::config::Config config_;
  std::unique_ptr<bushd::sim::Bus> bus_;
  std::unique_ptr<bushd::daemon::Core> core_;
  std::vector<std::uint8_t> received_;
  std::vector<bool> ready_;  // by MCU
  bushd::sim::TimeNs now_ns_ = 0;
};

}  // namespace bench
