#include "daemon/live_bench.h"

#include <algorithm>

namespace bushd::test {

LiveBench::LiveBench(const std::string& toml) : Bench(toml), line(config.buses[0].baud) {
  for (std::size_t m = 0; m < config.mcus.size(); ++m) {
    line.add_mcu({.address = config.mcus[m].address.value,
                  .boot_number = static_cast<std::uint16_t>(m + 1),
                  .boot_ns = static_cast<sim::TimeNs>(m) * 777'777});
  }
  line.on_master_byte = [this](std::uint8_t byte, sim::TimeNs) {
    if (!silent) received_.push_back(byte);
  };
}

LiveBench::~LiveBench() = default;

void LiveBench::connect(daemon::Service& service) {
  service_ = &service;
  supervisor_.emplace(installation, journal, moves, positions, kept, emergency_stop,
                      std::vector<daemon::Service*>{&journal, &moves, &homing, &emergency_stop,
                                                    &positions, &service},
                      *this);
  installation[kBus].master.port_opened(now_us());
  ASSERT_TRUE(run_until([this] { return all_online(); })) << "not all MCUs are online";
}
bool LiveBench::all_online() const {
  return std::ranges::all_of(installation.mcus(),
                             [this](McuId mcu) { return installation[mcu].online(); });
}

bool LiveBench::run_until(const std::function<bool()>& done, double limit_s) {
  const auto limit_ns = now_ns_ + static_cast<sim::TimeNs>(limit_s * 1e9);
  while (now_ns_ < limit_ns && !done()) advance();
  return done();
}
void LiveBench::run_for(double seconds) {
  run_until([] { return false; }, seconds);
}

std::vector<api::Reply> LiveBench::replies(std::int64_t number) const {
  std::vector<api::Reply> found;
  for (const auto& [to, reply] : client->answers) {
    if (to == number) found.push_back(reply);
  }
  return found;
}
std::string LiveBench::refusal(std::int64_t number) const {
  const auto all = replies(number);
  if (all.size() != 1 || !std::holds_alternative<api::Refused>(all[0])) return "not refused";
  return std::get<api::Refused>(all[0]).reason;
}
bool LiveBench::is_completed(std::int64_t number) const {
  const auto all = replies(number);
  return !all.empty() && std::holds_alternative<api::Completed>(all.back());
}
api::Completed LiveBench::result(std::int64_t number) {
  EXPECT_TRUE(run_until([&] { return is_completed(number); })) << "no result in time";
  const auto all = replies(number);
  if (all.size() != 2 || !std::holds_alternative<api::Accepted>(all[0]) ||
      !std::holds_alternative<api::Completed>(all[1])) {
    ADD_FAILURE() << "request " << number << " was not accepted and completed once";
    return {};
  }
  return std::get<api::Completed>(all[1]);
}

void LiveBench::move(std::int64_t number, const std::string& motor, std::int64_t steps) {
  moves.request(now_us(), asker(number),
                api::Move{.kind = api::Move::Kind::kRelative, .motors = {{motor, steps}}});
}
const bushd_report& LiveBench::report_of(const std::string& name) const {
  return installation.mcu_of(motor(name)).report();
}
std::int64_t LiveBench::shaft_steps(const std::string& name) const {
  const config::Motor& its = config[motor(name)];
  return line.mcu(its.mcu.value).shaft(its.output.value).position_steps;
}

void LiveBench::send(BusId, std::span<const std::uint8_t> bytes) {
  if (!silent) line.master_send(bytes, now_ns_);
}

void LiveBench::advance() {
  link::BusMaster& master = installation[kBus].master;
  const std::span<const std::uint8_t> bytes = master.step(now_us());
  if (!bytes.empty()) send(kBus, bytes);
  supervisor_->handle_events(now_us(), installation[kBus]);
  for (daemon::Service* service : {static_cast<daemon::Service*>(&emergency_stop),
                                   static_cast<daemon::Service*>(&positions), service_}) {
    service->step(now_us());
  }
  if (!dry_runs.idle()) dry_runs.work();
  now_ns_ = std::max(now_ns_, std::min(std::max(master.next_wake_us() * 1000, now_ns_ + 1000),
                                       line.next_event_ns()));
  line.advance_to(now_ns_);
  if (received_.empty()) return;
  master.receive(now_us(), std::exchange(received_, {}));
  supervisor_->handle_events(now_us(), installation[kBus]);
}

}  // namespace bushd::test
