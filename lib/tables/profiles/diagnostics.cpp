#include "tables/profiles/diagnostics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/run.h"
#include "tables/edit.h"
#include "tables/profiles/make.h"

namespace bushd::tables::profiles {
namespace {

constexpr double kNoise = 1e-6;
constexpr double kSpeedRatio = 2.0;
constexpr int kMostRounds = 30;  // of looking for a factor
// How far the factor shrinks from one round to the next. Coarse codes make jumps of it.
constexpr double kShrink = 0.9;
constexpr double kLeastShrink = 0.5;

// A pair of neighbouring delays, the slower one before the faster one, and where the faster stands.
struct Pair {
  double slower_s;
  double faster_s;
  std::optional<std::size_t> index;  // none: the step from the side to the cruise delay
  // The delays before and after the pair, the same as its own where there are none: a delay tells
  // the mean speed of its step, and the steps of the pair have all speeds between these.
  double before_s;
  double after_s;
};

// The place that asks for the greatest share of what the motor has.
struct Demand {
  Diagnostic diagnostic{};
  double share = 0;
};

class Inspector {
 public:
  Inspector(const Table& table, const Limits& limits) : table_(table), limits_(limits) {
    unit_s_ = table.view().time_unit_ns * 1e-9;
    speed_ratio_ = limits.speed_ratio.value_or(limits.motor ? 0.0 : kSpeedRatio);
  }

  std::vector<Diagnostic> inspect() {
    inspect_side(table_.view().accel, Side::kAccel);
    if (!table_.symmetric()) inspect_side(table_.view().decel, Side::kDecel);
    advise_scaling();
    inspect_cruise();
    inspect_place();
    return std::move(found_);
  }

 private:
  double hz(double delay_s) const { return 1.0 / delay_s; }
  double delay_s(const bushd_ramp& side, std::size_t i) const { return side.code[i] * unit_s_; }
  double cruise_s() const { return table_.view().cruise * unit_s_; }

  void add(Severity severity, const char* rule, const char* side, std::optional<std::size_t> index,
           double value, double limit, std::string message) {
    found_.push_back({severity, rule, side, index, value, limit, std::move(message)});
  }

  // Only those codes of the side that are above the cruise delay are ever run.
  void inspect_side(const bushd_ramp& side, Side which) {
    const char* name = which == Side::kAccel ? "accel" : "decel";
    const auto in_file = [&](std::size_t i) {
      return which == Side::kAccel ? i : side.count - 1 - i;
    };
    const double first_s = std::max(delay_s(side, 0), cruise_s());
    inspect_start(hz(first_s), name, in_file(0));
    Diagnostic ratio{.rule = "speed_ratio", .side = name, .value = speed_ratio_};
    Diagnostic steep{.rule = "acceleration", .side = name, .value = 1};
    Demand torque{.diagnostic = {.rule = "torque", .side = name}};
    Demand jump{.diagnostic = {.rule = "jump", .side = name}};
    if (limits_.motor) inspect_jump(0, first_s, which, in_file(0), jump);
    const auto delay_or_cruise = [&](std::size_t i) {
      return i < side.count ? std::max(cruise_s(), delay_s(side, i)) : cruise_s();
    };
    for (std::size_t i = 0; i < side.count && delay_s(side, i) > cruise_s(); ++i) {
      const bool last = i + 1 == side.count;
      const Pair pair{delay_s(side, i), delay_or_cruise(i + 1), in_file(last ? i : i + 1),
                      delay_s(side, i == 0 ? 0 : i - 1), delay_or_cruise(i + 2)};
      inspect_ratio(pair, ratio);
      inspect_acceleration(pair, steep);
      if (!limits_.motor) continue;
      inspect_torque(pair, which, torque);
      inspect_jump(hz(pair.slower_s), pair.faster_s, which, pair.index, jump);
    }
    for (Diagnostic& diagnostic : std::array{ratio, steep, torque.diagnostic, jump.diagnostic}) {
      if (!diagnostic.message.empty()) found_.push_back(std::move(diagnostic));
    }
  }

