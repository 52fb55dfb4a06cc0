#include "daemon/services/camac_program.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <span>
#include <sstream>
#include <utility>
#include <vector>

#include "config/words.h"
#include "heritage/camac/bushd2.h"

namespace bushd::daemon {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kUsPerSecond = 1'000'000;

std::string seconds(std::int64_t us) {
  return fmt::format("{}.{:06}", us / kUsPerSecond, us % kUsPerSecond);
}

std::string head(const std::string& motor, bool without_host) {
  return fmt::format("motors = [\"{}\"]\nunit = \"steps\"\nwithout_host = {}\n", motor,
                     without_host);
}

// Both in the order in which they are made.
template <class Code>
std::string codes_text(std::uint32_t unit_ns, std::span<const Code> first, Code middle,
                       std::span<const Code> last) {
  return fmt::format("codes = {{ time_unit_ns = {}, accel = [{}], cruise = {}, decel = [{}] }}\n",
                     unit_ns, fmt::join(first, ","), middle, fmt::join(last, ","));
}

}  // namespace

std::uint32_t code_unit_ns(int f_start_hz) {
  return static_cast<std::uint32_t>(kNsPerSecond /
                                    (camac::Bushd2::kCodesPerStartPeriod * f_start_hz));
}

bool falls_to_the_middle(const camac::Program& program) {
  const auto rise = std::ranges::is_sorted_until(program.codes, std::greater<>());
  return static_cast<std::size_t>(rise - program.codes.begin()) >= camac::codes_used(program);
}

Result<void> may_have_program(const Mcu& mcu, bool as_written) {
  if (mcu.can_have_program()) return {};
  if (as_written) {
    return fail("its codes rise and fall, and MCU " + mcu.name() +
                " cannot have programs, which make codes as they are written; write codes that "
                "fall to the middle and rise from there");
  }
  return fail("the module says without_computer = true, and MCU " + mcu.name() +
              " cannot have programs; leave without_computer out");
}

std::string text_of(const camac::Program& program, const std::string& motor, bool without_host,
                    int f_start_hz) {
  const auto used = static_cast<std::ptrdiff_t>(camac::codes_used(program));
  const std::vector<int> there(program.codes.begin(), program.codes.begin() + used);
  std::vector<int> back(there.rbegin(), there.rend());
  // The step in the middle has its code once. A table has both sides.
  if (program.steps < there.size() + back.size() && back.size() > 1) back.erase(back.begin());
  const std::int64_t steps = program.left ? -std::int64_t{program.steps} : program.steps;
  return head(motor, without_host) +
         codes_text<int>(code_unit_ns(f_start_hz), there, there.back(), back) +
         fmt::format("[[frame]]\nline_by = [[{}]]\n", steps);
}

std::string text_of(const camac::Travel& travel, const std::string& motor, bool without_host) {
  const std::span<const std::uint16_t> codes = travel.codes;
  const auto slower = std::ranges::is_sorted_until(codes, std::greater<>());
  auto falling = static_cast<std::size_t>(slower - codes.begin());
  // A table has both sides.
  if (falling == codes.size() && codes.size() > 1) --falling;
  const std::span rest = codes.subspan(falling);
  const auto steps = static_cast<std::int64_t>(codes.size());
  std::string text =
      head(motor, without_host) +
      codes_text<std::uint16_t>(camac::Travel::kUnitUs * 1000, codes.first(falling),
                                std::ranges::min(codes), rest.empty() ? codes : rest) +
      fmt::format("[[frame]]\ntravel_by = [{}]\n", travel.left ? -steps : steps);
  if (travel.synchronous) {
    text += "after_edge_s = " + seconds(travel.first_run_delay_us()) + "\n";
  }
  return text + "return_s = " + seconds(travel.return_delay_us()) + "\n";
}

std::string as_written_note(const Installation& installation, MotorId id, std::int64_t fastest_ns) {
  const tables::Table& own = *installation.table_of(id);
  std::string note = fmt::format(
      "{}: its codes rise and fall, and are made as they are written; a stop in them ramps down by "
      "table {}",
      installation[id].name(), own.name());
  const std::int64_t own_ns =
      std::int64_t{bushd_table_fastest(&own.view())} * own.view().time_unit_ns;
  if (fastest_ns < own_ns) note += ", which knows no step as fast as theirs";
  return note;
}

std::string to_text(const KeptMotion& motion) {
  return fmt::format("{} {} {} {} {}", motion.control, motion.from_steps, motion.steps, motion.told,
                     motion.checksum);
}

std::optional<KeptMotion> kept_motion_of(const std::string& text) {
  std::istringstream words(text);
  unsigned control = 0;
  KeptMotion motion;
  words >> control >> motion.from_steps >> motion.steps >> motion.told >> motion.checksum;
  if (!words || control > UINT8_MAX || motion.steps == 0 || motion.told > motion.steps) {
    return std::nullopt;
  }
  motion.control = static_cast<std::uint8_t>(control);
  return motion;
}

void CamacProgram::begin(std::int64_t now_us, const Mcu& mcu, std::string text,
                         std::uint64_t after_stops) {
  program_ = name_ + "-" + mcu.name();
  std::ranges::replace(program_, ':', '-');
  program_.resize(std::min(program_.size(), config::kLongestName));
  stage_ = Stage::kGetsPut;
  after_stops_ = after_stops;
  ask_(now_us, asker(), api::PutProgram{.program = program_, .text = std::move(text)});
}

void CamacProgram::find(McuId mcu, std::uint32_t checksum) {
  stage_ = Stage::kFound;
  mcu_ = mcu;
  checksum_ = checksum;
}

std::optional<std::uint32_t> CamacProgram::checksum() const {
  return stage_ == Stage::kFound ? checksum_ : programs_.checksum_of(program_);
}

std::optional<api::Reply> CamacProgram::follow(std::int64_t now_us) {
  if (stage_ == Stage::kFound) {
    const Programs::Found found = programs_.found(mcu_, checksum_);
    if (found == Programs::Found::kEnded) return programs_.ending(mcu_);
    if (found != Programs::Found::kNotThere) return std::nullopt;
    return api::Completed{.outcome = api::Outcome::kLink,
                          .reason = "its MCU does not have the program of its motion any more",
                          .detail = {}};
  }
  if (!session_->last_answer()) return std::nullopt;
  const auto* completed = std::get_if<api::Completed>(&*session_->last_answer());
  const bool put = completed != nullptr && completed->outcome == api::Outcome::kDone;
  if (stage_ == Stage::kRuns || !put) return session_->last_answer();
  stage_ = Stage::kRuns;
  ask_(now_us, asker(), api::RunPrograms{{program_}});
  return std::nullopt;
}

}  // namespace bushd::daemon
