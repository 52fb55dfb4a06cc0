#include "host.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "bare_world.h"
#include "times.h"

namespace bushfaults {
namespace {

constexpr std::uint32_t kHostStream = 200;  // of randomness; garblers have the next two
// What an adapter adds to each transfer, another at each plugging in: from a good one to one whose
// latency timer is as long as its maker set it.
constexpr bushd::sim::TimeNs kMaxLatencyNs = 16'000'000;

constexpr bushd::sim::TimeNs kStartAgainNs = 100'000'000;

// One that is asked to end is watched for so long at least: nothing begins meanwhile. systemd kills
// one that takes longer than the other.
constexpr bushd::sim::TimeNs kEndWatchedNs = 6 * kSecond;
constexpr bushd::sim::TimeNs kEndsInNs = 20 * kSecond;

}  // namespace

Host::Host(const bushd::config::Config& config, bushd::sim::Bus& bus, Witness& witness,
           Recent& recent, BareWorld* bare, std::uint64_t seed, bool keeps)
    : config_(config),
      bus_(bus),
      witness_(witness),
      recent_(recent),
      bare_(bare),
      random_(seed, kHostStream),
      garbler_{bushd::sim::Garbler(seed, kHostStream + 1),
               bushd::sim::Garbler(seed, kHostStream + 2)} {
  bus_.on_master_byte = [this](std::uint8_t byte, TimeNs end_ns) {
    if (plugged_ && end_ns >= silent_until_ns_) arriving_.push_back(byte);
  };
  if (keeps) kept_ = std::make_unique<Kept>(config, seed);
  plug_in();
  start();
}

Host::~Host() {
  bus_.on_master_byte = nullptr;
}

void Host::start() {
  witness_.daemon_started(now_ns_);
  published_.assign(config_.mcus.size(), {});
  run_number_ = random_.between(1, std::numeric_limits<std::int64_t>::max());
  daemon_ = std::make_unique<DaemonRun>(
      config_, *this,
      DaemonRun::Ears{
          .carry_out = [this](const auto& asker,
                              const auto& request) { return carry_out(asker, request); },
          .said = [this](const auto& message) { hear(message); },
          .now_us = [this] { return now_us(); }},
      run_number_);
  inbox_.clear();
  if (kept_) {
    if (const auto used = kept_->use(now_ns_, core()); !used) {
      recent_.note(now_ns_, "it cannot start: " + used.error().text());
      return kill(now_ns_, now_ns_ + kStartAgainNs);
    }
  }
  if (plugged_) core().port_opened(now_us(), {});
  if (bare_ != nullptr) bare_->daemon_started(now_ns_, *daemon_);
  step();
}

void Host::plug_in() {
  plugged_ = true;
  latency_ns_ = random_.magnitude(kStrideNs, kMaxLatencyNs);
  if (daemon_) core().port_opened(now_us(), {});
}

void Host::send(bushd::BusId bus, std::span<const std::uint8_t> bytes) {
  if (bare_ != nullptr && bare_->has(bus)) return bare_->send(now_ns_, bus, bytes);
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

bool Host::may_read() const {
  return !inbox_.empty() && inbox_.front().due_ns <= now_ns_ &&
         daemon_->core().listen_from_us({}) <= now_us();
}

void Host::deliver() {
  while (may_read()) {
    core().receive(now_us(), {}, inbox_.front().bytes);
    inbox_.pop_front();
  }
}

void Host::step() {
  daemon_->step();
  if (bare_ != nullptr) bare_->answer_orders(now_ns_, *daemon_);
  if (!witness_.promise().heard_all()) {
    witness_.violated(now_ns_, "an answer of the core's has not arrived");
  }
  wake_ns_ = std::max(core().next_wake_us(), now_us() + 1) * 1000;
  if (!daemon_->idle()) wake_ns_ = now_ns_;
}

bool Host::anything_due() const {
  return (ends_at_ns_ && now_ns_ >= *ends_at_ns_) || now_ns_ >= wake_ns_ || !messages_.empty() ||
         !disk_.empty() || may_read() || (kept_ && kept_->next_ns() <= now_ns_) ||
         (bare_ != nullptr && bare_->due(now_ns_));
}

void Host::run(TimeNs now_ns) {
  now_ns_ = now_ns;
  if (kept_ && !kept_->has_power()) {
    recent_.note(now_ns_, "the PC has lost power while it wrote to its disk");
    cut_power(now_ns_, now_ns_ + kStartAgainNs);
  }
  if (bare_ != nullptr) bare_->advance_to(now_ns_);
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
    if (!daemon_) return;
  }
  if (now_ns_ < paused_until_ns_ || !anything_due()) return;
  deliver();
  if (bare_ != nullptr) bare_->tell(now_ns_, *daemon_);
  if (kept_) kept_->run(now_ns_, core());
  for (const auto& told : std::exchange(disk_, {})) told();
  daemon_->hear();
  while (!messages_.empty()) {
    const Message message = std::move(messages_.front());
    messages_.pop_front();
    std::visit([this](const auto& content) { give(content); }, message);
  }
  daemon_->carry_out_some();
  step();
  end_if_due();
}

void Host::end(TimeNs now_ns, TimeNs gone_ns) {
  now_ns_ = now_ns;
  if (!daemon_ || ends_at_ns_) return;
  ends_at_ns_ = now_ns + kEndWatchedNs;
  gone_ns_ = gone_ns;
  witness_.daemon_ends(now_ns);
  if (bare_ != nullptr) bare_->daemon_ends(now_ns);
  core().shut_down(now_us());
  step();
}

// As the daemon's own loop does it (daemon/shell/event_loop.cpp).
bool Host::end_if_due() {
  if (!ends_at_ns_ || now_ns_ < *ends_at_ns_) return false;
  const bool rests =
      core().at_rest() && core().settled() && (bare_ == nullptr || !bare_->any_open());
  if (!rests && now_ns_ < *ends_at_ns_ - kEndWatchedNs + kEndsInNs) return false;
  kill(now_ns_, now_ns_ + gone_ns_);
  return true;
}

void Host::check(const std::optional<std::string>& wrong) {
  if (wrong) witness_.violated(now_ns_, *wrong);
}

void Host::give(const bushd::lcm::Hello& hello) {
  Promise& promise = witness_.promise();
  promise.give(hello);
  daemon_->give(bushd::lcm::encode(now_us(), hello).value());
  check(promise.hello_given());
}

void Host::give(const Request& request) {
  const bool usable = request.damage == Damage::kNone && bushd::api::is_client_id(request.client);
  if (usable) witness_.arrives(request);
  const std::uint64_t dropped = daemon_->dropped();
  recent_.note(now_ns_, text_of(request));
  if (usable) witness_.promise().give(request);
  daemon_->give(packet_of(request));
  if (usable) check(witness_.promise().given());
  if (usable != (daemon_->dropped() == dropped)) {
    witness_.violated(now_ns_, (usable ? "dropped: " : "not dropped: ") + text_of(request));
  }
}

// What the core answers, at the moment when it does: messages arrive later.
class Host::Overhearing final : public bushd::api::Session {
 public:
  Overhearing(Host& host, bushd::api::Asker asker, Key key, std::size_t kind)
      : Session(bushd::api::Transport::kLcm, asker.session->client_id(), true),
        host_(host),
        asker_(std::move(asker)),
        key_(std::move(key)),
        kind_(kind) {}
  void answer(std::int64_t, const bushd::api::Reply& reply) override {
    host_.witness_.reply(host_.now_ns_, key_, kind_, reply);
    asker_.answer(reply);
  }

