#include "programs.h"

#include <algorithm>
#include <array>

#include "crate_model.h"
#include "heritage/camac/bushd2.h"
#include "heritage/camac/module.h"
#include "shutter_model.h"

namespace bushfaults {
namespace {

using bushd::camac::Bushd2;

constexpr std::uint32_t kProgramsStream = 420;  // of randomness
constexpr std::uint64_t kProgramClients = 3;
constexpr int kStation = kBushd2Station;
constexpr std::uint32_t kEnabled = 0x60;  // fault and end of motion
constexpr std::uint32_t kLeft = 0x80;
constexpr std::int64_t kLongestProgram = 2000;  // steps: four seconds at most
// Programs are the table of their group, each of whose codes comes a few times: with so many
// hundredths of it for each step.
constexpr std::int64_t kSlowestProgram = 33;
constexpr std::int64_t kSlowestCode = 250;  // F_start, as of all tables here
constexpr int kStartHz = 100;               // of all tables here

// Never faster than the table, and never accelerating more: by that every step is judged.
std::uint16_t stretched(const bushd_table& table, std::size_t k, std::int64_t hundredths) {
  const std::size_t of = k * static_cast<std::size_t>(hundredths) / 100;
  return of < table.accel.count ? table.accel.code[of] : table.cruise;
}

}  // namespace

void add_crate(bushd::config::Config& config) {
  std::size_t last = 0;
  for (const bushd::config::Motor& motor : config.motors) last = std::max(last, motor.group.value);
  bushd::config::CamacModule module{.station = kBushd2Station, .f_start_hz = kStartHz};
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    bushd::config::Motor& motor = config.motors[i];
    if (motor.group.value != last) continue;
    // A group has one program: that of a page. Where that is full there are other groups.
    if (module.motors.size() < Bushd2::kMotorsPerPage) {
      module.motors.push_back({i});
    } else {
      motor.group = {0};
    }
  }
  config.crates.push_back({.number = kCrate, .modules = {module}});
}

void add_shutter(bushd::config::Config& config) {
  // The last motor of the first group, which is none of BUSHD-2's.
  std::size_t its = 0;
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    if (config.motors[i].group.value == 0) its = i;
  }
  bushd::config::Motor& motor = config.motors[its];
  std::vector<std::uint8_t> inputs;
  for (const bushd::config::Motor& other : config.motors) {
    if (other.mcu == motor.mcu && inputs.size() < 3) inputs.push_back(other.output.value);
  }
  while (inputs.size() < 3) inputs.push_back(static_cast<std::uint8_t>(15 - inputs.size()));
  motor.inputs = {.positive = bushd::config::Input{.number = inputs[0]},
                  .negative = bushd::config::Input{.number = inputs[1]},
                  .step = bushd::config::Input{.number = inputs[2]}};
  motor.group = {config.groups.size()};
  motor.backlash = 0;  // a step is a step
  bushd::config::Group group = config.groups.front();
  group.name = "shutters";
  config.groups.push_back(std::move(group));
  config.crates.front().modules.push_back({.station = kBushd1Station,
                                           .type = bushd::config::CamacModule::Type::kBushd1,
                                           .motors = {{its}}});
}

bool is_of_shutter(const bushd::config::Config& config, std::size_t index) {
  const auto shutter = ShutterPlace::motor(config);
  if (!shutter) return false;
  const bushd::config::Motor& motor = config.motors[index];
  const bushd::config::Motor& its = config[*shutter];
  const std::uint8_t own = motor.output.value;
  return shutter->value == index || (motor.mcu == its.mcu && (own == its.inputs.positive->number ||
                                                              own == its.inputs.negative->number ||
                                                              own == its.inputs.step->number));
}

bushd::tables::TablePtr slowest_program(const bushd::tables::Table& table) {
  const bushd_table& codes = table.view();
  bushd::tables::TableContent content{.name = "slowest", .time_unit_ns = codes.time_unit_ns};
  for (std::size_t k = 0; k < Bushd2::kCodes; ++k) {
    content.accel.push_back(stretched(codes, k, kSlowestProgram));
  }
  return *bushd::tables::make(std::move(content));
}

Programs::Programs(const bushd::config::Config& config, std::uint64_t seed)
    : config_(config), random_(seed, kProgramsStream) {}

std::size_t Programs::motors() const {
  return config_.crates.empty() ? 0 : config_.crates.front().modules.front().motors.size();
}

std::size_t Programs::any_motor() {
  return static_cast<std::size_t>(random_.below(motors()));
}