  void inspect_start(double start_hz, const char* name, std::size_t index) {
    if (!limits_.start_hz || start_hz <= *limits_.start_hz * (1 + kNoise)) return;
    add(Severity::kError, "start_speed", name, index, start_hz, *limits_.start_hz,
        fmt::format(
            "begins or ends at {:.6g} steps/s; the motor starts and stops at {:.6g} at most. "
            "Put slower codes before it",
            start_hz, *limits_.start_hz));
  }

  void inspect_ratio(const Pair& pair, Diagnostic& worst) const {
    const double ratio = pair.slower_s / pair.faster_s;
    if (speed_ratio_ <= 0 || ratio <= worst.value * (1 + kNoise)) return;
    worst.index = pair.index;
    worst.value = ratio;
    worst.limit = speed_ratio_;
    worst.message = fmt::format(
        "the speed changes {:.3g} times from one step to the next; allowed: "
        "{:.3g} times. Put codes in between",
        ratio, speed_ratio_);
  }

  // The least acceleration that rounding up leaves possible: a code may stand for a delay of up to
  // one unit less.
  double least_acceleration(double slower_s, double faster_s) const {
    const double least_s = slower_s - unit_s_ * (1 - kNoise);
    if (least_s <= faster_s) return 0;
    return (hz(faster_s) - hz(least_s)) / (0.5 * (slower_s + faster_s));
  }

  double greatest_acceleration() const {
    double greatest = 0;
    for (const bushd_ramp& side : {table_.view().accel, table_.view().decel}) {
      for (std::size_t i = 0; i < side.count && delay_s(side, i) > cruise_s(); ++i) {
        const double next_s =
            i + 1 < side.count ? std::max(cruise_s(), delay_s(side, i + 1)) : cruise_s();
        greatest = std::max(greatest, least_acceleration(delay_s(side, i), next_s));
      }
    }
    return greatest;
  }

  // The factor is tried out: codes that are coarse hide how steep the ramp between them is.
  std::optional<double> factor_that_helps() const {
    TableContent content{.name = table_.name(), .time_unit_ns = table_.view().time_unit_ns};
    const auto codes = [](const bushd_ramp& side) {
      return std::vector<std::uint16_t>(side.code, side.code + side.count);
    };
    content.accel = codes(table_.view().accel);
    content.decel = codes(table_.view().decel);
    std::reverse(content.decel->begin(), content.decel->end());
    content.cruise = table_.view().cruise;
    double factor = *limits_.acceleration / greatest_acceleration();
    for (int round = 0; round < kMostRounds; ++round) {
      const double digit = std::pow(10.0, std::floor(std::log10(factor)) - 2);
      factor = std::floor(factor / digit) * digit;
      auto scaled = scale_acceleration(content, factor);
      if (!scaled) return std::nullopt;
      const auto table = make(std::move(*scaled));
      if (!table) return std::nullopt;
      const double greatest = Inspector(**table, limits_).greatest_acceleration();
      if (greatest <= *limits_.acceleration * (1 + kNoise)) return factor;
      factor *= std::clamp(*limits_.acceleration / greatest, kLeastShrink, kShrink);
    }
    return std::nullopt;
  }

  void advise_scaling() {
    const auto steep = [](const Diagnostic& diagnostic) {
      return diagnostic.rule == "acceleration";
    };
    if (std::none_of(found_.begin(), found_.end(), steep)) return;
    const auto factor = factor_that_helps();
    for (Diagnostic& diagnostic : found_) {
      if (!factor || !steep(diagnostic)) continue;
      diagnostic.message += fmt::format(", or \"bushtab scale --acceleration {:.3g}\"", *factor);
    }
  }

  // `worst.value` is the share of what is allowed until the diagnostic is made.
  void inspect_acceleration(const Pair& pair, Diagnostic& worst) const {
    if (!limits_.acceleration) return;
    const double acceleration = least_acceleration(pair.slower_s, pair.faster_s);
    if (acceleration <= *limits_.acceleration * (1 + kNoise) ||
        (!worst.message.empty() && acceleration <= worst.value)) {
      return;
    }
    worst.index = pair.index;
    worst.value = acceleration;
    worst.limit = *limits_.acceleration;
    worst.message =
        fmt::format("accelerates by {:.6g} steps/s^2; allowed: {:.6g}. Put codes in between",
                    acceleration, worst.limit);
  }

