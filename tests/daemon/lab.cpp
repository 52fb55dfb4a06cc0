#include "daemon/lab.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "tables/store/open.h"

namespace bushd::test {
namespace {

Answer answer_of(const api::Reply& reply) {
  if (const auto* refused = std::get_if<api::Refused>(&reply)) {
    return {.phase = Answer::kRefused, .result = "refused", .reason = refused->reason};
  }
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return {};
  Answer answer{.phase = Answer::kResult,
                .result = std::string(word(completed->outcome)),
                .reason = completed->reason};
  if (const auto* motors = std::get_if<std::vector<api::MotorResult>>(&completed->detail)) {
    for (const api::MotorResult& motor : *motors) {
      answer.motors.push_back(motor.motor);
      answer.users.push_back(motor.user);
      answer.motor_results.emplace_back(word(motor.outcome));
      answer.position_steps.push_back(motor.position_steps);
      answer.tables.push_back(motor.table);
      answer.legs.push_back(motor.legs);
      answer.most_steps_per_s.push_back(motor.most_steps_per_s);
    }
  }
  if (const auto* plan = std::get_if<api::MovePlan>(&completed->detail)) answer.plan = *plan;
  if (const auto* crate = std::get_if<api::CamacResult>(&completed->detail)) answer.camac = *crate;
  if (const auto* list = std::get_if<api::ProgramList>(&completed->detail)) {
    answer.programs = list->programs;
  }
  return answer;
}

// A converter does what the configuration says of it, to the last digit.
std::unique_ptr<sim::BoardLine> new_board(const config::Bus& bus, sim::EdgeSink* sink) {
  if (!bus.converter) return std::make_unique<sim::BoardLine>(bus.baud, bus.start_hz, sink);
  const sim::FrequencyConverter exact(
      {.hz_per_code = static_cast<double>(bus.converter->max_hz) / bus.converter->max_code});
  return std::make_unique<sim::BoardLine>(bus.baud, exact, sink);
}

}  // namespace

class Lab::Client final : public api::Session {
 public:
  explicit Client(std::string name = "test", api::Transport transport = api::Transport::kLcm)
      : Session(transport, std::move(name), true) {}
  bool gone() const override { return has_left; }
  void answer(std::int64_t number, const api::Reply& reply) override {
    answers[number].push_back(answer_of(reply));
    const auto* completed = std::get_if<api::Completed>(&reply);
    const auto* history =
        completed == nullptr ? nullptr : std::get_if<api::MotionHistory>(&completed->detail);
    if (history != nullptr) histories[number] = history->motions;
    const auto* configuration =
        completed == nullptr ? nullptr : std::get_if<api::Configuration>(&completed->detail);
    if (configuration != nullptr) configurations[number] = *configuration;
  }
  std::map<std::int64_t, std::vector<Answer>> answers;  // by number
  std::map<std::int64_t, std::vector<api::PastMotion>> histories;
  bool has_left = false;
  std::map<std::int64_t, api::Configuration> configurations;
};

Lab::Lab(const std::string& toml, const std::string& glacier, sim::EdgeSink* sink,
         std::uint32_t disabled_capabilities, bool keeps)
    : client_(std::make_shared<Client>()) {
  directory_ = std::filesystem::temp_directory_path() / ("bushd-lab-" + std::to_string(::getpid()));
  std::filesystem::create_directories(directory_);
  const auto path = directory_ / "bushd.toml";
  std::ofstream(path) << toml;
  if (!glacier.empty()) write_file("glacier.toml", glacier);
  auto config = config::load(path);
  if (!config) throw std::runtime_error(config.error().text());
  config_ = std::move(*config);
  for (std::size_t b = 0; b < config_.buses.size(); ++b) {
    const config::Bus& bus = config_.buses[b];
    const bool pulses = bus.kind == config::BusKind::kSerialPulse;
    buses_.push_back(
        {.bus = std::make_unique<sim::Bus>(pulses ? 115'200 : bus.baud, sink), .received = {}});
    if (pulses) buses_.back().drive = std::make_unique<sim::PulseDrive>(sink);
    if (bus.kind == config::BusKind::kCommutator) {
      buses_.back().board = new_board(bus, sink);
    }
  }
  for (std::size_t b = 0; b < config_.buses.size(); ++b) {
    std::uint64_t unique_id = b << 32;
    for (std::size_t m = 0; m < config_.mcus.size(); ++m) {
      if (config_.mcus[m].bus.value != b || buses_[b].drive || buses_[b].board) continue;
      // Each boots at another time, so that their ticks have nothing in common by themselves.
      sim::McuOptions options{.address = config_.mcus[m].address.value,
                              .boot_number = static_cast<std::uint16_t>(100 * b + m + 1),
                              .boot_ns = static_cast<std::int64_t>(m) * 777'777};
      options.unique_id = ++unique_id;
      options.disabled_capabilities = disabled_capabilities;
      options.keeps = keeps;
      if (config_.mcus[m].emission.measures()) options.supply = sim::SupplyRules{};
      buses_[b].bus->add_mcu(options);
    }
    buses_[b].bus->on_master_byte = [this, b](std::uint8_t byte, sim::TimeNs) {
      if (on_receive) on_receive(b, byte);
      if (buses_[b].plugged) buses_[b].received.push_back(byte);
    };
  }
  start_daemon();
}

Lab::~Lab() {
  std::filesystem::remove_all(directory_);
}

void Lab::start_daemon() {
  core_ = std::make_unique<daemon::Core>(config_, *this, ++master_);
  if (state_disk_) {
    std::vector<std::string> motors;
    for (const config::Motor& motor : config_.motors) motors.push_back(motor.name);
    store_.reset();
    auto store = state::Store::open(*state_disk_, {.folder = "/state",
                                                   .motors = std::move(motors),
                                                   .unguarded = !config_.state.required,
                                                   .utime_us = now_us(),
                                                   .random = 42});
    if (!store) throw std::runtime_error(store.error().text());
    store_.emplace(std::move(*store));
    core().kept().use(store_->kept(), *this, config_.state.required);
  }
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    if (buses_[b].plugged) core().port_opened(now_us(), BusId{b});
  }
}

void Lab::restart_daemon(const std::function<void()>& meanwhile) {
  core_.reset();
  store_.reset();
  if (meanwhile) meanwhile();
  disk_.clear();
  state_jobs_.clear();
  for (SimulatedBus& bus : buses_) bus.received.clear();
  states_.clear();
  descriptions_.clear();
  start_daemon();
}

void Lab::pass_without_daemon(double seconds) {
  now_ns_ += static_cast<std::int64_t>(seconds * 1e9);
  run_buses();
}

void Lab::keep_positions() {
  state_disk_ = std::make_unique<sim::SimDisk>(1);
  restart_daemon();
}

void Lab::cut_pc_power() {
  core_.reset();
  store_.reset();
  state_disk_->boot();
  restart_daemon();
}

void Lab::use_configuration(const std::string& toml) {
  core_.reset();
  write_file("bushd.toml", toml);
  auto config = config::load(directory_ / "bushd.toml");
  if (!config) throw std::runtime_error(config.error().text());
  config_ = std::move(*config);
  restart_daemon();
}

std::vector<api::PastMotion> Lab::history(std::int64_t number) const {
  return client_->histories[number];
}

std::vector<std::string> Lab::settings(std::int64_t number) const {
  std::vector<std::string> lines;
  for (const auto& [motor, key, value, in_file] : client_->configurations[number].settings) {
    lines.push_back(motor + " " + key + " = " + value + ", in the file " + in_file);
  }
  return lines;
}

void Lab::mark(std::vector<state::Mark> marks) {
  post([this, marks = std::move(marks)] { core().kept().marked(now_us(), store_->mark(marks)); });
}

void Lab::write(state::Batch batch) {
  post([this, batch = std::move(batch)] { core().kept().written(now_us(), store_->write(batch)); });
}

void Lab::write_file(const std::string& name, const std::string& text) {
  std::ofstream(directory_ / name) << text;
}

void Lab::read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) {
  disk_.push_back([this, ticket, wanted] {
    std::vector<tables::store::Place> places;
    for (const auto& directory : config::table_directories(config_.path)) {
      places.push_back(tables::store::place_of(directory));
    }
    std::vector<Result<tables::TablePtr>> read;
    for (const std::string& table : wanted) read.push_back(tables::store::open(table, places));
    core().tables().read(now_us(), ticket, read);
  });
}

void Lab::keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) {
  kept_ = wanted;
  disk_.push_back([this, ticket] { core().tables().kept(ticket, {}); });
}

void Lab::serve_tables(const api::Asker& asker, const api::Request&) {
  asker.answer(api::Refused{"there are no table files here"});
}

void Lab::pause_daemon(double seconds) {
  now_ns_ += static_cast<std::int64_t>(seconds * 1e9);
  run_buses();
}

void Lab::unplug(std::size_t bus) {
  if (buses_[bus].drive) buses_[bus].drive->break_off(now_ns_);
  buses_[bus].held.clear();
  buses_[bus].plugged = false;
  core().port_lost(now_us(), BusId{bus}, "unplugged");
}

void Lab::plug(std::size_t bus) {
  buses_[bus].plugged = true;
  buses_[bus].received.clear();
  core().port_opened(now_us(), BusId{bus});
}

void Lab::send(BusId bus, std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
  if (on_send && !on_send(bus.value, copy)) return;
  SimulatedBus& line = buses_[bus.value];
  if (!line.plugged) return;
  if (line.board) return line.board->send(now_ns_, copy);
  line.bus->master_send(copy, now_ns_);
}

void Lab::pulse(BusId id, const link::PulseOrder& order) {
  SimulatedBus& bus = buses_[id.value];
  if (!bus.plugged) return;
  if (order.positive) bus.drive->set_direction(now_ns_, *order.positive);
  if (order.baud) bus.drive->set_baud(now_ns_, *order.baud);
  bus.held.insert(bus.held.end(), order.bytes.begin(), order.bytes.end());
  if (!bus.stalled) bus.drive->send(now_ns_, std::exchange(bus.held, {}));
  bus.ordered = true;
}

void Lab::stall_pulses(bool stalled, std::optional<std::size_t> of) {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    SimulatedBus& bus = buses_[b];
    if (!bus.drive || (of && *of != b)) continue;
    bus.stalled = stalled;
    if (!stalled) bus.drive->send(now_ns_, std::exchange(bus.held, {}));
  }
}

void Lab::tell_pulse_status() {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    if (!std::exchange(buses_[b].ordered, false)) continue;
    sim::PulseDrive& drive = *buses_[b].drive;
    link::PulseStatus status = pulse_driver;
    status.baud = drive.baud();
    // What the driver has not sent: not what is in the UART.
    status.queued = std::max<std::size_t>(drive.queued(), 1) - 1 + buses_[b].held.size();
    if (status.empty) status.empty = drive.queued() + buses_[b].held.size() == 0;
    status.lines = drive.lines();
    status.positive = drive.positive();
    core().pulse_status(now_us(), BusId{b}, status);
  }
}