void Programs::load(Cycles& cycles, std::size_t motor) {
  const auto& module = config_.crates.front().modules.front();
  const bushd_table& table = config_.table_of(config_[module.motors.front()]).view();
  const std::uint32_t page = static_cast<std::uint32_t>(motor) / Bushd2::kMotorsPerPage;
  const std::int64_t steps = random_.one_in(30) ? 0 : random_.magnitude(1, kLongestProgram);
  const std::int64_t hundredths = random_.between(kSlowestProgram, 100);
  const std::size_t rises = random_.one_in(20) ? 5 : Bushd2::kCodes;
  const auto write = [&](std::int64_t byte) {
    cycles.push_back({kStation, 0, 16, static_cast<std::uint32_t>(byte)});
  };
  cycles.push_back({kStation, 1, 16, page * static_cast<std::uint32_t>(Bushd2::kPageBytes)});
  write(steps % 256);
  write(steps / 256);
  for (std::size_t k = 0; k < Bushd2::kCodes; ++k) {
    write(k == rises ? kSlowestCode : stretched(table, k, hundredths));
  }
}

// It reads what it starts: after a power cut nobody knows that.
void Programs::start(Cycles& cycles, std::int64_t position_steps, std::size_t motor) {
  if (!random_.one_in(3)) cycles.push_back({30, 9, 24});
  if (random_.one_in(8)) cycles.push_back({kStation, 0, 24});
  if (random_.one_in(2)) load(cycles, motor);
  const auto page = static_cast<std::uint32_t>(motor / Bushd2::kMotorsPerPage * Bushd2::kPageBytes);
  cycles.push_back({kStation, 1, 16, page});
  cycles.insert(cycles.end(), Bushd2::kFirstCode + Bushd2::kCodes, {kStation, 0, 0});
  const bool left = random_.one_in(4) ? position_steps < 0 : position_steps > 0;
  const auto number = static_cast<std::uint32_t>(random_.one_in(30) ? motors() : motor);
  cycles.push_back({kStation, 2, 16, kEnabled | number | (left ? kLeft : 0)});
  cycles.push_back({kStation, 0, 10});
  cycles.push_back({kStation, 0, 26});
  if (random_.one_in(10)) cycles.push_back({kStation, 0, 26});
  look(cycles);
}

void Programs::look(Cycles& cycles) {
  for (const int subaddress : {1, 2, 3}) cycles.push_back({kStation, subaddress, 0});
  cycles.push_back({kStation, 0, 8});
  cycles.push_back({30, 0, 0});
}

void Programs::control_crate(Cycles& cycles) {
  switch (random_.below(5)) {
    case 0:
      return cycles.push_back({28, 8, 26});  // Z
    case 1:
      return cycles.push_back({28, 9, 26});  // C
    case 2:
      return cycles.push_back({30, 9, 26});  // I
    default:
      return cycles.push_back({30, 9, 24});
  }
}

// Whatever the crate answers, but what starts motion, writes into memories, or enables overflow.
void Programs::random_cycles(Cycles& cycles) {
  for (std::int64_t n = random_.between(1, 20); n > 0; --n) {
    bushd::camac::Naf naf{
        .station = random_.one_in(2) ? kStation : static_cast<int>(random_.between(1, 31)),
        .subaddress = static_cast<int>(random_.below(random_.one_in(4) ? 16 : 4)),
        .function = static_cast<int>(random_.below(32))};
    if (bushd::camac::writes(naf.function)) {
      naf.data = static_cast<std::uint32_t>(random_.below(1U << 24));
    }
    const bool of_module = naf.station == kStation || naf.station == kBushd1Station;
    if (of_module && naf.subaddress == 0 && (naf.function == 16 || naf.function == 26)) continue;
    if (naf.station == kStation && naf.function == 16) naf.data = (naf.data & ~0x10U) | kEnabled;
    cycles.push_back(naf);
  }
  look(cycles);
}

// Blocks at one address, and at a row of them. Words are written into registers only: others may
// have changed meanwhile what is at the memory's address.
void Programs::other_modes(Request& request) {
  using Mode = bushd::camac::BlockMode;
  constexpr std::array kModes = {Mode::kQStop, Mode::kRepeat, Mode::kScan};
  request.block_mode = kModes[random_.below(kModes.size())];
  const auto words = static_cast<std::uint32_t>(random_.magnitude(1, 300));
  request.words = words;
  Cycles& cycles = request.cycles;
  if (request.block_mode == Mode::kScan) {
    const int last = random_.one_in(2) ? kStation : kStation + 1;
    cycles.push_back({static_cast<int>(random_.between(1, kStation)), 0, 0});
    request.last_station = last;
    return;
  }
  if (random_.one_in(4)) {
    for (std::uint32_t i = 0; i < words; ++i) {
      cycles.push_back({kStation, 1, 16, static_cast<std::uint32_t>(random_.below(1024))});
    }
    return;
  }
  const int subaddress = random_.one_in(2) ? 0 : static_cast<int>(random_.below(5));
  cycles.push_back({kStation, subaddress, random_.one_in(8) ? 8 : 0});
}

