#include "host.h"

#include <algorithm>

namespace bushfaults {
namespace {

constexpr std::uint32_t kStream = 200;  // of randomness; garblers have the next two
// What an adapter adds to each transfer, another at each plugging in: from a good one to one whose
// latency timer is as long as its maker set it.
constexpr bushd::sim::TimeNs kMaxLatencyNs = 16'000'000;

}  // namespace

Host::Host(const bushd::config::Config& config, bushd::sim::Bus& bus, Witness& witness,
           Clients& clients, Recent& recent, std::uint64_t seed)
    : config_(config),
      bus_(bus),
      witness_(witness),
      clients_(clients),
      recent_(recent),
      random_(seed, kStream),
      garbler_{bushd::sim::Garbler(seed, kStream + 1), bushd::sim::Garbler(seed, kStream + 2)} {
  bus_.on_master_byte = [this](std::uint8_t byte, TimeNs end_ns) {
    if (plugged_ && end_ns >= silent_until_ns_) arriving_.push_back(byte);
  };
  plug_in();
  start();
}

Host::~Host() {
  bus_.on_master_byte = nullptr;
}

void Host::start() {
  daemon_ = std::make_unique<bushd::daemon::LcmShim>(
      config_, *this, static_cast<std::uint16_t>(random_.between(1, 0xFFFF)));
  witness_.daemon_started(now_ns_);
  clients_.begin_anew();
  inbox_.clear();
  if (plugged_) core().port_opened(now_us(), {});
  step();
}

void Host::plug_in() {
  plugged_ = true;
  latency_ns_ = random_.magnitude(kStrideNs, kMaxLatencyNs);
  if (daemon_) core().port_opened(now_us(), {});
}

void Host::send(bushd::BusId, std::span<const std::uint8_t> bytes) {
  const auto pieces = garbler_[static_cast<std::size_t>(Direction::kOut)].pass(now_ns_, bytes);
  if (!plugged_ || silent()) return;
  TimeNs at_ns = std::max(free_ns_, now_ns_ + random_.between(20'000, latency_ns_ / 4));
  for (const auto& piece : pieces) {
    at_ns += piece.delay_ns;
    if (!piece.bytes.empty()) bus_.master_send(piece.bytes, at_ns);
  }
  free_ns_ = at_ns;
}

void Host::take_in() {
  if (arriving_.empty()) return;
  const auto pieces = garbler_[static_cast<std::size_t>(Direction::kIn)].pass(now_ns_, arriving_);
  TimeNs due_ns = now_ns_ - kStrideNs + random_.between(kStrideNs, latency_ns_);
  if (!inbox_.empty()) due_ns = std::max(due_ns, inbox_.back().due_ns);
  for (const auto& piece : pieces) {
    due_ns += piece.delay_ns;
    if (!piece.bytes.empty()) inbox_.push_back({due_ns, piece.bytes});
  }
  arriving_.clear();
}

void Host::deliver() {
  while (!inbox_.empty() && inbox_.front().due_ns <= now_ns_) {
    core().receive(now_us(), {}, inbox_.front().bytes);
    inbox_.pop_front();
  }
}

void Host::step() {
  core().step(now_us());
  wake_ns_ = std::max(core().next_wake_us(), now_us() + 1) * 1000;
}

void Host::run(TimeNs now_ns) {
  now_ns_ = now_ns;
  take_in();
  if (!plugged_ && now_ns_ >= back_ns_) {
    recent_.note(now_ns_, "adapter is back");
    plug_in();
    wake_ns_ = now_ns_;
  }
  if (!daemon_) {
    if (now_ns_ < starts_ns_) return;
    recent_.note(now_ns_, "a new daemon starts");
    start();
  }
  if (now_ns_ < paused_until_ns_) return;
  const bool due = now_ns_ >= wake_ns_ || !requests_.empty() || !disk_.empty() ||
                   (!inbox_.empty() && inbox_.front().due_ns <= now_ns_);
  if (!due) return;
  deliver();
  for (const auto& told : std::exchange(disk_, {})) told();
  for (; !requests_.empty(); requests_.pop_front()) {
    witness_.request(now_ns_, requests_.front());
    give(*daemon_, now_us(), requests_.front());
  }
  step();
}

Host::TimeNs Host::next_ns() const {
  TimeNs next = now_ns_ + kStrideNs;
  if (!plugged_) next = std::min(next, back_ns_);
  if (!daemon_) return std::min(next, starts_ns_);
  if (now_ns_ < paused_until_ns_) return std::min(next, paused_until_ns_);
  if (!inbox_.empty()) next = std::min(next, inbox_.front().due_ns);
  return std::max(std::min(next, wake_ns_), now_ns_ + 1000);
}

void Host::request(TimeNs, const Request& request) {
  if (daemon_) requests_.push_back(request);  // else nobody listens
}

void Host::garble(Direction direction, bushd::sim::Garbling what) {
  garbler_[static_cast<std::size_t>(direction)].inflict(what);
}

void Host::silence(TimeNs until_ns) {
  silent_until_ns_ = std::max(silent_until_ns_, until_ns);
}

void Host::unplug(TimeNs now_ns, TimeNs until_ns) {
  now_ns_ = now_ns;
  back_ns_ = plugged_ ? until_ns : std::max(back_ns_, until_ns);
  if (!plugged_) return;
  plugged_ = false;
  arriving_.clear();
  inbox_.clear();
  free_ns_ = 0;
  bus_.break_off_master();
  // A paused daemon learns of it later; that is the same as a later unplugging to it.
  if (!daemon_) return;
  core().port_lost(now_us(), {}, "the adapter was unplugged");
  step();
}

void Host::pause(TimeNs now_ns, TimeNs until_ns) {
  paused_until_ns_ = std::max({paused_until_ns_, now_ns, until_ns});
  witness_.positions().pause(now_ns, until_ns);
}

void Host::kill(TimeNs now_ns, TimeNs until_ns) {
  now_ns_ = now_ns;
  starts_ns_ = daemon_ ? until_ns : std::max(starts_ns_, until_ns);
  daemon_.reset();
  requests_.clear();
  disk_.clear();
  paused_until_ns_ = 0;
}

Host::TimeNs Host::faults_over_ns() const {
  TimeNs over = std::max(silent_until_ns_, paused_until_ns_);
  if (!plugged_) over = std::max(over, back_ns_);
  if (!daemon_) over = std::max(over, starts_ns_);
  return over;
}

void Host::read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) {
  disk_.push_back([this, ticket, wanted] {
    std::vector<bushd::Result<bushd::tables::TablePtr>> read;
    for (const std::string& name : wanted) {
      const auto group = std::ranges::find(config_.groups, name, &bushd::config::Group::table_name);
      if (group == config_.groups.end()) {
        read.push_back(bushd::fail("there is no table \"" + name + "\""));
      } else {
        read.push_back(group->table);
      }
    }
    core().tables().read(now_us(), ticket, read);
  });
}

void Host::keep_tables(std::uint64_t ticket, const std::vector<std::string>&) {
  disk_.push_back([this, ticket] { core().tables().kept(ticket, {}); });
}

void Host::log(bushd::daemon::LogLevel level, const std::string& text) {
  if (level != bushd::daemon::LogLevel::kInfo) recent_.note(now_ns_, "log: " + text);
}

}  // namespace bushfaults