void Lab::log(daemon::LogLevel level, daemon::LogSubject, const std::string& text) {
  if (level == daemon::LogLevel::kError) errors_.push_back(text);
  if (level == daemon::LogLevel::kWarning) warnings_.push_back(text);
  if (level != daemon::LogLevel::kInfo) {
    std::printf("[%.3f s] %s\n", static_cast<double>(now_ns_) * 1e-9, text.c_str());
  }
}

// To the next thing that happens: on a bus, or in the daemon.
void Lab::advance() {
  for (const auto& told : std::exchange(disk_, {})) told();
  for (std::size_t i = 0; i < state_jobs_.size();) {
    if (state_jobs_[i].first > now_us()) {
      ++i;
      continue;
    }
    const auto answer = std::move(state_jobs_[i].second);
    state_jobs_.erase(state_jobs_.begin() + static_cast<std::ptrdiff_t>(i));
    answer();
  }
  core().step(now_us());
  tell_pulse_status();
  std::int64_t next = std::max(core().next_wake_us() * 1000, now_ns_ + 1000);
  if (read_period_us > 0) next = std::min(next, now_ns_ + read_period_us * 1000);
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    const std::int64_t listen_us = core().listen_from_us(BusId{b});
    if (listen_us > now_us()) next = std::min(next, listen_us * 1000);
    if (read_period_us != 0) continue;
    const SimulatedBus& bus = buses_[b];
    next = std::min(next, bus.board ? bus.board->next_event_ns() : bus.bus->next_event_ns());
  }
  for (const auto& [due_us, answer] : state_jobs_) next = std::min(next, due_us * 1000);
  now_ns_ = std::max(next, now_ns_);
  run_buses();
}

