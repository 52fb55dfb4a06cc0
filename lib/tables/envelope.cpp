#include "tables/envelope.h"

#include <algorithm>

#include "tables/move_time.h"

namespace bushd::tables {
namespace {

__extension__ using Wide = unsigned __int128;

// The sums of a side must stay below this (bushd_table_check).
constexpr std::uint64_t kMostUnits = (std::uint64_t{1} << 31) - 1;

// A motor's delays as those of the run.
class Scale {
 public:
  Scale(std::uint32_t longest, std::uint32_t unit_ns) : longest_(longest), unit_ns_(unit_ns) {}

  // Rounded up.
  std::uint64_t delay(const LinePart& part, bushd_delay code) const {
    const bool elementary = part.apart != 0;
    const Wide own = Wide{elementary ? 1 : part.increment} * code * part.table->time_unit_ns;
    const Wide unit = Wide{elementary ? part.apart : longest_} * unit_ns_;
    return static_cast<std::uint64_t>((own + unit - 1) / unit);
  }

 private:
  std::uint32_t longest_;
  std::uint32_t unit_ns_;
};

bushd_delay least_delay(const LinePart& part) {
  return std::max<bushd_delay>(part.table->cruise, part.shortest_delay);
}

bushd_delay slowest_code(const LinePart& part) {
  return std::max<bushd_delay>(
      {part.table->accel.code[0], part.table->decel.code[0], least_delay(part)});
}

std::uint32_t unit_of(std::span<const LinePart> parts, std::uint32_t longest) {
  std::uint32_t unit_ns = UINT32_MAX;
  std::uint64_t slowest_ns = 0;
  for (const LinePart& part : parts) {
    if (part.increment == 0) continue;
    unit_ns = std::min(unit_ns, part.table->time_unit_ns);
    slowest_ns = std::max(slowest_ns, Scale(longest, 1).delay(part, slowest_code(part)));
  }
  const std::uint64_t fits = (slowest_ns + UINT16_MAX - 1) / UINT16_MAX;
  return std::max(unit_ns, static_cast<std::uint32_t>(fits));
}

// One side of one motor, asked for k = 0, 1, 2 ... It divides only where its index moves on.
class Term {
 public:
  Term(const LinePart& part, const Scale& scale, std::uint32_t longest, bool decel)
      : part_(part),
        scale_(scale),
        longest_(longest),
        ramp_(decel ? part.table->decel : part.table->accel),
        late_(part.late + (decel && part.increment != longest ? 1u : 0u)) {
    delay_ = scale_.delay(part_, code());
  }

  std::uint64_t delay() const { return delay_; }
  void next() {
    const std::uint32_t before = index();
    part_steps_ += part_.increment;
    if (part_steps_ >= longest_) {
      part_steps_ -= longest_;
      ++steps_;
    }
    if (index() != before && before < ramp_.count) delay_ = scale_.delay(part_, code());
  }

 private:
  std::uint32_t index() const { return steps_ < late_ ? 0 : steps_ - late_; }
  std::uint16_t code() const {
    const std::uint16_t least = part_.table->cruise;
    return index() < ramp_.count ? std::max(ramp_.code[index()], least) : least;
  }

  const LinePart& part_;
  const Scale& scale_;
  std::uint32_t longest_;
  const bushd_ramp& ramp_;
  std::uint32_t late_;
  std::uint32_t steps_ = 0;       // floor(r k)
  std::uint32_t part_steps_ = 0;  // and what is left, below `longest`
  std::uint64_t delay_;
};

// The codes above `cruise`, at least one. If they are too many, or add up to too much, `cruise` is
// the last one that there is room for.
std::vector<std::uint16_t> side_of(std::span<const LinePart> parts, const Scale& scale,
                                   std::uint32_t longest, bool decel, std::uint16_t& cruise) {
  std::vector<Term> terms;
  for (const LinePart& part : parts) {
    if (part.increment != 0) terms.emplace_back(part, scale, longest, decel);
  }
  std::vector<std::uint16_t> codes;
  std::uint64_t sum = 0;
  while (true) {
    std::uint64_t code = cruise;
    for (const Term& term : terms) code = std::max(code, term.delay());
    if (!codes.empty() && code == cruise) return codes;
    sum += code;
    if (!codes.empty() && (codes.size() == Envelope::kMostCodes || sum > kMostUnits)) {
      cruise = codes.back();
      return codes;
    }
    codes.push_back(static_cast<std::uint16_t>(code));
    for (Term& term : terms) term.next();
  }
}

}  // namespace

bushd_ramp Envelope::Side::index() {
  bushd_ramp ramp{};
  ramp.code = code.data();
  ramp.count = static_cast<std::uint16_t>(code.size());
  sum.resize(bushd_ramp_sum_entries(&ramp));
  bucket.resize(bushd_ramp_bucket_entries(&ramp));
  bushd_ramp_index(&ramp, sum.data(), bucket.data());
  return ramp;
}

Envelope::Envelope(std::span<const LinePart> parts, std::uint32_t longest) {
  view_.time_unit_ns = unit_of(parts, longest);
  const Scale scale(longest, view_.time_unit_ns);
  const auto greatest = [&](auto code_of) {
    std::uint64_t most = 0;
    for (const LinePart& part : parts) most = std::max(most, scale.delay(part, code_of(part)));
    return static_cast<std::uint16_t>(most);
  };
  view_.cruise = greatest([](const LinePart& part) { return part.table->cruise; });
  shortest_delay_ = shortest_delay_of(parts, longest);
  accel_.code = side_of(parts, scale, longest, false, view_.cruise);
  decel_.code = side_of(parts, scale, longest, true, view_.cruise);
  view_.accel = accel_.index();
  view_.decel = decel_.code == accel_.code ? view_.accel : decel_.index();  // the same codes
}

bushd_delay Envelope::shortest_delay_of(std::span<const LinePart> parts,
                                        std::uint32_t longest) const {
  const Scale scale(longest, view_.time_unit_ns);
  std::uint64_t shortest_delay = 0;
  for (const LinePart& part : parts)
    shortest_delay = std::max(shortest_delay, scale.delay(part, part.shortest_delay));
  return shortest_delay;
}

std::size_t limiting_part(std::span<const LinePart> parts, std::uint32_t longest) {
  std::size_t limiting = 0;
  std::uint64_t longest_ns = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].increment == 0) continue;
    const Envelope alone(parts.subspan(i, 1), longest);
    bushd_table table = alone.view();
    // The same run (engine/run.h); of its own parts a shortest delay has 16 bits.
    table.cruise =
        static_cast<std::uint16_t>(std::max<bushd_delay>(table.cruise, alone.shortest_delay()));
    const std::uint64_t time_ns = move_time(table, longest).time_ns;
    if (time_ns <= longest_ns) continue;
    longest_ns = time_ns;
    limiting = i;
  }
  return limiting;
}

}  // namespace bushd::tables
