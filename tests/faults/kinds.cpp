#include "kinds.h"

#include "sim/random.h"

namespace bushfaults {
namespace {

template <std::size_t kSize>
std::array<double, kSize> rates(const std::array<KindInfo, kSize>& kinds) {
  std::array<double, kSize> all{};
  for (std::size_t i = 0; i < kSize; ++i) all[i] = kinds[i].per_hour;
  return all;
}

template <std::size_t kSize>
void add_all(std::array<double, kSize>& rates, const std::array<KindInfo, kSize>& kinds,
             bushd::sim::Random& random) {
  for (std::size_t i = 0; i < kSize; ++i) {
    const auto most = static_cast<std::int64_t>(kinds[i].most_of_all);
    const std::int64_t made_up = most > 0 ? random.magnitude(1, most) : 0;
    if (rates[i] == 0) rates[i] = static_cast<double>(made_up);
  }
}

constexpr std::uint32_t kRatesStream = 431;  // of randomness

}  // namespace

void add_all_kinds(FaultRates& faults, CommandRates& commands, std::uint64_t seed) {
  bushd::sim::Random random(seed, kRatesStream);
  add_all(faults, kFaults, random);
  add_all(commands, kCommands, random);
  // MCUs with motors of CAMAC modules have no programs here.
  const auto none = [&commands](CommandKind kind) { commands[static_cast<std::size_t>(kind)] = 0; };
  if (random.one_in(2)) return none(CommandKind::kMcuProgram);
  none(CommandKind::kCamac);
  none(CommandKind::kShutter);
}

FaultRates usual_fault_rates() {
  return rates(kFaults);
}

CommandRates usual_command_rates() {
  return rates(kCommands);
}

}  // namespace bushfaults
