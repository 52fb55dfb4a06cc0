#include "bare_world.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "times.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;
using bushd::sim::TimeNs;

constexpr TimeNs kForever = std::numeric_limits<TimeNs>::max() / 4;
constexpr std::uint32_t kBareWorldStream = 700;  // of randomness; ports have others
constexpr std::uint32_t kBareFaultStream = 701;
constexpr std::uint32_t kBarePortStream = 710;
// From a byte of a keypad to what it means.
constexpr TimeNs kKeyReactionNs = 50 * kMs;

}  // namespace

// Who asks for moves of these motors.
class BareWorld::Desk final : public api::Session {
 public:
  explicit Desk(BareWorld& world) : Session(api::Transport::kSocket, "desk", true), world_(world) {}
  void answer(std::int64_t number, const api::Reply& reply) override {
    world_.judge_.replied(world_.now_ns_, number, reply);
  }
  std::int64_t next() { return ++number_; }

 private:
  BareWorld& world_;
  std::int64_t number_ = 0;
};

BareWorld::BareWorld(const bushd::config::Config& config, std::size_t first_bus,
                     const BareOptions& options, std::uint64_t seed, bool keeps, Recent& recent,
                     BareJudge::Violated violated)
    : config_(config),
      first_bus_(first_bus),
      options_(options),
      recent_(recent),
      random_(seed, kBareWorldStream),
      chance_(seed, kBareFaultStream),
      judge_(config,
             static_cast<std::size_t>(
                 std::ranges::find_if(config.motors,
                                      [&](const auto& motor) {
                                        return config.mcu_of(motor).bus.value >= first_bus;
                                      }) -
                 config.motors.begin()),
             keeps, recent, std::move(violated)) {
  first_motor_ = config.motors.size();
  first_mcu_ = config.mcus.size();
  for (std::size_t bus = first_bus; bus < config.buses.size(); ++bus) {
    Port port{.bus = bus, .mcu = 0, .motors = {}};
    for (std::size_t mcu = 0; mcu < config.mcus.size(); ++mcu) {
      if (config.mcus[mcu].bus.value == bus) port.mcu = mcu;
    }
    for (std::size_t motor = 0; motor < config.motors.size(); ++motor) {
      if (config.motors[motor].mcu.value == port.mcu) port.motors.push_back(motor);
    }
    first_mcu_ = std::min(first_mcu_, port.mcu);
    first_motor_ = std::min(first_motor_, port.motors.front());
    const auto stream = kBarePortStream + static_cast<std::uint32_t>(bus);
    if (config.buses[bus].kind == bushd::config::BusKind::kSerialPulse) {
      port.pulses = std::make_unique<PulsePort>(seed, stream, judge_, port.mcu);
      const auto home = bare_home_switch(config, port.motors.front(), seed);
      port.pulses->drive.attach_switch(0, *home);
      judge_.has_switch(port.motors.front(), home->at_steps,
                        config.motors[port.motors.front()].home->position_steps);
    } else {
      port.board = std::make_unique<BoardPort>(config.buses[bus], seed, stream, judge_, port.mcu);
    }
    ports_.push_back(std::move(port));
  }
  for (const bushd::config::Keypad& keypad : config.keypads) {
    pads_.push_back(
        {.motor = keypad.motor.value, .config = &keypad, .box = KeypadBox(keypad.latched)});
  }
}

BareWorld::~BareWorld() = default;

bool BareWorld::has(const std::string& json_line) const {
  const nlohmann::json line = nlohmann::json::parse(json_line);
  if (!line.contains("motor")) return false;
  const auto motor = std::ranges::find(config_.motors, line.at("motor").get<std::string>(),
                                       &bushd::config::Motor::name);
  return static_cast<std::size_t>(motor - config_.motors.begin()) >= first_motor_;
}

// --- The daemon's

void BareWorld::send(TimeNs now_ns, bushd::BusId bus, std::span<const std::uint8_t> bytes) {
  Port& port = ports_[bus.value - first_bus_];
  if (port.plugged && port.board) port.board->send(now_ns, bytes);
}

void BareWorld::pulse(TimeNs now_ns, bushd::BusId bus, const bushd::link::PulseOrder& order) {
  Port& port = ports_[bus.value - first_bus_];
  if (port.plugged) port.status = port.pulses->carry_out(now_ns, order);
}

