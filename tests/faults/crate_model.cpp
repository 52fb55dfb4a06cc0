#include "crate_model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "times.h"

namespace bushfaults {
namespace {

using bushd::camac::Bushd2;

// A result is due after 40 s (witness_jogs.cpp); before that its MCUs come to rest and get a table,
// with twice as long for those that are away.
constexpr TimeNs kLamDueNs = 120 * kSecond;

constexpr std::uint32_t kMotorBits = 0x1F;
constexpr std::uint32_t kLeft = 0x80;
constexpr std::uint32_t kStepDone = 0x10;
constexpr int kReceivedShift = 8;
constexpr std::uint32_t kReceivedBits = 3;

std::string text_of(const bushd::camac::Naf& naf) {
  return fmt::format("N{} A{} F{}", naf.station, naf.subaddress, naf.function);
}

}  // namespace

void Crates::daemon_started(TimeNs now_ns, bool kept) {
  registers_.daemon_started(now_ns, kept);
  inhibited_ = published_ = false;
  flag_ = false;
  start_.reset();
  steps_told_.reset();
}

Wrong Crates::completed(TimeNs now_ns, const Request& request,
                        const bushd::api::CamacResult& result) {
  using bushd::camac::BlockMode;
  const bool single = request.block_mode == BlockMode::kSingle;
  const bool scan = request.block_mode == BlockMode::kScan;
  const auto judge = single ? &Crates::in_single_mode
                     : scan ? &Crates::scanned
                            : &Crates::of_one_address;
  if (auto wrong = (this->*judge)(now_ns, request, result.block.responses)) return wrong;
  std::size_t words = 0;
  for (const Response& response : result.block.responses) {
    words += single || (response.x && response.q) ? 1 : 0;
  }
  if (words != result.block.tally)
    return "its tally is not that of its answers: " + text_of(request);
  return observe((result.requests >> (kBushd2Station - 1) & 1) != 0);
}

Wrong Crates::in_single_mode(TimeNs now_ns, const Request& request,
                             const std::vector<Response>& responses) {
  if (responses.size() != request.cycles.size()) {
    return "as many answers as cycles were due: " + text_of(request);
  }
  for (std::size_t i = 0; i < request.cycles.size(); ++i) {
    const Naf& naf = request.cycles[i];
    if (auto wrong = cycle(now_ns, naf, responses[i])) {
      return fmt::format("cycle {} of {}, {}: {}", i + 1, request.cycles.size(), text_of(naf),
                         *wrong);
    }
  }
  return std::nullopt;
}

// Word after word, until there is no Q; in the mode repeat a word is tried a hundred times.
Wrong Crates::of_one_address(TimeNs now_ns, const Request& request,
                             const std::vector<Response>& responses) {
  constexpr int kTries = 100;
  for (std::size_t i = 0; i < responses.size(); ++i) {
    const Response& response = responses[i];
    const Naf& naf = request.cycles[std::min(i, request.cycles.size() - 1)];
    const bool tried = request.block_mode == bushd::camac::BlockMode::kRepeat && response.x;
    // In vain: what they have read is not told.
    for (int more = kTries - 1; tried && !response.q && more > 0; --more) {
      if (naf.subaddress == 0 && naf.function == kRead) registers_.count_up();
    }
    if (auto wrong = cycle(now_ns, naf, response)) {
      return fmt::format("word {}, {}: {}", i + 1, text_of(naf), *wrong);
    }
    const bool last = i + 1 == responses.size();
    if (!last && !(response.x && response.q)) return "it goes on without Q: " + text_of(request);
    if (last && response.x && response.q && responses.size() != request.words) {
      return "it ends before its count: " + text_of(request);
    }
  }
  return responses.empty() ? Wrong("no word at all: " + text_of(request)) : std::nullopt;
}

// Only the station of BUSHD-2 answers of all: with its memory, which has no Q while L is raised,
// and then with its registers.
Wrong Crates::scanned(TimeNs now_ns, const Request& request,
                      const std::vector<Response>& responses) {
  constexpr std::size_t kRegisters = 4;
  if (responses.empty()) {
    registers_.count_up();
    return observe(true);
  }
  if (responses.size() != std::min<std::size_t>(kRegisters, request.words)) {
    return fmt::format("{} words of a scan: {}", responses.size(), text_of(request));
  }
  for (std::size_t i = 0; i < responses.size(); ++i) {
    const Naf naf{kBushd2Station, static_cast<int>(i), kRead};
    if (auto wrong = cycle(now_ns, naf, responses[i])) {
      return fmt::format("word {} of a scan: {}", i + 1, *wrong);
    }
  }
  return std::nullopt;
}

Wrong Crates::cycle(TimeNs now_ns, const Naf& naf, const Response& response) {
  if (naf.station == kBushd2Station) return module_cycle(now_ns, naf, response);
  const bool common = naf.station == 28 && naf.function == 26;
  if (common && naf.subaddress == 8) {
    stop();
    clear();
    registers_.initialise();
  } else if (common && naf.subaddress == 9) {
    clear();
  } else if (naf.station == 30 && naf.subaddress == 9) {
    if (naf.function == 27 && response.q != inhibited_) return "I is not as it was set";
    if (naf.function == 26) inhibited_ = true;
    if (naf.function == 24) inhibited_ = false;
  }
  return std::nullopt;
}

Wrong Crates::module_cycle(TimeNs now_ns, const Naf& naf, const Response& response) {
  if (ModuleRegisters::is_memory(naf)) {
    // Positions of motors, which are counted as reports come.
    if (registers_.address() % Bushd2::kPageBytes >= Bushd2::kFirstPosition) {
      registers_.forget_byte();
    }
    if (auto wrong = registers_.memory_cycle(now_ns, naf, response)) return wrong;
    return observe(!response.q);
  }
  if (naf.function == kRead && naf.subaddress <= 3) return read_register(naf, response);
  if (naf.function == kWrite) registers_.write(naf);
  if (naf.subaddress != 0) return std::nullopt;
  if (naf.function == kTestLam) return observe(response.q);
  if (naf.function == kClearLam) flag_ = published_ = false;
  if (naf.function == kForbid) stop();
  if (naf.function == kPermit && !inhibited_) start(now_ns);
  return std::nullopt;
}

Wrong Crates::read_register(const Naf& naf, const Response& response) {
  if (!response.x || !response.q) return "a register does not answer";
  if (naf.subaddress == 3) return read_requests(response);
  return registers_.read(naf, response);
}

Wrong Crates::read_requests(const Response& response) const {
  if (!steps_told_) return std::nullopt;
  const auto received = response.data >> kReceivedShift & kReceivedBits;
  const bool done = (response.data & kStepDone) != 0;
  if (done && received == static_cast<std::uint32_t>(*steps_told_) % 4) return std::nullopt;
  return fmt::format("it says {:#x} after a motion of {} steps", response.data, *steps_told_);
}

// What only a disabled request could raise is not to be seen.
Wrong Crates::observe(bool lam) {
  if (!is_enabled()) {
    if (lam && (registers_.control() & (kEnables | 0x10)) == 0)
      return "L, and no request is enabled";
    return std::nullopt;
  }
  if (flag_) {
    if (*flag_ == lam) return std::nullopt;
    return lam ? "L, and no start has ended" : "no L any more, and nobody has cleared it";
  }
  flag_ = lam;
  if (lam) end_start();
  return std::nullopt;
}

Wrong Crates::raised(TimeNs, const bushd::api::CamacLam& lam) {
  const std::uint32_t station = 1U << (kBushd2Station - 1);
  if (lam.crate != kCrate || (lam.raised & station) == 0) return std::nullopt;
  if (published_) return "a second LAM, and the first one was not cleared";
  published_ = true;
  if (flag_.value_or(false)) return std::nullopt;
  if (!start_) return "a LAM, and nothing was started";
  flag_ = true;
  end_start();
  return std::nullopt;
}

void Crates::end_start() {
  if (!start_) return;
  ++ended_by_lam_;
  if (start_->reached && start_->candidates.size() == 1) {
    ++ended_all_steps_;
    if (!start_->cleared) steps_told_ = std::abs(start_->candidates.front().steps);
  }
  start_.reset();
}

void Crates::clear() {
  flag_ = published_ = false;
  steps_told_.reset();
  if (start_) start_->cleared = true;
}

ProgramMotion Crates::program() const {
  ProgramMotion motion{.motor = registers_.control() & kMotorBits};
  bushd::camac::Program& program = motion.program;
  program.motor = static_cast<int>(motion.motor);
  program.page = program.motor / Bushd2::kMotorsPerPage;
  program.left = (registers_.control() & kLeft) != 0;
  const std::size_t page = static_cast<std::size_t>(program.page) * Bushd2::kPageBytes;
  const auto at = [&](std::size_t i) { return registers_[page + i]; };
  program.steps = static_cast<std::uint32_t>(at(0) + 256 * at(1));
  for (std::size_t i = 0; i < Bushd2::kCodes; ++i) {
    program.codes.push_back(std::max<std::uint8_t>(at(Bushd2::kFirstCode + i), 1));
  }
  motion.steps = program.left ? -std::int64_t{program.steps} : program.steps;
  // The formula of the report: before step k of N stands code min(k, N - 1 - k, 237).
  motion.unit_ns =
      kSecond / (Bushd2::kCodesPerStartPeriod * config_.crates.front().modules.front().f_start_hz);
  for (std::uint32_t k = 1; k < program.steps; ++k) {
    const auto code = std::min({k, program.steps - 1 - k, 237U});
    motion.delays_ns.push_back(program.codes[code] * motion.unit_ns);
  }
  return motion;
}

// While a motor moves it has no effect. One that is stopped before it has begun ends, and nobody is
// told when.
void Crates::start(TimeNs now_ns) {
  const bool idle = !start_ || start_->over;
  if (!idle && (start_->moves || (start_->sure && !start_->stopped))) return;
  ++starts_;
  const bool unseen = flag_.value_or(true);  // whether it ends at once nobody can see
  // Nor whether the module had heard that its motor was taken from it.
  const bool unheard = start_ && start_->taken_ns == now_ns;
  if (idle || start_->sure) start_ = Start{};
  start_->since_ns = now_ns;
  start_->sure = idle && !unseen && !unheard;
  start_->stopped = false;
  start_->candidates.push_back(program());
  if (!unseen) flag_.reset();
  steps_told_.reset();
}

Crates::Accepted Crates::accepted(const std::string& motor) {
  if (!start_) return {.wrong = motor + " moves, and no F26 has started it"};
  if (start_->moves) return {.wrong = motor + " moves again, and F26 came once"};
  start_->moves = true;
  start_->sure = true;
  const auto& motors = config_.crates.front().modules.front().motors;
  std::erase_if(start_->candidates, [&](const ProgramMotion& one) {
    return one.motor >= motors.size() || config_[motors[one.motor]].name != motor;
  });
  if (start_->candidates.empty()) return {.wrong = motor + " moves, and F26 was for another one"};
  if (start_->candidates.size() > 1) return {};
  return {.motion = start_->candidates.front()};
}

void Crates::motion_ended(bool reached) {
  if (!start_ || !start_->moves) return;
  start_->over = true;
  start_->reached = reached;
  // Nobody can see that L is raised again.
  if (flag_.value_or(false)) start_.reset();
}

void Crates::motor_taken(TimeNs now_ns) {
  if (start_) start_->taken_ns = now_ns;
  motion_ended(false);
}

void Crates::wait_since(TimeNs now_ns) {
  if (start_) start_->since_ns = now_ns;
}

Wrong Crates::check_deadline(TimeNs now_ns) const {
  if (!any_open() || now_ns - start_->since_ns <= kLamDueNs) return std::nullopt;
  return fmt::format("no LAM {} s after a start", kLamDueNs / kSecond);
}

}  // namespace bushfaults
