#include "mcu_programs.h"

#include <algorithm>

namespace bushfaults {
namespace {

constexpr std::uint32_t kMcuProgramsStream = 440;  // of randomness
constexpr std::uint32_t kWithoutHostStream = 441;
constexpr std::uint64_t kClientsOfPrograms = 3;
constexpr std::size_t kMostMotorsOfProgram = 4;
// Longer than any motor rests after its last step until it surely rests, by the slowest table.
constexpr std::int64_t kRestMs = 500;

using Frame = McuProgram::Frame;
using Kind = Frame::Kind;

}  // namespace

void allow_mcu_programs(bushd::config::Config& config, std::uint64_t seed) {
  bushd::sim::Random random(seed, kWithoutHostStream);
  for (bushd::config::Mcu& mcu : config.mcus) mcu.programs_without_host = random.one_in(2);
}

McuPrograms::McuPrograms(const bushd::config::Config& config, std::uint64_t seed)
    : random_(seed, kMcuProgramsStream) {
  for (std::size_t i = 0; i < config.mcus.size(); ++i) {
    OfMcu mcu{.name = "scan-" + std::to_string(i + 1),
              .without_host = config.mcus[i].programs_without_host};
    for (const bushd::config::Motor& motor : config.motors) {
      if (motor.mcu.value == i) mcu.motors.push_back(motor.name);
    }
    const auto wanted = static_cast<std::size_t>(random_.between(1, kMostMotorsOfProgram));
    while (mcu.motors.size() > wanted) {
      const auto left_out = static_cast<std::ptrdiff_t>(random_.below(mcu.motors.size()));
      mcu.motors.erase(mcu.motors.begin() + left_out);
    }
    if (!mcu.motors.empty()) mcus_.push_back(std::move(mcu));
  }
}

Frame McuPrograms::motion(std::size_t motors, bool of_line) {
  constexpr std::int64_t kMostSteps = 400;
  const bool to = random_.one_in(4);
  Frame frame{.kind = of_line ? (to ? Kind::kLineTo : Kind::kLineBy)
                              : (to ? Kind::kMoveTo : Kind::kMoveBy)};
  for (std::int64_t rows = of_line ? random_.between(1, 4) : 1; rows > 0; --rows) {
    for (std::size_t i = 0; i < motors; ++i) {
      const std::int64_t size = random_.one_in(5) ? 0 : random_.magnitude(1, kMostSteps);
      frame.steps.push_back(random_.one_in(2) ? size : -size);
    }
  }
  if (random_.one_in(3)) frame.steps_per_s = random_.magnitude(120, 3'000);
  frame.elementary = of_line && random_.one_in(3);
  return frame;
}

// Every second one rests for long after each of its moves, and makes no lines: so each of them is
// judged by its table alone.
McuProgram McuPrograms::made(const OfMcu& mcu) {
  McuProgram program{.name = mcu.name,
                     .motors = mcu.motors,
                     .without_host = mcu.without_host ? !random_.one_in(3) : random_.one_in(20),
                     .dry_run = random_.one_in(10)};
  const bool rests = random_.one_in(2);
  const bool repeats = random_.one_in(2);
  if (repeats) {
    program.frames.push_back(
        {.kind = Kind::kRepeat, .number = random_.one_in(3) ? 0 : random_.between(1, 4)});
  }
  for (std::int64_t n = random_.between(1, 3); n > 0; --n) {
    program.frames.push_back(motion(program.motors.size(), !rests && random_.one_in(2)));
    if (rests) program.frames.push_back({.kind = Kind::kWait, .number = kRestMs});
    if (random_.one_in(4)) {
      program.frames.push_back({.kind = Kind::kPulse, .number = random_.between(1, 1'000)});
    }
    if (!rests && random_.one_in(4)) {
      program.frames.push_back({.kind = Kind::kWait, .number = random_.magnitude(1, 2'000)});
    }
  }
  if (repeats) program.frames.push_back({.kind = Kind::kNext});
  return program;
}

Request McuPrograms::run() {
  Request request{.client = {}, .ask = Ask::kRunPrograms};
  for (const OfMcu& mcu : mcus_) {
    if (!request.programs.empty() && !random_.one_in(3)) continue;
    if (request.programs.empty() && &mcu != &mcus_.back() && random_.one_in(2)) continue;
    request.programs.push_back(mcu.name);
    for (const std::string& motor : mcu.motors) request.add(motor, 0);
  }
  return request;
}

Request McuPrograms::next() {
  const std::uint64_t what = random_.below(20);
  Request request = what < 12 ? run() : Request{.client = {}, .ask = Ask::kPutProgram};
  request.client = "q" + std::to_string(random_.below(kClientsOfPrograms));
  if (what < 12) return request;
  const OfMcu& mcu = mcus_[random_.below(mcus_.size())];
  if (what == 12) {
    request.ask = Ask::kEraseProgram;
    request.programs.push_back(mcu.name);
    return request;
  }
  request.program = made(mcu);
  return request;
}

}  // namespace bushfaults