void Lab::run_buses() {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    if (buses_[b].board) {
      const auto arrived = buses_[b].board->advance(now_ns_);
      if (buses_[b].plugged) {
        buses_[b].received.insert(buses_[b].received.end(), arrived.begin(), arrived.end());
      }
    } else {
      buses_[b].bus->advance_to(now_ns_);
    }
    if (buses_[b].drive) buses_[b].drive->advance_to(now_ns_);
    if (!core_ || buses_[b].received.empty()) continue;
    if (core().listen_from_us(BusId{b}) > now_us()) continue;  // as bushd does
    const std::vector<std::uint8_t> bytes = std::exchange(buses_[b].received, {});
    core().receive(now_us(), BusId{b}, bytes);
  }
}

bool Lab::run_until(const std::function<bool()>& done, double limit_s) {
  const auto limit = now_ns_ + static_cast<std::int64_t>(limit_s * 1e9);
  while (now_ns_ < limit) {
    if (done()) return true;
    advance();
  }
  return done();
}

void Lab::run_for(double seconds) {
  run_until([] { return false; }, seconds);
}

std::int64_t Lab::send(const api::Request& request) {
  core().request(now_us(), {.session = client_, .number = ++number_}, request);
  return number_;
}

std::int64_t Lab::send_as(const std::string& client, const api::Request& request) {
  std::shared_ptr<Client>& session = others_[client];
  if (!session) session = std::make_shared<Client>(client, api::Transport::kSocket);
  asked_by_[++number_] = session;
  core().request(now_us(), {.session = session, .number = number_}, request);
  return number_;
}