void Programs::load_shutter(Cycles& cycles, std::int64_t steps) {
  const auto write = [&](std::int64_t byte) {
    cycles.push_back({kBushd1Station, 0, 16, static_cast<std::uint32_t>(byte)});
  };
  const auto write_word = [&](std::int64_t word) {
    write(word % 256);
    write(word / 256);
  };
  const bushd::config::Motor& motor = config_[*ShutterPlace::motor(config_)];
  const bushd_table& table = config_.table_of(motor).view();
  const std::int64_t hundredths = random_.between(kSlowestProgram, 100);
  const bool rises_twice = steps > 8 && random_.one_in(20);
  cycles.push_back({kBushd1Station, 1, 16, 0});
  write(steps);
  write(0);
  write_word(random_.one_in(2) ? random_.between(1, 600) : random_.between(3'000, 12'000));
  for (std::int64_t k = 0; k < std::min<std::int64_t>(steps, 126); ++k) {
    const auto at = static_cast<std::size_t>(std::min(k, steps - 1 - k));
    const std::int64_t ns = std::int64_t{stretched(table, at, hundredths)} * table.time_unit_ns;
    const std::int64_t code = (ns + 49'999) / 50'000;
    write_word(rises_twice && k == 2 ? code + 300 : code);
  }
}

// It reads what it starts, too.
void Programs::start_shutter(Cycles& cycles, std::int64_t stands) {
  const bool at_left = stands <= ShutterPlace::kLeftSteps;
  const std::int64_t to_right = ShutterPlace::kRightSteps - stands;
  std::int64_t steps = std::clamp<std::int64_t>(at_left ? to_right : stands, 1, 126);
  if (random_.one_in(6)) steps = std::max<std::int64_t>(1, steps + random_.between(-3, 3));
  if (random_.one_in(40)) steps = random_.one_in(2) ? 0 : 127;
  if (!random_.one_in(3)) cycles.push_back({30, 9, 24});
  if (random_.one_in(16)) cycles.push_back({kBushd1Station, 0, 24});
  load_shutter(cycles, steps);
  cycles.push_back({kBushd1Station, 1, 16, 0});
  const std::size_t bytes =
      4 + 2 * static_cast<std::size_t>(std::clamp<std::int64_t>(steps, 0, 126));
  cycles.insert(cycles.end(), bytes, {kBushd1Station, 0, 0});
  constexpr std::array<std::uint32_t, 4> kModes = {0x00, 0x80, 0x40, 0xC0};
  const std::uint32_t mode = kModes[random_.one_in(2) ? random_.below(2) : 2 + random_.below(2)];
  const bool left = random_.one_in(12) ? at_left : !at_left;
  cycles.push_back({kBushd1Station, 2, 16, 0x17 | mode | (left ? 0x08U : 0U)});
  cycles.push_back({kBushd1Station, 0, 10});
  cycles.push_back({kBushd1Station, 0, 26});
  if (random_.one_in(10)) cycles.push_back({kBushd1Station, 0, 26});
}

// A motor that does not stand at its left limit is brought there by a move, mostly.
Request Programs::next_of_shutter(std::int64_t stands, bool open) {
  Request request{.client = "p" + std::to_string(random_.below(kProgramClients)),
                  .ask = Ask::kCamac};
  const bool astray = stands > ShutterPlace::kLeftSteps || stands < -80;
  if (!open && astray && random_.one_in(2)) {
    request.ask = Ask::kMoveBy;
    request.add(config_[*ShutterPlace::motor(config_)].name, -random_.between(0, 4) - stands);
    return request;
  }
  Cycles& cycles = request.cycles;
  const std::uint64_t what = random_.below(20);
  if (what == 0) {
    control_crate(cycles);
  } else if (what <= 2) {
    cycles.push_back({kBushd1Station, 0, 10});
  } else if (what <= (open ? 6U : 3U)) {
    cycles.push_back({kBushd1Station, 0, 24});
  } else if (what >= (open ? 18U : 10U)) {
    start_shutter(cycles, stands);
  }
  for (const int subaddress : {1, 2, 3}) cycles.push_back({kBushd1Station, subaddress, 0});
  cycles.push_back({kBushd1Station, 0, 8});
  return request;
}

Request Programs::next(std::int64_t position_steps, std::size_t motor) {
  Request request{.client = "p" + std::to_string(random_.below(kProgramClients)),
                  .ask = Ask::kCamac};
  Cycles& cycles = request.cycles;
  if (random_.one_in(8)) {
    other_modes(request);
    return request;
  }
  switch (random_.below(12)) {
    case 0:
    case 1:
      cycles.push_back({kStation, 0, 24});
      break;
    case 2:
      control_crate(cycles);
      break;
    case 3:
      look(cycles);
      break;
    case 4:
      random_cycles(cycles);
      break;
    case 5:
      load(cycles, motor);
      break;
    case 6:
      cycles.push_back({kStation, 0, 10});
      break;
    default:
      start(cycles, position_steps, motor);
      break;
  }
  return request;
}

}  // namespace bushfaults