void BareWorld::answer_orders(TimeNs now_ns, DaemonRun& daemon) {
  for (Port& port : ports_) {
    if (!port.status) continue;
    const auto status = *std::exchange(port.status, std::nullopt);
    daemon.core().pulse_status(now_ns / 1000, bushd::BusId{port.bus}, status);
  }
}

std::optional<api::Asker> BareWorld::hear(TimeNs now_ns, const api::Asker& asker,
                                          const api::Request& request) {
  if (asker.session == desk_) {
    judge_.asked(now_ns, asker.number, request);
    return asker;
  }
  judge_.asked_by_others(now_ns, request);
  if (std::holds_alternative<api::EmergencyStop>(request)) emergency_ = true;
  if (!asker.session->client_id().starts_with("keypad-")) return std::nullopt;
  // It may be that another one's jog ends by it, or a move.
  if (const auto* jog = std::get_if<api::Jog>(&request)) {
    judge_.asked_by_others(now_ns, api::Stop{{jog->motor}});
  }
  return asker;
}

void BareWorld::daemon_started(TimeNs now_ns, DaemonRun& daemon) {
  now_ns_ = now_ns;
  judge_.daemon_started(now_ns);
  desk_ = std::make_shared<Desk>(*this);
  resume_ns_.clear();
  emergency_ = false;
  for (Port& port : ports_) {
    port.told = true;
    if (port.board) port.board->forget_received();
    if (port.plugged) daemon.core().port_opened(now_ns / 1000, bushd::BusId{port.bus});
  }
  for (Pad& pad : pads_) open_keypad(pad, daemon);
}

void BareWorld::open_keypad(Pad& pad, DaemonRun& daemon) {
  pad.keypad = std::make_unique<bushd::daemon::Keypad>(
      *pad.config, name(pad.motor), [&daemon](api::Asker asker, api::Request request) {
        daemon.ask(std::move(asker), std::move(request));
      });
  if (pad.plugged) pad.keypad->port_opened();
}

// What the driver has it sends, unless the computer has no power.
void BareWorld::daemon_gone(TimeNs now_ns, bool power) {
  now_ns_ = now_ns;
  for (Port& port : ports_) {
    port.status.reset();
    if (port.pulses && power) port.pulses->break_off(now_ns);
  }
  judge_.daemon_gone(now_ns);
  for (Pad& pad : pads_) pad.keypad.reset();
  desk_.reset();
}

void BareWorld::daemon_paused(TimeNs until_ns) {
  judge_.paused(now_ns_, until_ns);
  for (const Port& port : ports_) {
    for (const std::size_t motor : port.motors) {
      judge_.excused_until(motor, until_ns + kKeyReactionNs);
      if (port.board) judge_.cut_off(motor);
    }
  }
}

void BareWorld::advance_to(TimeNs now_ns) {
  now_ns_ = now_ns;
  for (Port& port : ports_) {
    if (port.pulses) {
      port.pulses->advance_to(now_ns);
      const bool tells = port.pulses->hardware() == PulsePort::Hardware::kUart &&
                         port.pulses->stalled_until_ns() + 2 * kSecond < now_ns;
      if (port.lines_until_ns != 0 || emergency_) judge_.change(port.motors.front());
      judge_.unseen(port.motors.front(), tells ? 0 : port.pulses->steps_unseen());
      if (port.lines_until_ns != 0 && now_ns >= port.lines_until_ns) {
        port.pulses->drive.set_lines(0);
        port.lines_until_ns = 0;
      }
      if (port.pulses->changed_amid_bytes() > 0) {
        recent_.note(now_ns,
                     config_.buses[port.bus].name + ": rate or direction changed amid bytes");
        judge_.line_violated(now_ns, port.motors.front());
      }
    } else {
      port.board->advance_to(now_ns);
      for (const std::size_t motor : port.motors) {
        const bool connected =
            port.board->board().motor(config_.motors[motor].output.value).connected;
        if (!connected || port.board->disturbed(now_ns)) judge_.cut_off(motor);
      }
    }
  }
  for (Pad& pad : pads_) pad.box.advance_to(now_ns);
  judge_.advance_to(now_ns);
  if (trouble_ && now_ns >= next_fault_ns_ && options_.faults_per_hour > 0) {
    if (next_fault_ns_ != 0) disturb(now_ns);
    next_fault_ns_ = now_ns + chance_.wait(static_cast<double>(kHour) / options_.faults_per_hour);
  }
}