  // Takes the place of what was found before if it asks for a greater share of what there is.
  // Returns whether it does, and is more than the safety factor leaves.
  bool is_worst(double needs, double has, Demand& worst) const {
    const double share = has > 0 ? needs / has : std::numeric_limits<double>::infinity();
    if (needs <= 0 || share * limits_.motor->safety <= 1 + kNoise || share <= worst.share) {
      return false;
    }
    worst.share = share;
    worst.diagnostic.severity = share > 1 + kNoise ? Severity::kError : Severity::kWarning;
    worst.diagnostic.value = needs;
    worst.diagnostic.limit = has / limits_.motor->safety;
    return true;
  }

  static const char* outcome(const Demand& worst) {
    return worst.diagnostic.severity == Severity::kError ? "it will lose steps"
                                                         : "it may lose steps";
  }

  void inspect_torque(const Pair& pair, Side which, Demand& worst) const {
    const Motor& motor = *limits_.motor;
    const double speed_hz = 2.0 / (pair.slower_s + pair.faster_s);
    const double friction_nm = which == Side::kAccel ? motor.friction_nm : -motor.brake_friction_nm;
    constexpr double kTurn = 6.283185307179586;
    const double needs_nm = least_acceleration(pair.slower_s, pair.faster_s) * kTurn /
                                motor.steps_per_turn * motor.inertia_kgm2 +
                            friction_nm;
    // The acceleration is a mean of those from the beginning of the slower step to the end of the
    // faster one. As above, a code may stand for a delay of up to one unit less.
    const double fastest_hz = hz(std::max(pair.after_s - unit_s_, 0.0));
    const double has_nm = greatest_torque(motor, hz(pair.before_s), fastest_hz);
    inspect_load(needs_nm, has_nm, speed_hz, pair.index,
                 "Make the table slower, or with --law torque", worst);
  }

  void inspect_load(double needs_nm, double has_nm, double speed_hz,
                    std::optional<std::size_t> index, const char* remedy, Demand& worst) const {
    if (!is_worst(needs_nm, has_nm, worst)) return;
    worst.diagnostic.index = index;
    worst.diagnostic.message = fmt::format(
        "takes {:.3g} Nm at {:.6g} steps/s and the motor has {:.3g}, {:.3g} with the safety "
        "factor: {}. {}",
        needs_nm, speed_hz, has_nm, worst.diagnostic.limit, outcome(worst), remedy);
  }

  // From `from_hz`, 0 at the start. Where the motor has no torque at all, that is what is wrong.
  void inspect_jump(double from_hz, double to_s, Side which, std::optional<std::size_t> index,
                    Demand& worst) const {
    const double to_hz = hz(to_s);
    const double greatest_hz = greatest_jump_hz(*limits_.motor, which, to_hz);
    if (greatest_hz <= 0 || !is_worst(to_hz - from_hz, greatest_hz, worst)) return;
    worst.diagnostic.index = index;
    worst.diagnostic.message = fmt::format(
        "the speed jumps from {:.6g} to {:.6g} steps/s within a step, and the rotor catches up "
        "{:.3g} steps/s, {:.3g} with the safety factor: {}. {}",
        from_hz, to_hz, greatest_hz, worst.diagnostic.limit, outcome(worst),
        from_hz > 0 ? "Use a shorter time unit, or put codes in between"
                    : "Put slower codes before it");
  }

  void inspect_cruise() {
    const bushd_table& view = table_.view();
    const double cruise_hz = hz(bushd_table_fastest(&view) * unit_s_);
    if (limits_.max_hz && cruise_hz > *limits_.max_hz * (1 + kNoise)) {
      add(Severity::kError, "max_speed", "cruise", std::nullopt, cruise_hz, *limits_.max_hz,
          fmt::format("cruises at {:.6g} steps/s; allowed: {:.6g}. Set cruise = {:.0f} or more",
                      cruise_hz, *limits_.max_hz,
                      std::ceil(1 / (*limits_.max_hz * unit_s_) - kNoise)));
    }
    const double resolution = 1.0 / view.cruise;
    if (limits_.code_bits != 8U && resolution > limits_.resolution * (1 + kNoise)) {
      add(Severity::kWarning, "resolution", "cruise", std::nullopt, resolution, limits_.resolution,
          fmt::format(
              "one code more changes the cruise speed by {:.3g} %; allowed: {:.3g} %. Use a "
              "shorter time_unit_ns",
              100 * resolution, 100 * limits_.resolution));
    }
    if (limits_.motor) inspect_cruise_torque(cruise_hz);
  }