 private:
  Host& host_;
  bushd::api::Asker asker_;
  Key key_;
  std::size_t kind_;
};

bushd::api::Asker Host::carry_out(const bushd::api::Asker& asker,
                                  const bushd::api::Request& request) {
  if (bare_ != nullptr) {
    if (const auto own = bare_->hear(now_ns_, asker, request)) return *own;
  }
  const auto asked = witness_.promise().carried_out(asker.session->client_id(), asker.number);
  if (!asked || packet_of(*asked).payload !=
                    bushd::lcm::encode(asked->sent_us, asked->id(), request).value().payload) {
    witness_.violated(now_ns_,
                      fmt::format("carried out, and was not to be: {} #{}: {}",
                                  asker.session->client_id(), asker.number, name_of(request)));
    return asker;
  }
  witness_.carried_out(now_ns_, *asked);
  return {
      .session = std::make_shared<Overhearing>(*this, asker, key_of(asked->id()), request.index()),
      .number = asker.number,
      .after_stops = asker.after_stops};
}

void Host::hear(const std::optional<bushd::lcm::DaemonMessage>& message) {
  if (!message) return witness_.violated(now_ns_, "a message of the daemon's means nothing");
  if (const auto* welcome = std::get_if<bushd::lcm::Welcome>(&*message)) {
    check(witness_.promise().hear(*welcome));
  } else if (const auto* reply = std::get_if<bushd::lcm::ReplyMessage>(&*message)) {
    check(witness_.promise().hear(*reply));
  } else if (const auto* state = std::get_if<bushd::lcm::StateMessage>(&*message)) {
    const auto mcu = static_cast<std::size_t>(state->part.part);
    if (mcu >= published_.size() || published_[mcu] != state->snapshot) {
      witness_.violated(now_ns_, "a state arrives otherwise than it was published");
    }
    said_state_ns_ = now_ns_;
  }
  if (on_message) on_message(*message);
}

void Host::publish(bushd::McuId mcu, const bushd::api::StateSnapshot& state) {
  if (bare_ != nullptr && bare_->has(mcu)) {
    bare_->state(now_ns_, state);
  } else {
    witness_.state(now_ns_, mcu.value, state);
  }
  published_[mcu.value] = state;
  daemon_->publishing().publish(mcu, state);
}

void Host::publish(bushd::McuId mcu, const bushd::api::Description& description) {
  if (bare_ == nullptr || !bare_->has(mcu)) witness_.description(now_ns_, description);
  daemon_->publishing().publish(mcu, description);
}

void Host::publish(bushd::BusId bus, const bushd::api::HealthSnapshot& health) {
  daemon_->publishing().publish(bus, health);
}

void Host::publish_lam(const bushd::api::CamacLam& lam) {
  witness_.lam(now_ns_, lam);
  daemon_->publishing().publish_lam(lam);
}

void Host::pulse(bushd::BusId bus, const bushd::link::PulseOrder& order) {
  bare_->pulse(now_ns_, bus, order);
}

void Host::move_log(const std::string& line) {
  if (bare_ == nullptr || !bare_->has(line)) witness_.move_log(now_ns_, line);
}

void Host::serve_tables(const bushd::api::Asker& asker, const bushd::api::Request&) {
  asker.answer(bushd::api::Refused{"there are no table files here"});
}

Host::TimeNs Host::next_ns() const {
  TimeNs next = now_ns_ + kStrideNs;
  if (!plugged_) next = std::min(next, back_ns_);
  if (!daemon_) return std::min(next, starts_ns_);
  if (now_ns_ < paused_until_ns_) return std::min(next, paused_until_ns_);
  if (!inbox_.empty()) next = std::min(next, inbox_.front().due_ns);
  if (kept_) next = std::min(next, kept_->next_ns());
  if (ends_at_ns_) next = std::min(next, *ends_at_ns_);
  return std::max(std::min(next, wake_ns_), now_ns_ + 1000);
}

std::optional<Host::TimeNs> Host::runs_since_ns() const {
  if (!daemon_ || now_ns_ < paused_until_ns_) return std::nullopt;
  return std::max(starts_ns_, paused_until_ns_);
}

void Host::receive(const Message& message) {
  if (daemon_) messages_.push_back(message);
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
  if (bare_ != nullptr) bare_->daemon_paused(until_ns);
}

void Host::kill(TimeNs now_ns, TimeNs until_ns) {
  now_ns_ = now_ns;
  starts_ns_ = daemon_ ? until_ns : std::max(starts_ns_, until_ns);
  if (bare_ != nullptr) bare_->daemon_gone(now_ns, false);
  daemon_.reset();
  ends_at_ns_.reset();
  messages_.clear();
  disk_.clear();
  paused_until_ns_ = 0;
  if (kept_) kept_->end_process();
}

void Host::cut_power(TimeNs now_ns, TimeNs until_ns) {
  kill(now_ns, until_ns);
  if (bare_ != nullptr) bare_->daemon_gone(now_ns, true);
  if (kept_) kept_->cut_power();
  arriving_.clear();
  free_ns_ = 0;
  bus_.break_off_master();
}

Host::TimeNs Host::faults_over_ns() const {
  TimeNs over = std::max(silent_until_ns_, paused_until_ns_);
  if (kept_) over = std::max(over, kept_->faults_over_ns());
  if (!plugged_) over = std::max(over, back_ns_);
  if (!daemon_) over = std::max(over, starts_ns_);
  if (ends_at_ns_) over = std::max(over, *ends_at_ns_ - kEndWatchedNs + kEndsInNs + gone_ns_);
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

void Host::log(bushd::daemon::LogLevel level, bushd::daemon::LogSubject, const std::string& text) {
  if (level != bushd::daemon::LogLevel::kInfo) recent_.note(now_ns_, "log: " + text);
  witness_.log(text);
}

}  // namespace bushfaults