bool BareWorld::due(TimeNs now_ns) const {
  if (clears_ || (trouble_ && now_ns >= next_ask_ns_)) return true;
  for (const Port& port : ports_) {
    if (!port.told || (!port.plugged && now_ns >= port.back_ns)) return true;
    if (port.board && port.board->received(now_ns)) return true;
  }
  for (const Pad& pad : pads_) {
    if (pad.box.has_bytes() || (!pad.plugged && now_ns >= pad.back_ns)) return true;
    if (pad.keypad && pad.keypad->next_wake_us() <= now_ns / 1000) return true;
    if (trouble_ && now_ns >= pad.next_ns) return true;
  }
  for (const auto& [motor, at_ns] : resume_ns_) {
    if (now_ns >= at_ns) return true;
  }
  return false;
}

void BareWorld::tell(TimeNs now_ns, DaemonRun& daemon) {
  now_ns_ = now_ns;
  for (Port& port : ports_) tell(now_ns, daemon, port);
  for (Pad& pad : pads_) {
    if (trouble_ && now_ns >= pad.next_ns) press_keys(now_ns, pad);
    tell(now_ns, pad);
  }
  if (trouble_ && now_ns >= next_ask_ns_ && options_.commands_per_hour > 0) {
    if (next_ask_ns_ != 0) ask(now_ns, daemon);
    next_ask_ns_ = now_ns + random_.wait(static_cast<double>(kHour) / options_.commands_per_hour);
  }
  for (auto it = resume_ns_.begin(); it != resume_ns_.end();) {
    if (now_ns < it->second) {
      ++it;
      continue;
    }
    const std::size_t motor = it->first;
    it = resume_ns_.erase(it);
    ask_for(daemon, api::Resume{{name(motor)}});
  }
  if (!std::exchange(clears_, false)) return;
  api::ClearFaults clear;
  for (const Port& port : ports_) clear.motors.push_back(name(port.motors.front()));
  ask_for(daemon, clear);
  emergency_ = false;
}

void BareWorld::tell(TimeNs now_ns, DaemonRun& daemon, Port& port) {
  const bushd::BusId bus{port.bus};
  if (!port.told) {
    port.told = true;
    daemon.core().port_lost(now_ns / 1000, bus, "the adapter was unplugged");
  }
  if (!port.plugged && now_ns >= port.back_ns) {
    port.plugged = true;
    recent_.note(now_ns, config_.buses[port.bus].name + " is back");
    if (port.board) port.board->forget_received();
    daemon.core().port_opened(now_ns / 1000, bus);
  }
  if (!port.board || !port.board->received(now_ns)) return;
  const auto bytes = port.board->take_received(now_ns);
  if (port.plugged) daemon.core().receive(now_ns / 1000, bus, bytes);
}

// --- Keys

void BareWorld::note_keys(TimeNs now_ns, Pad& pad, std::span<const std::uint8_t> bytes) {
  if (!bytes.empty()) {
    recent_.note(now_ns, fmt::format("keys of {}: {:02x}", name(pad.motor), fmt::join(bytes, " ")));
  }
  for (const std::uint8_t byte : bytes) {
    // A slower speed is a sign of life too, as long as the motor moves.
    const bool slower = byte == KeypadBox::kSlower && !judge_.rests(pad.motor);
    if (byte == KeypadBox::kForward || byte == KeypadBox::kReverse || slower) {
      ++keys_;
      const TimeNs keepalive_ns = pad.config->keepalive_ms * kMs;
      judge_.keys_until(pad.motor,
                        pad.config->latched ? kForever : now_ns + keepalive_ns + kKeyReactionNs);
    } else if (byte == KeypadBox::kStop) {
      judge_.keys_until(pad.motor, now_ns + kKeyReactionNs);
    }
  }
}

void BareWorld::tell(TimeNs now_ns, Pad& pad) {
  const auto bytes = pad.box.take_bytes();
  if (!pad.plugged && now_ns >= pad.back_ns) {
    pad.plugged = true;
    if (pad.keypad) pad.keypad->port_opened();
  } else if (pad.plugged && pad.keypad) {
    note_keys(now_ns, pad, bytes);
    pad.keypad->receive(now_ns / 1000, bytes);
    pad.keypad->step(now_ns / 1000);
    pad.keypad->take_display();
  }
}

