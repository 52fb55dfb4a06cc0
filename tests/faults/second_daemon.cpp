#include "second_daemon.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "times.h"

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

constexpr std::uint32_t kSecondDaemonStream = 405;  // of randomness
constexpr TimeNs kLookNs = 750 * kMs;               // as daemon/shell/channel_claim.cpp
constexpr TimeNs kMovePeriodNs = 100 * kMs;         // of its clients

}  // namespace

class SecondDaemon::Client final : public bushd::api::Session {
 public:
  explicit Client(Counts& counts)
      : Session(bushd::api::Transport::kLcm, "second", true), counts_(counts) {}
  void answer(std::int64_t, const bushd::api::Reply& reply) override {
    if (std::holds_alternative<bushd::api::Accepted>(reply)) ++counts_.moves_accepted;
    if (std::holds_alternative<bushd::api::Refused>(reply)) ++counts_.moves_refused;
  }

 private:
  Counts& counts_;
};

SecondDaemon::SecondDaemon(const bushd::config::Config& config, bushd::sim::Bus& bus,
                           Recent& recent, std::uint64_t seed)
    : config_(config),
      bus_(bus),
      recent_(recent),
      random_(seed, kSecondDaemonStream),
      client_(std::make_shared<Client>(counts_)) {
  bus_.add_second_master();
  bus_.on_second_master_byte = [this](std::uint8_t byte, TimeNs end_ns) {
    if (core_) inbox_.push_back({end_ns + latency_ns_, byte});
  };
}

SecondDaemon::~SecondDaemon() {
  bus_.on_second_master_byte = nullptr;
}

std::string SecondDaemon::start(TimeNs now_ns, bushd::sim::Random& random) {
  const bool shares_network = random.one_in(2);
  const TimeNs length_ns = random.magnitude(100 * kMs, 30'000 * kMs);
  if (now_ns < until_ns_) return "(one runs)";
  now_ns_ = now_ns;
  if (shares_network) {
    looks_since_ns_ = now_ns;
    until_ns_ = now_ns + kLookNs;
    return "on the network of the first";
  }
  until_ns_ = now_ns + length_ns;
  begin_to_run();
  return fmt::format("on another network, for {} ms", length_ns / kMs);
}

void SecondDaemon::begin_to_run() {
  ++counts_.ran;
  latency_ns_ = random_.magnitude(400'000, 16 * kMs);
  next_move_ns_ = now_ns_;
  core_ = std::make_unique<bushd::daemon::Core>(
      config_, *this, static_cast<std::uint16_t>(random_.below(1u << 16)));
  core_->port_opened(now_us(), {});
}

std::optional<std::string> SecondDaemon::run(TimeNs now_ns, const First& first) {
  now_ns_ = now_ns;
  if (looks_since_ns_ && now_ns_ >= until_ns_) {
    const TimeNs since_ns = *std::exchange(looks_since_ns_, std::nullopt);
    const bool heard = first.said_state_ns >= since_ns;
    counts_.found_other += heard;
    if (!heard && first.runs_since_ns && *first.runs_since_ns <= since_ns) {
      return "a second daemon on the same network has not heard of the first for 750 ms";
    }
  }
  if (!core_) return std::nullopt;
  if (now_ns_ >= until_ns_) {
    recent_.note(now_ns_, "the second daemon is ended");
    core_.reset();
    inbox_.clear();
    return std::nullopt;
  }
  take_in();
  if (now_ns_ >= next_move_ns_) try_to_move();
  core_->step(now_us());
  return std::nullopt;
}

void SecondDaemon::take_in() {
  std::vector<std::uint8_t> bytes;
  while (!inbox_.empty() && inbox_.front().due_ns <= now_ns_) {
    bytes.push_back(inbox_.front().byte);
    inbox_.pop_front();
  }
  if (!bytes.empty()) core_->receive(now_us(), {}, bytes);
}

void SecondDaemon::try_to_move() {
  next_move_ns_ = now_ns_ + kMovePeriodNs;
  bushd::api::Move move;
  move.motors.push_back({random_.pick(config_.motors).name, random_.between(-500, 500)});
  core_->request(now_us(), {.session = client_, .number = 1}, move);
}

void SecondDaemon::send(bushd::BusId, std::span<const std::uint8_t> bytes) {
  free_ns_ = std::max(free_ns_, now_ns_ + random_.between(20'000, latency_ns_ / 4));
  bus_.second_master_send(bytes, free_ns_);
}

void SecondDaemon::log(bushd::daemon::LogLevel level, bushd::daemon::LogSubject,
                       const std::string& text) {
  if (level != bushd::daemon::LogLevel::kInfo) recent_.note(now_ns_, "log of the second: " + text);
}

void SecondDaemon::serve_tables(const bushd::api::Asker& asker, const bushd::api::Request&) {
  asker.answer(bushd::api::Refused{"there are no table files here"});
}

}  // namespace bushfaults