  void inspect_cruise_torque(double cruise_hz) {
    const Motor& motor = *limits_.motor;
    const double end_hz = motor.torque.back().speed_hz;
    if (cruise_hz > end_hz * (1 + kNoise)) {
      return add(Severity::kError, "torque", "cruise", std::nullopt, cruise_hz, end_hz,
                 fmt::format("cruises at {:.6g} steps/s; the torque curve ends at {:.6g}. Set a "
                             "slower cruise",
                             cruise_hz, end_hz));
    }
    Demand cruise{.diagnostic = {.rule = "torque", .side = "cruise"}};
    inspect_load(motor.friction_nm, torque_at(motor, std::min(cruise_hz, end_hz)), cruise_hz,
                 std::nullopt, "Set a slower cruise", cruise);
    if (!cruise.diagnostic.message.empty()) found_.push_back(std::move(cruise.diagnostic));
  }

  void inspect_place() {
    const bushd_table& view = table_.view();
    if (limits_.code_bits == 8U) inspect_bytes();
    const std::uint32_t codes = view.accel.count + (table_.symmetric() ? 0 : view.decel.count);
    if (limits_.mcu_codes && codes > *limits_.mcu_codes) {
      add(Severity::kError, "mcu_memory", "", std::nullopt, codes, *limits_.mcu_codes,
          fmt::format("has {} codes; the MCU has memory for {}. Use a steeper ramp, \"bushtab "
                      "resample\", or sides that mirror each other",
                      codes, *limits_.mcu_codes));
    }
    if (!limits_.tick_ns) return;
    const std::uint32_t steps = bushd_table_max_steps_per_tick(&view, *limits_.tick_ns);
    if (steps > BUSHD_MAX_STEPS_PER_TICK) {
      add(Severity::kError, "tick", "cruise", std::nullopt, steps, BUSHD_MAX_STEPS_PER_TICK,
          fmt::format(
              "makes up to {} steps in a tick of {} us; allowed: {}. Use a shorter tick or a "
              "slower table",
              steps, *limits_.tick_ns / 1000, BUSHD_MAX_STEPS_PER_TICK));
    }
    if (!limits_.slots) return;
    const double slot_s = *limits_.tick_ns * 1e-9 / *limits_.slots;
    const double fastest_s = bushd_table_fastest(&view) * unit_s_;
    if (fastest_s < 2 * slot_s * (1 - kNoise)) {
      add(Severity::kWarning, "slots", "cruise", std::nullopt, fastest_s * 1e6, 2e6 * slot_s,
          fmt::format(
              "the shortest delay is {:.4g} us and a slot {:.4g} us, so steps come up to {:.0f} % "
              "of a delay early or late; allowed: two slots. Use a shorter tick or a slower table",
              fastest_s * 1e6, slot_s * 1e6, 100 * slot_s / fastest_s));
    }
  }

  void inspect_bytes() {
    const bushd_table& view = table_.view();
    for (const auto& [code, side, index] :
         {std::tuple{view.accel.code[0], "accel", std::size_t{0}},
          std::tuple{view.decel.code[0], "decel", std::size_t{view.decel.count - 1u}},
          std::tuple{bushd_table_fastest(&view), "cruise", std::size_t{0}}}) {
      if (code >= kBushdFastest && code <= kBushdSlowest) continue;
      const bool slow = code > kBushdSlowest;
      add(Severity::kError, "code_width", side, index, code, slow ? kBushdSlowest : kBushdFastest,
          fmt::format("is code {}; BUSHD-2 has bytes of 10 (25 F_start) to 250 (F_start). Use a {} "
                      "time unit",
                      code, slow ? "longer" : "shorter"));
    }
  }

  const Table& table_;
  const Limits& limits_;
  double unit_s_ = 0;
  double speed_ratio_ = 0;
  std::vector<Diagnostic> found_;
};

}  // namespace

std::vector<Diagnostic> diagnostics(const Table& table, const Limits& limits) {
  return Inspector(table, limits).inspect();
}

}  // namespace bushd::tables::profiles
