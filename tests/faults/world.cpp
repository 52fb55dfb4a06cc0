#include "world.h"

#include <fmt/core.h>

#include <algorithm>

#include "bare_world.h"
#include "programs.h"
#include "times.h"

namespace bushfaults {
namespace {

using bushd::sim::kNever;
using bushd::sim::TimeNs;

constexpr TimeNs kWellAfterNs = 5 * kSecond;  // the promise: READY by itself
constexpr TimeNs kSkewPeriodNs = 20 * kMs;
constexpr TimeNs kMoveNs = 12 * kSecond;   // the clients' longest, with a start and a result
constexpr std::uint32_t kWorldStream = 1;  // of randomness
constexpr std::uint32_t kLateStream = 403;
constexpr std::uint32_t kFaultStream = 300;  // and one for each kind of fault

bushd::sim::McuOptions mcu_options(const bushd::config::Mcu& mcu, std::size_t index,
                                   std::int64_t crystal_ppm, bushd::sim::Random& random) {
  bushd::sim::McuOptions options;
  options.address = mcu.address.value;
  options.boot_number = static_cast<std::uint16_t>(1000 * (index + 1));
  options.boot_ns = random.between(0, 3 * kMs);
  options.clock_ppm = static_cast<std::int32_t>(random.between(-crystal_ppm, crystal_ppm));
  options.turnaround_ns = static_cast<std::uint32_t>(random.between(10'000, 1'000'000));
  return options;
}

}  // namespace

World::World(const Options& options, bushd::config::Config config, bushd::config::Config whole)
    : options_(options),
      config_(std::move(config)),
      whole_(std::move(whole)),
      plant_(config_.mcus.size()),
      bus_(config_.buses[0].baud, &plant_),
      witness_(config_, bus_, plant_, recent_),
      skew_(config_, bus_, witness_),
      clients_(config_, witness_, options.command_rates, options.seed),
      bare_(options.bare.any()
                ? std::make_unique<BareWorld>(whole_, config_.buses.size(), options.bare,
                                              options.seed, options.keep_positions, recent_,
                                              [this](TimeNs now_ns, const std::string& what) {
                                                witness_.violated(now_ns, what);
                                              })
                : nullptr),
      host_(whole_, bus_, witness_, recent_, bare_.get(), options.seed, options.keep_positions),
      mail_(clients_, host_, options.seed) {
  add_mcus();
  add_motors();
  witness_.positions().be_strict(options.strict_known);
  if (options.keep_positions) {
    witness_.positions().keep();
    witness_.keep_offsets();
  }
  overheard_ = std::make_unique<Overheard>(bus_, plant_, skew_, witness_);
  inputs_ = std::make_unique<Inputs>(config_, bus_, plant_, witness_, options.seed);
  second_ = std::make_unique<SecondDaemon>(config_, bus_, recent_, options.seed);
  for (std::size_t i = 0; i < kFaultKinds; ++i) {
    chance_.emplace_back(options.seed, kFaultStream + static_cast<std::uint32_t>(i));
  }
}

World::~World() = default;

void World::add_mcus() {
  bushd::sim::Random random(options_.seed, kWorldStream);
  bushd::sim::Random late(options_.seed, kLateStream);
  const std::size_t present = config_.mcus.size() - options_.absent_mcus;
  for (std::size_t i = 0; i < config_.mcus.size(); ++i) {
    auto options = mcu_options(config_.mcus[i], i, options_.crystal_ppm, random);
    // The models of CAMAC modules know no program that an MCU makes of codes which rise and fall.
    if (!config_.crates.empty()) options.disabled_capabilities = BUSHD_CAN_PROGRAM;
    if (i >= present) options.boot_ns = kNever / 2;
    if (i < present && i + options_.late_mcus >= present) {
      options.boot_ns = late.between(kSecond, kHour / 6);
    }
    bus_.add_mcu(options);
  }
}

void World::add_motors() {
  const bushd::config::Bus& bus = config_.buses[0];
  for (const bushd::config::Group& group : config_.groups) {
    rules_.push_back(std::make_unique<bushd::sim::PaceRules>(
        group.table->view(), bus.tick_ns(), bushd::sim::McuOptions{}.slots, bus.format));
  }
  if (!config_.crates.empty()) allow_programs();
  for (const bushd::config::Motor& motor : config_.motors) {
    plant_.attach(motor.mcu.value, motor.output.value, *rules_[motor.group.value]);
  }
  witness_.on_run = [this](TimeNs now_ns, std::size_t mcu, std::size_t output, Witness::Run run) {
    plant_.forget_line(mcu, output);  // a daemon that was killed has not told
    if (!run.waited) plant_.begin(mcu, output);
    if (run.on_line) plant_.begin_on_line(now_ns, mcu, output);
  };
  witness_.on_run_end = [this](TimeNs at_ns, std::size_t mcu, std::size_t output,
                               const std::string& word) {
    // Otherwise its MCU was lost, or went its own way, and may not rest yet.
    const bool rests = word != "link" && word != "fault";
    plant_.rest_on_line(at_ns, mcu, output, rests);
  };
  plant_.on_violation = [this](TimeNs time_ns, std::size_t mcu, std::size_t output,
                               const std::string& what) {
    witness_.violated(time_ns, fmt::format("{} output {}: {}", config_.mcus[mcu].id, output, what));
  };
  const auto shutter = ShutterPlace::motor(config_);
  if (shutter) {
    plant_.on_step = [this, index = shutter->value, its = config_[*shutter]](
                         TimeNs at_ns, std::size_t mcu, std::size_t output, bool positive) {
      if (its.mcu.value != mcu || its.output.value != output) return;
      witness_.shutter_stepped(at_ns, positive, witness_.positions().plant_steps(index));
    };
  }
  plant_.on_cut_off = [this](TimeNs time_ns, std::size_t mcu, std::size_t output) {
    witness_.positions().cut_off(time_ns, mcu, output);
  };
}

void World::allow_programs() {
  const bushd::config::Bus& bus = config_.buses[0];
  for (const bushd::config::CamacModule& module : config_.crates[0].modules) {
    const bushd::GroupId group = config_[module.motors[0]].group;
    const auto slowest = slowest_program(*config_[group].table);
    rules_[group.value]->allow_slower(bushd::sim::PaceRules(
        slowest->view(), bus.tick_ns(), bushd::sim::McuOptions{}.slots, bus.format));
  }
}

void World::run() {
  const auto end_ns = static_cast<TimeNs>(options_.hours * static_cast<double>(kHour));
  bushd::sim::Random random(options_.seed, kWorldStream + 1);
  run_until(2 * kSecond);
  while (!witness_.violation() && now_ns_ < end_ns) {
    spell_of_trouble(std::min(now_ns_ + random.magnitude(20 * kSecond, 600 * kSecond), end_ns));
    calm();
  }
}

void World::spell_of_trouble(TimeNs until_ns) {
  next_command_ns_ = clients_.next_after(now_ns_);
  for (std::size_t i = 0; i < kFaultKinds; ++i) {
    const double per_hour = options_.fault_rates[i];
    next_fault_ns_[i] =
        per_hour > 0 ? now_ns_ + chance_[i].wait(static_cast<double>(kHour) / per_hour) : kNever;
  }
  if (bare_) bare_->trouble(true);
  while (now_ns_ < until_ns && !witness_.violation()) {
    const auto next = std::min_element(next_fault_ns_.begin(), next_fault_ns_.end());
    advance(std::min({until_ns, next_command_ns_, *next}));
    const auto kind = static_cast<std::size_t>(next - next_fault_ns_.begin());
    if (now_ns_ >= *next) {
      strike(static_cast<FaultKind>(kind));
      *next = now_ns_ + chance_[kind].wait(static_cast<double>(kHour) / options_.fault_rates[kind]);
    }
    if (now_ns_ >= next_command_ns_) {
      if (const auto request = clients_.next()) {
        mail_.send(now_ns_, *request);
      } else {
        mail_.send_again();
      }
      next_command_ns_ = clients_.next_after(now_ns_);
    }
    for (const Request& request : clients_.due(now_ns_)) mail_.send(now_ns_, request);
    if (now_ns_ - deadlines_checked_ns_ >= kSecond) {
      witness_.check_deadlines(now_ns_);
      deadlines_checked_ns_ = now_ns_;
    }
  }
}

void World::calm() {
  if (witness_.violation()) return;
  if (bare_) {
    bare_->trouble(false);
    bare_->let_go(now_ns_);
    run_until(bare_->faults_over_ns());
  }
  if (host_.kept() != nullptr) host_.kept()->lose_power_after(UINT64_MAX);
  run_until(std::max({now_ns_, host_.faults_over_ns(), mcus_up_ns_, inputs_->released_ns(),
                      mail_.quiet_ns(), second_->over_ns()}));
  mail_.settle();
  clients_.let_go();
  const TimeNs began_ns = now_ns_;
  mail_.send(now_ns_, clients_.stop_all());
  be_well(began_ns);
  if (witness_.violation()) return;
  run_until(now_ns_ + kSecond);
  const auto open = [this] { return witness_.commands_open() || (bare_ && bare_->any_open()); };
  while (open() && now_ns_ < began_ns + kMoveNs && !witness_.violation()) {
    run_until(now_ns_ + 100 * kMs);
  }
  if (witness_.violation()) return;
  if (open()) {
    witness_.violated(now_ns_, "a command without a result in calm" +
                                   (bare_ ? ", " + bare_->open_text() : std::string()));
  }
  witness_.check_deadlines(now_ns_);
  if (const std::uint64_t steps = witness_.steps_unaccounted(); steps != 0) {
    witness_.violated(now_ns_, fmt::format("{} steps unaccounted", steps));
  }
  witness_.calm();
  if (options_.keep_positions) night();
}

void World::be_well(TimeNs began_ns) {
  for (std::size_t i = 0; i < config_.mcus.size(); ++i) witness_.expect(i, is_up(i));
  const auto ready = [this] { return witness_.all_ready() && (!bare_ || !bare_->not_ready()); };
  while (!ready() && now_ns_ < began_ns + kWellAfterNs && !witness_.violation()) {
    run_until(std::min(now_ns_ + 100 * kMs, began_ns + kWellAfterNs));
    // What a client has switched off or stopped only a client sets going again.
    mail_.send(now_ns_, clients_.emergency() ? clients_.clear_all() : clients_.enable_all());
    if (witness_.program_may_go_on()) mail_.send(now_ns_, clients_.stop_all());
    if (bare_ && bare_->not_ready()) bare_->clear_faults();
  }
  if (ready() || witness_.violation()) return;
  const auto of_bare = bare_ ? bare_->not_ready() : std::nullopt;
  witness_.violated(now_ns_, "not READY 5 s after the last fault: " + witness_.not_ready() +
                                 of_bare.value_or(""));
}

void World::run_until(TimeNs until_ns) {
  while (now_ns_ < until_ns && !witness_.violation()) advance(until_ns);
}

// To the next thing that happens in the host, at most to until_ns.
void World::advance(TimeNs until_ns) {
  now_ns_ = std::max(now_ns_, std::min(until_ns, host_.next_ns()));
  bus_.advance_to(now_ns_);
  host_.run(now_ns_);
  inputs_->run(now_ns_);
  mail_.run(now_ns_);
  if (second_->talks()) witness_.second_daemon(now_ns_);
  const auto wrong_of_second = second_->run(
      now_ns_, {.runs_since_ns = host_.runs_since_ns(), .said_state_ns = host_.said_state_ns()});
  if (wrong_of_second) witness_.violated(now_ns_, *wrong_of_second);
  if (now_ns_ - skew_checked_ns_ < kSkewPeriodNs) return;
  skew_checked_ns_ = now_ns_;
  witness_.watch(now_ns_);
  if (const auto wrong = skew_.check(now_ns_)) witness_.violated(now_ns_, *wrong);
}

void World::note_fault(FaultKind kind, const std::string& detail) {
  ++faults_[static_cast<std::size_t>(kind)];
  recent_.note(now_ns_, fmt::format("fault: {} {}", info(kind).name, detail));
}

// Those that have not come yet, or never do, are in their first reset.
bool World::is_up(std::size_t mcu) const {
  return bus_.mcu(mcu).running() || bus_.mcu(mcu).next_event_ns() < now_ns_ + 5 * kSecond;
}

void World::reset_mcu() {
  bushd::sim::Random& random = chance_[static_cast<std::size_t>(FaultKind::kReset)];
  const auto mcu = static_cast<std::size_t>(random.below(bus_.mcu_count()));
  const TimeNs down_ns = random.magnitude(kMs, 2 * kSecond);
  if (!is_up(mcu)) return;
  take_power_of(mcu, down_ns);
  note_fault(FaultKind::kReset, fmt::format("{} for {} ms", config_.mcus[mcu].id, down_ns / kMs));
}

void World::take_power_of(std::size_t mcu, TimeNs for_ns) {
  bus_.reboot(mcu, for_ns);
  plant_.cut(mcu);
  witness_.mcu_reset(mcu);
  overheard_->mcu_reset(mcu);
  mcus_up_ns_ = std::max(mcus_up_ns_, now_ns_ + for_ns);
}

void World::deafen_mcu() {
  bushd::sim::Random& random = chance_[static_cast<std::size_t>(FaultKind::kDeafMcu)];
  const auto mcu = static_cast<std::size_t>(random.below(bus_.mcu_count()));
  const TimeNs length_ns = random.magnitude(20'000, 50 * kMs);
  bus_.deafen(mcu, now_ns_ + length_ns);
  note_fault(FaultKind::kDeafMcu,
             fmt::format("{} for {} us", config_.mcus[mcu].id, length_ns / 1000));
}

void World::strike(FaultKind kind) {
  bushd::sim::Random& random = chance_[static_cast<std::size_t>(kind)];
  TimeNs length_ns = 0;
  switch (kind) {
    case FaultKind::kDeafMcu:
      return deafen_mcu();
    case FaultKind::kReset:
      return reset_mcu();
    case FaultKind::kPowerCut:
      return cut_power();
    case FaultKind::kDiskFault:
      return disturb_disk();
    case FaultKind::kLimitSwitch:
      return note_fault(kind, inputs_->press_limit(now_ns_, random));
    case FaultKind::kEmergencyInput:
      return note_fault(kind, inputs_->press_emergency(now_ns_, random));
    case FaultKind::kTrigger:
      return note_fault(kind, inputs_->trigger(now_ns_, random));
    case FaultKind::kSlowRequest:
      return note_fault(kind, mail_.delay_next(random));
    case FaultKind::kLostRequest:
      return note_fault(kind, mail_.lose_next(random));
    case FaultKind::kLostAnswer:
      return note_fault(kind, mail_.lose_answers(random));
    case FaultKind::kNumberLeap:
      return note_fault(kind, mail_.leap_next(random));
    case FaultKind::kNumberReuse:
      return note_fault(kind, mail_.reuse_next(random));
    case FaultKind::kLateRepeat:
      return note_fault(kind, mail_.repeat(random));
    case FaultKind::kStaleRepeat:
      return note_fault(kind, mail_.repeat_stale(random));
    case FaultKind::kFlood:
      return note_fault(kind, mail_.flood(now_ns_, random, 200));
    case FaultKind::kCrowd:
      return note_fault(kind, mail_.flood(now_ns_, random, 2'000));
    case FaultKind::kSecondDaemon:
      return note_fault(kind, second_->start(now_ns_, random));
    case FaultKind::kSilence:
      length_ns = random.magnitude(kMs, 10 * kSecond);
      host_.silence(now_ns_ + length_ns);
      break;
    case FaultKind::kUnplug:
      length_ns = random.magnitude(10 * kMs, 5 * kSecond);
      host_.unplug(now_ns_, now_ns_ + length_ns);
      break;
    case FaultKind::kPause:
      length_ns = random.magnitude(100 * kMs, 3 * kSecond);
      host_.pause(now_ns_, now_ns_ + length_ns);
      break;
    case FaultKind::kEnd:
      length_ns = random.magnitude(10 * kMs, 3 * kSecond);
      host_.end(now_ns_, length_ns);
      break;
    case FaultKind::kKill:
      length_ns = random.magnitude(10 * kMs, 3 * kSecond);
      host_.kill(now_ns_, now_ns_ + length_ns);
      break;
    default: {
      const bool out = random.one_in(2);
      host_.garble(out ? Host::Direction::kOut : Host::Direction::kIn,
                   static_cast<bushd::sim::Garbling>(kind));
      return note_fault(kind, out ? "to the MCUs" : "to the daemon");
    }
  }
  note_fault(kind, fmt::format("for {} ms", length_ns / kMs));
}

}  // namespace bushfaults