void Lab::leave(const std::string& client) {
  others_.extract(client).mapped()->has_left = true;
}

std::vector<Answer> Lab::replies(std::int64_t number) const {
  const auto other = asked_by_.find(number);
  return (other == asked_by_.end() ? client_ : other->second)->answers[number];
}

Answer Lab::last_reply(std::int64_t number) const {
  return replies(number).back();
}

bool Lab::has_result(std::int64_t number) const {
  const std::vector<Answer> all = replies(number);
  return !all.empty() && all.back().phase != Answer::kAccepted;
}

Answer Lab::wait(std::int64_t number, double limit_s) {
  EXPECT_TRUE(run_until([&] { return has_result(number); }, limit_s)) << "no result in time";
  run_for(0.006);  // the state is published 5 ms after the last at the earliest
  return last_reply(number);
}

bool Lab::all_ready() const {
  if (states_.size() != config_.state_parts()) return false;
  return std::all_of(states_.begin(), states_.end(),
                     [](const auto& entry) { return entry.second.state == api::McuState::kReady; });
}

void Lab::connect() {
  ASSERT_TRUE(run_until([this] { return all_ready(); }, 10)) << "not all MCUs became READY";
  if (std::exchange(positions_confirmed_, true)) return;
  std::vector<std::string> motors;
  std::vector<std::int64_t> steps;
  for (const auto& [mcu, state] : states_) {
    for (const api::MotorState& motor : state.motors) {
      if (motor.activity != api::Activity::kResting) continue;
      if (std::ranges::find(config_.motors, motor.name, &config::Motor::name) ==
          config_.motors.end()) {
        continue;  // computed
      }
      motors.push_back(motor.name);
      steps.push_back(motor.position_steps);
    }
  }
  const auto surveyor = std::make_shared<Client>();
  core().request(now_us(), {.session = surveyor, .number = 1},
                 request_of(Ask::kSetPosition, motors, steps));
  ASSERT_TRUE(run_until([&] { return surveyor->answers[1].size() == 2; }, 5));
  ASSERT_EQ(surveyor->answers[1].back().result, "done") << surveyor->answers[1].back().reason;
  run_for(0.006);  // the state is published 5 ms after the last at the earliest
  std::erase_if(move_lines_, [](const std::string& line) {
    return line.find("\"event\":\"levels\"") == std::string::npos;
  });
}

api::MotorState Lab::motor(const std::string& name) const {
  for (const auto& [mcu, state] : states_) {
    for (const api::MotorState& motor : state.motors) {
      if (motor.name == name) return motor;
    }
  }
  throw std::out_of_range(name);
}

api::MotorDescription Lab::description(const std::string& name) const {
  for (const auto& [mcu, description] : descriptions_) {
    for (const api::MotorDescription& motor : description.motors) {
      if (motor.name == name) return motor;
    }
  }
  throw std::out_of_range(name);
}

api::HealthSnapshot Lab::health_of(const std::string& bus) {
  health_.erase(bus);
  EXPECT_TRUE(run_until([&] { return health_.contains(bus); }, 2)) << "no health in time";
  return health_.at(bus);
}

api::McuHealth Lab::mcu_health(const std::string& mcu) {
  const api::HealthSnapshot health = health_of(mcu.substr(0, mcu.find(':')));
  for (const api::McuHealth& candidate : health.mcus) {
    if (candidate.mcu == mcu) return candidate;
  }
  throw std::out_of_range(mcu);
}

std::int64_t Lab::shaft_steps(const std::string& name) const {
  for (const config::Motor& motor : config_.motors) {
    if (motor.name != name) continue;
    const config::Mcu& mcu = config_.mcu_of(motor);
    if (buses_[mcu.bus.value].drive) return buses_[mcu.bus.value].drive->position_steps();
    std::size_t in_bus = 0;
    for (std::size_t m = 0; m < motor.mcu.value; ++m) {
      if (config_.mcus[m].bus == mcu.bus) ++in_bus;
    }
    const SimulatedBus& bus = buses_[mcu.bus.value];
    if (bus.board) return bus.board->motors().position(motor.output.value);
    return bus.bus->mcu(in_bus).shaft(motor.output.value).position_steps;
  }
  throw std::out_of_range(name);
}

}  // namespace bushd::test
