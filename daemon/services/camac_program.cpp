#include "daemon/services/camac_program.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <span>
#include <utility>
#include <vector>

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
                    bool as_written, int f_start_hz) {
  std::string text = head(motor, without_host);
  if (as_written) {
    const std::size_t used = camac::codes_used(program);
    const std::vector<int> codes(program.codes.begin(),
                                 program.codes.begin() + static_cast<std::ptrdiff_t>(used));
    std::vector<int> back(codes.rbegin(), codes.rend());
    // The step in the middle has its code once.
    if (program.steps < 2 * used) back.erase(back.begin());
    text += codes_text<int>(code_unit_ns(f_start_hz), codes, codes.back(), back);
  }
  const std::int64_t steps = program.left ? -std::int64_t{program.steps} : program.steps;
  return text + fmt::format("[[frame]]\n{} = [{}]\n", as_written ? "line_by" : "move_by",
                            as_written ? fmt::format("[{}]", steps) : std::to_string(steps));
}

std::string text_of(const camac::Travel& travel, const std::string& motor, bool without_host,
                    bool as_written) {
  std::string text = head(motor, without_host);
  if (as_written) {
    const std::span<const std::uint16_t> codes = travel.codes;
    text += codes_text<std::uint16_t>(camac::Travel::kUnitUs * 1000, codes.first(codes.size() - 1),
                                      codes.back(), codes.last(1));
  }
  const auto steps = static_cast<std::int64_t>(travel.codes.size());
  text += fmt::format("[[frame]]\ntravel_by = [{}]\n", travel.left ? -steps : steps);
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

void CamacProgram::begin(std::int64_t now_us, std::string text, std::uint64_t after_stops) {
  stage_ = Stage::kGetsPut;
  after_stops_ = after_stops;
  ask_(now_us, asker(), api::PutProgram{.program = name_, .text = std::move(text)});
}

std::optional<api::Reply> CamacProgram::follow(std::int64_t now_us) {
  if (!session_->last_answer()) return std::nullopt;
  const auto* completed = std::get_if<api::Completed>(&*session_->last_answer());
  const bool put = completed != nullptr && completed->outcome == api::Outcome::kDone;
  if (stage_ == Stage::kRuns || !put) return session_->last_answer();
  stage_ = Stage::kRuns;
  ask_(now_us, asker(), api::RunPrograms{{name_}});
  return std::nullopt;
}

}  // namespace bushd::daemon
