#include "virtual_hall.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "tables/table_file.h"

namespace bench {
namespace {

constexpr bushd::sim::TimeNs kStepNs = 400'000;
constexpr bushd::sim::TimeNs kLimitNs = 60'000'000'000;

bushd::config::Config make_config() {
  using namespace bushd;
  config::Config config;
  config.path = "bench";
  const std::string name = "bushd2-constant";
  const auto path = tables::find(name, tables::shipped_directories());
  if (!path) throw std::runtime_error(path.error().text());
  const auto table = tables::load(*path);
  if (!table) throw std::runtime_error(table.error().text());
  config.groups.push_back({.name = "axes", .table_name = name, .table = *table});
  config.buses.push_back({.name = "hall",
                          .port = "simulated",
                          .baud = 4'000'000,
                          .tick_us = 10'240,
                          .format = BUSHD_FORMAT_COARSE});
  for (std::size_t m = 0; m < VirtualHall::kMcus; ++m) {
    config.mcus.push_back({.bus = {0},
                           .address = {static_cast<std::uint8_t>(m + 1)},
                           .id = "hall:" + std::to_string(m + 1)});
    for (std::uint8_t output = 0; output < BUSHD_MOTORS_PER_MCU; ++output) {
      config.motors.push_back({.name = "m" + std::to_string(config.motors.size() + 1),
                               .mcu = {m},
                               .output = {output},
                               .group = {0}});
    }
  }
  return config;
}

}  // namespace

VirtualHall::VirtualHall()
    : config_(make_config()),
      bus_(std::make_unique<bushd::sim::Bus>(config_.buses[0].baud)),
      ready_(kMcus) {
  for (std::size_t m = 0; m < kMcus; ++m) {
    bushd::sim::McuOptions options;
    options.address = config_.mcus[m].address.value;
    bus_->add_mcu(options);
  }
  bus_->on_master_byte = [this](std::uint8_t byte, bushd::sim::TimeNs) {
    received_.push_back(byte);
  };
  core_ = std::make_unique<bushd::daemon::Core>(config_, *this, std::uint16_t{1});
  core_->port_opened(0, {});
  while (!all_ready() && now_ns_ < kLimitNs) {
    now_ns_ += kStepNs;
    bus_->advance_to(now_ns_);
    core_->receive(now_us(), {}, std::exchange(received_, {}));
    core_->step(now_us());
  }
  if (!all_ready()) throw std::runtime_error("the virtual MCUs are not ready");
}

bool VirtualHall::all_ready() const {
  return std::ranges::all_of(ready_, [](bool ready) { return ready; });
}

void VirtualHall::send(bushd::BusId, std::span<const std::uint8_t> bytes) {
  bus_->master_send(bytes, std::max(now_ns_, bus_->now_ns()));
}

void VirtualHall::publish(bushd::McuId mcu, const bushd::api::StateSnapshot& state) {
  ready_[mcu.value] = state.state == bushd::api::McuState::kReady;
}

}  // namespace bench