void BareWorld::press_keys(TimeNs now_ns, Pad& pad) {
  if (pad.next_ns != 0) {
    const auto kind = random_.below(10);
    if (kind < 7) {
      pad.box.press(now_ns, random_.one_in(2), random_.magnitude(10 * kMs, 3 * kSecond));
    } else if (kind < 9) {
      pad.box.type(KeypadBox::kSlower);
    } else {
      pad.box.type(KeypadBox::kStop);
    }
  }
  pad.next_ns = now_ns + random_.wait(4e9);
}

void BareWorld::let_go(TimeNs now_ns) {
  for (Port& port : ports_) {
    if (!port.board) continue;
    port.board->end_faults();
    for (const std::size_t motor : port.motors) {
      port.board->board().motor(config_.motors[motor].output.value).connected = true;
    }
  }
  for (Pad& pad : pads_) {
    pad.box.let_go(now_ns);
    pad.box.type(KeypadBox::kStop);
  }
}

// --- Requests

void BareWorld::ask_for(DaemonRun& daemon, const api::Request& request) {
  daemon.ask({.session = desk_, .number = desk_->next()}, request);
}

void BareWorld::ask(TimeNs now_ns, DaemonRun& daemon) {
  if (emergency_ && random_.one_in(4)) clears_ = true;
  const std::size_t motor = pick_motor();
  // Who does not know where it stands says it.
  if (judge_.rests(motor) && !judge_.is_trusted(motor) && !random_.one_in(4)) {
    return ask_for(daemon,
                   api::SetPosition{.motors = {{name(motor), random_.between(-9'000, 9'000)}}});
  }
  const api::Request request = next_request();
  if (const auto* pause = std::get_if<api::Pause>(&request)) {
    for (std::size_t i = first_motor_; i < config_.motors.size(); ++i) {
      if (name(i) == pause->motors.front()) {
        resume_ns_[i] = now_ns + random_.magnitude(10 * kMs, 2 * kSecond);
      }
    }
  }
  ask_for(daemon, request);
}

api::Request BareWorld::next_move(std::size_t motor) {
  api::Move move{.motors = {{name(motor), std::int64_t{0}}}};
  std::int64_t steps = random_.magnitude(1, 1'500);
  if (random_.one_in(2)) steps = -steps;
  if (random_.one_in(4)) {
    move.kind = api::Move::Kind::kAbsolute;
    steps = random_.between(-3'000, 3'000);
  }
  move.motors[0].amount = steps;
  const std::size_t other = pick_motor();
  if (random_.one_in(5) && other != motor &&
      config_.motors[other].mcu != config_.motors[motor].mcu) {
    move.motors.push_back({name(other), steps / 2});
  }
  if (random_.one_in(4)) {
    move.speed =
        api::Speed{.per_s = static_cast<double>(random_.magnitude(50, 3'000)), .in_steps = true};
  }
  return move;
}

api::Request BareWorld::next_request() {
  const std::size_t motor = pick_motor();
  const auto kind = random_.below(100);
  if (kind < 62) return next_move(motor);
  if (kind < 74) return api::Stop{{name(motor)}};
  if (kind < 82 && config_.motors[motor].home) return api::Home{.motors = {name(motor)}};
  if (kind < 88) {
    return api::Jog{.motor = name(motor),
                    .per_s = static_cast<double>(random_.between(-2'000, 2'000)) + 0.5,
                    .in_steps = true,
                    .keepalive_ms = random_.between(100, 900)};
  }
  if (kind < 93) return api::Pause{{name(motor)}};
  if (kind < 96) {
    return api::SetPosition{.motors = {{name(motor), random_.between(-9'000, 9'000)}}};
  }
  return next_move(motor);
}

std::optional<std::string> BareWorld::not_ready() const {
  for (const Port& port : ports_) {
    if (judge_.seen(port.motors.front()) == api::McuState::kReady) continue;
    return config_.mcus[port.mcu].id + " is not READY";
  }
  return std::nullopt;
}

}  // namespace bushfaults
