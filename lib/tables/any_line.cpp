#include "tables/any_line.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace bushd::tables {
namespace {

// One side of one motor, in ns, asked for k = 0, 1, 2 ...
class AnyTerm {
 public:
  AnyTerm(const bushd_table& table, bool decel, unsigned elementary)
      : elementary_(elementary),
        ramp_(decel ? table.decel : table.accel),
        cruise_(table.cruise),
        unit_ns_(table.time_unit_ns),
        late_(decel ? 1 : 0) {}

  std::uint64_t delay_ns() const {
    const std::uint64_t share = k_ == 0 ? 0 : (greatest_ + k_ - 1) / k_;
    return std::max({code(k_), share, elementary_code()}) * unit_ns_;
  }
  void next() {
    greatest_ = std::max(greatest_, (k_ + 1) * code(k_ < late_ ? 0 : k_ - late_));
    ++k_;
  }

 private:
  // The most that any motor asks for whose steps are `apart` steps of an elementary line apart.
  std::uint64_t elementary_code() const {
    if (elementary_ < 2) return 0;
    std::uint64_t most = 0;
    const std::uint64_t late = elementary_ - 2 + late_;
    for (std::uint64_t apart = 1; (code(0) + apart - 1) / apart > most; ++apart) {
      const std::uint64_t times = elementary_ == 2 ? apart + 1 : apart << (elementary_ - 1);
      const std::uint64_t at = k_ / times;
      most = std::max(most, (code(at < late ? 0 : at - late) + apart - 1) / apart);
    }
    return most;
  }
  std::uint64_t code(std::uint64_t i) const {
    return i < ramp_.count ? std::max(ramp_.code[i], cruise_) : cruise_;
  }

  unsigned elementary_;
  const bushd_ramp& ramp_;
  std::uint16_t cruise_;
  std::uint64_t unit_ns_;
  std::uint64_t late_;
  std::uint64_t k_ = 0;
  std::uint64_t greatest_ = 0;  // (m + 1) times the delay of m, of all m < k
};

std::uint64_t any_slowest_ns(const bushd_table& table) {
  const std::uint64_t code = std::max({table.accel.code[0], table.decel.code[0], table.cruise});
  return code * table.time_unit_ns;
}

std::uint64_t any_rounded_up(std::uint64_t ns, std::uint64_t unit_ns) {
  return (ns + unit_ns - 1) / unit_ns;
}

// Slow to fast, at least one; one more than a table may have if they are too many.
std::vector<std::uint16_t> any_side_of(std::span<const bushd_table* const> tables,
                                       std::uint64_t unit_ns, std::uint16_t cruise, bool decel,
                                       unsigned elementary) {
  std::vector<AnyTerm> terms;
  for (const bushd_table* table : tables) terms.emplace_back(*table, decel, elementary);
  std::vector<std::uint16_t> codes;
  while (codes.size() <= kMaxCodes) {
    std::uint64_t code = cruise;
    for (const AnyTerm& term : terms)
      code = std::max(code, any_rounded_up(term.delay_ns(), unit_ns));
    if (!codes.empty() && code == cruise) break;
    codes.push_back(static_cast<std::uint16_t>(code));
    for (AnyTerm& term : terms) term.next();
  }
  return codes;
}

}  // namespace

Result<TablePtr> any_line_table(std::span<const bushd_table* const> tables, std::string name,
                                unsigned elementary) {
  std::uint64_t unit_ns = UINT32_MAX;
  std::uint64_t most_ns = 0;
  std::uint64_t cruise_ns = 0;
  for (const bushd_table* table : tables) {
    unit_ns = std::min<std::uint64_t>(unit_ns, table->time_unit_ns);
    most_ns = std::max(most_ns, any_slowest_ns(*table));
    cruise_ns = std::max(cruise_ns, std::uint64_t{table->cruise} * table->time_unit_ns);
  }
  unit_ns = std::max(unit_ns, any_rounded_up(most_ns, UINT16_MAX));
  const auto cruise = static_cast<std::uint16_t>(any_rounded_up(cruise_ns, unit_ns));
  TableContent content{.name = std::move(name),
                       .time_unit_ns = static_cast<std::uint32_t>(unit_ns),
                       .accel = any_side_of(tables, unit_ns, cruise, false, elementary),
                       .cruise = cruise};
  std::vector<std::uint16_t> decel = any_side_of(tables, unit_ns, cruise, true, elementary);
  std::ranges::reverse(decel);
  content.decel = std::move(decel);
  return make(std::move(content));
}

}  // namespace bushd::tables
