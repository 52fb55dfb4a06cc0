// Which byte comes next, and at which baud rate, so that no step comes earlier than its table
// allows. With d(j) the delay before step j, in ns, and a byte at B baud for steps j .. j+k-1:
//
//     b * 10^9 >= d(i) * B      i = j+1 .. j+k-1,   b the bits between its steps
//     a * 10^9 >= d(j+k) * B    a the bits after its last one
//
// in integers. The delay before its own first step is kept by the byte before it, however long the
// pause between the two is: a pause only makes it longer. So each byte by itself keeps the promise,
// and what is planned may change after any byte.
//
// How much later than their table steps come is what rates and bytes cost. Where the delay does not
// change, the rate fits it to 1 / B of it (B is a whole number). On a ramp the bytes of one rate
// make 1, 2, 3 or 5 steps in ten bits, and a change of rate costs `change_ns`, in which the line is
// drained: choose() weighs the two over the next steps, so that what it makes takes, over the time
// that it looks ahead, no longer than the best single change would. survey() makes the bound for a
// whole run, exactly: it plans it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/run.h"
#include "heritage/serial_pulse/pattern.h"
#include "heritage/serial_pulse/steps.h"

namespace bushd::serial_pulse {

// What is asked of a driver, and the highest that it may make of it.
struct Rate {
  std::uint32_t ask;
  std::uint32_t most;
};

// What a driver can do.
struct Rates {
  bool any = false;        // any whole number of bit/s (termios2), else the fixed ones
  std::uint32_t base = 0;  // of the divisors of an UART, bit/s; 0: not known
  std::uint32_t lowest = 50;
  std::uint32_t highest = 4'000'000;
};

// The fixed rates of Linux, rising.
std::span<const std::uint32_t> fixed_rates();

// Rates for a run whose shortest delay is `shortest_ns` and whose longest is `longest_ns`, falling:
// the first one has 0x55 just slow enough for the shortest, the last one 0xF0 for the longest, as
// far as the driver goes. Never empty.
std::vector<Rate> rates_for(const Rates& driver, std::uint64_t shortest_ns,
                            std::uint64_t longest_ns);

// Delays before the next steps of a run: [0] before the very next one, which has been kept already.
struct Ahead {
  std::span<const std::uint64_t> delays_ns;
  bool to_the_end;  // there are no more
};

struct Choice {
  Rate rate;
  Pattern pattern;
  bool then_wait = false;  // the next byte's delay begins when this one has left for sure
};

class Planner {
 public:
  static constexpr std::size_t kLookAhead = 600;  // steps, at most

  Planner() = default;
  Planner(std::vector<Rate> rates, std::uint64_t change_ns)
      : rates_(std::move(rates)), change_ns_(change_ns) {}

  // How far ahead choose() wants to see: so many ns, kLookAhead steps, or the end.
  std::uint64_t horizon_ns() const { return 12 * change_ns_; }
  std::uint64_t change_ns() const { return change_ns_; }

  // `now`: asked for last; 0: none yet. Where a delay is longer than ten bits at the lowest rate,
  // it begins when the step before it has been made for sure. Precondition: delays_ns is not empty.
  Choice choose(const Ahead& ahead, std::uint32_t now) const;

  // The driver has made `made` of what it was asked.
  void learn(std::uint32_t ask, std::uint32_t made);

 private:
  struct Trial {
    std::size_t steps = 0;
    std::uint64_t ns = 0;
  };
  Trial try_rate(const Ahead& ahead, const Rate& rate, std::uint64_t give_up_ns) const;

  std::vector<Rate> rates_;
  std::uint64_t change_ns_ = 0;
};

// The byte with the most steps at this rate that is slow enough; null if none is.
const Pattern* fastest_byte(const Ahead& ahead, std::size_t from, const Rate& rate);

std::uint64_t byte_ns(std::uint32_t baud);  // how long a byte takes, rounded up

// The next delays, without making the steps.
std::vector<std::uint64_t> delays_ahead(Steps steps, std::uint64_t horizon_ns, std::size_t most);

// A whole run as it would be made.
struct Survey {
  std::uint64_t table_ns = 0;  // by the table, from its first step to its last
  std::uint64_t made_ns = 0;   // by bytes, changes of rate among it
  unsigned rates = 0;          // changes of rate
  double longest_ratio = 1;    // of an interval to its delay, changes of rate aside
};
Survey survey(bushd_run run, Planner planner);

}  // namespace bushd::serial_pulse
