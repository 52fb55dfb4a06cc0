#include "heritage/serial_pulse/planner.h"

#include <algorithm>
#include <array>
#include <utility>

namespace bushd::serial_pulse {
namespace {

constexpr std::uint64_t kNsPerS = 1'000'000'000;
// Beyond it a product with a baud rate would not fit in 64 bits: 18 minutes.
constexpr std::uint64_t kLongestNs = std::uint64_t{1} << 40;

constexpr std::array<std::uint32_t, 30> kFixedRates = {
    50,     75,     110,     134,     150,     200,     300,     600,     1200,    1800,
    2400,   4800,   9600,    19200,   38400,   57600,   115200,  230400,  460800,  500000,
    576000, 921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

bool slow_enough(unsigned bits, std::uint64_t delay_ns, std::uint32_t baud) {
  return bits * kNsPerS >= std::min(delay_ns, kLongestNs) * baud;
}

bool allowed(const Pattern& pattern, const Ahead& ahead, std::size_t from, std::uint32_t baud) {
  const std::size_t left = ahead.delays_ns.size() - from;
  for (std::size_t i = 1; i < pattern.steps; ++i) {
    if (!slow_enough(pattern.between_bits, ahead.delays_ns[from + i], baud)) return false;
  }
  return left == pattern.steps ||
         slow_enough(pattern.after_bits, ahead.delays_ns[from + pattern.steps], baud);
}

// An UART makes base / n of what is asked, for a whole n: the next slower one. It rounds n, so the
// rate asked for is the one just above the one wanted.
Rate of_divisor(std::uint32_t base, std::uint32_t at_most) {
  const std::uint32_t n = (base + at_most - 1) / at_most;
  return {.ask = base / n, .most = (base + n - 1) / n};
}

}  // namespace

std::span<const std::uint32_t> fixed_rates() {
  return kFixedRates;
}

std::uint64_t byte_ns(std::uint32_t baud) {
  return (kBitsPerByte * kNsPerS + baud - 1) / baud;
}

std::vector<Rate> rates_for(const Rates& driver, std::uint64_t shortest_ns,
                            std::uint64_t longest_ns) {
  const std::uint64_t fastest = 2 * kNsPerS / std::max<std::uint64_t>(shortest_ns, 1);
  const std::uint64_t slowest = std::max<std::uint64_t>(
      kBitsPerByte * kNsPerS / std::min(longest_ns, kLongestNs), driver.lowest);
  std::vector<Rate> rates;
  // Where all delays are about the same, 0xF0 at a higher rate does as well as 0x55 at a lower one.
  const auto top = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(std::max(fastest, slowest), driver.highest));
  if (!driver.any) {
    for (const std::uint32_t rate : kFixedRates) {
      if (rate > top || rate < driver.lowest) continue;
      if (rate <= slowest) rates.clear();  // a lower one is not needed
      rates.push_back({.ask = rate, .most = rate});
    }
    std::ranges::reverse(rates);
    return rates;
  }
  for (std::uint32_t rate = std::max(top, driver.lowest);;) {
    const Rate next = driver.base >= rate ? of_divisor(driver.base, rate) : Rate{rate, rate};
    if (rates.empty() || next.ask < rates.back().ask) rates.push_back(next);
    if (next.most <= slowest || rate <= driver.lowest) return rates;
    // A fifth lower: finer than the speeds of the bytes of one rate.
    rate = std::max({rate - std::max(rate / 5, 1u), driver.lowest,
                     static_cast<std::uint32_t>(std::min<std::uint64_t>(slowest, rate - 1))});
  }
}

const Pattern* fastest_byte(const Ahead& ahead, std::size_t from, const Rate& rate) {
  const std::size_t left = ahead.delays_ns.size() - from;
  if (left <= kLast.size() && ahead.to_the_end) {
    const Pattern& last = kLast[left - 1];
    if (allowed(last, ahead, from, rate.most)) return &last;
  }
  for (const Pattern& pattern : kAny) {
    // The delay of the step behind it has to be known.
    if (pattern.steps > left || (pattern.steps == left && !ahead.to_the_end)) continue;
    if (allowed(pattern, ahead, from, rate.most)) return &pattern;
  }
  return nullptr;
}

Planner::Trial Planner::try_rate(const Ahead& ahead, const Rate& rate,
                                 std::uint64_t give_up_ns) const {
  Trial trial;
  const std::size_t end = ahead.delays_ns.size() - (ahead.to_the_end ? 0 : kMostSteps);
  const std::uint64_t one_ns = byte_ns(rate.ask);
  while (trial.steps < end && trial.ns <= give_up_ns) {
    const Pattern* pattern = fastest_byte(ahead, trial.steps, rate);
    if (pattern == nullptr) break;
    trial.steps += pattern->steps;
    trial.ns += one_ns;
  }
  return trial;
}

Choice Planner::choose(const Ahead& ahead, std::uint32_t now) const {
  // What the table says of the steps that a trial has not come to, and one more change there.
  const std::size_t end = ahead.delays_ns.size() - (ahead.to_the_end ? 0 : kMostSteps);
  std::vector<std::uint64_t> rest_ns(end + 1, 0);
  for (std::size_t i = end; i-- > 0;) rest_ns[i] = rest_ns[i + 1] + ahead.delays_ns[i];
  const auto cost = [&](const Trial& trial, bool changes) {
    const std::size_t at = std::min(trial.steps, end);
    return trial.ns + (changes ? change_ns_ : 0) + (at < end ? change_ns_ + rest_ns[at] : 0);
  };
  const Rate* best = nullptr;
  std::uint64_t best_ns = UINT64_MAX;
  for (const Rate& rate : rates_) {
    if (rate.ask != now) continue;
    const Trial trial = try_rate(ahead, rate, UINT64_MAX);
    if (trial.steps == 0) continue;
    best = &rate;
    best_ns = cost(trial, false);
  }
  // No other is worth its change if staying costs no more than that.
  if (best == nullptr || best_ns > rest_ns[0] + change_ns_) {
    for (const Rate& rate : rates_) {
      if (rate.ask == now) continue;
      const Trial trial = try_rate(ahead, rate, best_ns);
      if (trial.steps == 0 || cost(trial, true) >= best_ns) continue;
      best = &rate;
      best_ns = cost(trial, true);
    }
  }
  if (best == nullptr) best = &rates_.back();
  const Pattern* pattern = fastest_byte(ahead, 0, *best);
  if (pattern == nullptr) return {.rate = *best, .pattern = kAny.back(), .then_wait = true};
  return {.rate = *best, .pattern = *pattern};
}

void Planner::learn(std::uint32_t ask, std::uint32_t made) {
  for (Rate& rate : rates_) {
    if (rate.ask == ask) rate.most = std::max(rate.most, made);
  }
}

std::vector<std::uint64_t> delays_ahead(Steps steps, std::uint64_t horizon_ns, std::size_t most) {
  std::vector<std::uint64_t> delays;
  std::uint64_t sum_ns = 0;
  while (delays.size() < most && (sum_ns < horizon_ns || delays.size() < 2 * kMostSteps)) {
    const std::uint64_t delay_ns = steps.take_ns();
    if (delay_ns == 0) break;
    delays.push_back(delay_ns);
    sum_ns += delay_ns;
  }
  return delays;
}

Survey survey(bushd_run run, Planner planner) {
  Survey result;
  std::uint32_t now = 0;
  bool first = true;
  std::uint64_t after_ns = 0;  // kept behind the byte before
  while (!bushd_run_done(&run)) {
    const auto delays = delays_ahead(Steps(run), planner.horizon_ns(), Planner::kLookAhead);
    const Ahead ahead{.delays_ns = delays,
                      .to_the_end = delays.size() == bushd_run_steps_left(&run)};
    const auto [rate, pattern, then_wait] = planner.choose(ahead, now);
    if (rate.ask != now && !first) {
      ++result.rates;
      result.made_ns += planner.change_ns();
    } else if (!first) {
      result.longest_ratio = std::max(
          result.longest_ratio, static_cast<double>(after_ns) / static_cast<double>(delays[0]));
    }
    now = rate.ask;
    const std::uint64_t bit_ns = byte_ns(rate.ask) / kBitsPerByte;
    for (unsigned i = 0; i < pattern.steps; ++i) {
      if (!first || i > 0) result.table_ns += delays[i];
      if (i > 0) {
        result.longest_ratio =
            std::max(result.longest_ratio, static_cast<double>(pattern.between_bits * bit_ns) /
                                               static_cast<double>(delays[i]));
      }
      bushd_run_take_step(&run);
    }
    const bool last = bushd_run_done(&run);
    result.made_ns += last ? (kBitsPerByte - pattern.after_bits) * bit_ns : byte_ns(rate.ask);
    after_ns = pattern.after_bits * bit_ns;
    if (then_wait && !last) {
      after_ns += planner.change_ns() + delays[1];
      result.made_ns += planner.change_ns() + delays[1];
    }
    first = false;
  }
  return result;
}

}  // namespace bushd::serial_pulse
