#include "tables/edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace bushd::tables {
namespace {

using Codes = std::vector<std::uint16_t>;

constexpr double kNoise = 1e-6;
constexpr double kMaxCode = std::numeric_limits<std::uint16_t>::max();

Result<TableContent> checked(TableContent content) {
  // A mirror image need not be written out.
  if (content.decel && std::equal(content.decel->rbegin(), content.decel->rend(),
                                  content.accel.begin(), content.accel.end())) {
    content.decel.reset();
  }
  const auto fault = check(content);
  if (!fault) return content;
  const std::string index = fault->index ? fmt::format("[{}]", *fault->index) : "";
  return fail(Error{.message = fault->message, .key = fault->key + index});
}

// Changes one side, and leaves the other and the cruise delay as they are.
Codes& side_of(TableContent& content, SideKey side) {
  if (!content.decel) content.decel = Codes(content.accel.rbegin(), content.accel.rend());
  return side == SideKey::kAccel ? content.accel : *content.decel;
}

tl::unexpected<Error> no_index(SideKey side, std::size_t index, std::size_t size) {
  return fail(fmt::format("{} has no index {}; allowed: 0..{}",
                          side == SideKey::kAccel ? "accel" : "decel", index, size - 1));
}

// Of a mirrored table both sides change, so that it stays one.
Result<Codes*> editable(TableContent& content, SideKey side, std::size_t index, bool end_too) {
  const bool mirrored = !content.decel;
  Codes& codes = mirrored && side == SideKey::kAccel ? content.accel : side_of(content, side);
  if (index < codes.size() + (end_too ? 1 : 0)) return &codes;
  return no_index(side, index, codes.size());
}

Result<std::uint16_t> rounded_up(double units) {
  const double code = std::max(1.0, std::ceil(units - kNoise));
  if (code <= kMaxCode) return static_cast<std::uint16_t>(code);
  return fail(
      fmt::format("a delay becomes {:.0f} time units; allowed: up to 65535. Use a longer time "
                  "unit (\"bushtab resample --time-unit\")",
                  code));
}

Result<TableContent> with_all_codes(TableContent content, double factor) {
  const auto scale = [&](std::uint16_t& code) -> Result<void> {
    const auto scaled = rounded_up(code * factor);
    if (!scaled) return fail(scaled.error());
    code = *scaled;
    return {};
  };
  for (std::uint16_t& code : content.accel) {
    if (auto done = scale(code); !done) return fail(done.error());
  }
  for (std::size_t i = 0; content.decel && i < content.decel->size(); ++i) {
    if (auto done = scale((*content.decel)[i]); !done) return fail(done.error());
  }
  if (content.cruise) {
    if (auto done = scale(*content.cruise); !done) return fail(done.error());
  }
  return checked(std::move(content));
}

// A side of `count` codes with the same speeds, slow to fast. Its first step is that of the old
// one; from there on time over steps is the old function t(x), straight between steps, shrunk in
// both directions. t(x) is concave, so the delays never rise; and no delay is shorter than the
// last.
Codes stretched(const Codes& codes, std::size_t count) {
  if (codes.size() == 1 || count == 1) return Codes(count, codes.back());
  std::vector<double> time{0.0};
  for (std::size_t i = 1; i < codes.size(); ++i) time.push_back(time.back() + codes[i]);
  const double ratio = static_cast<double>(codes.size() - 1) / static_cast<double>(count - 1);
  const auto time_at = [&](std::size_t k) {
    const double x = std::min(static_cast<double>(k) * ratio, static_cast<double>(time.size() - 1));
    const auto whole = std::min(static_cast<std::size_t>(x), time.size() - 2);
    return (time[whole] + (x - static_cast<double>(whole)) * (time[whole + 1] - time[whole])) /
           ratio;
  };
  Codes out{codes.front()};
  for (std::size_t k = 1; k + 1 < count; ++k) {
    const double delay = std::ceil(time_at(k) - time_at(k - 1) - kNoise);
    out.push_back(std::min(out.back(), static_cast<std::uint16_t>(delay)));
  }
  out.push_back(codes.back());
  return out;
}

Result<TableContent> with_sides(TableContent content, double count_factor,
                                std::optional<std::size_t> count) {
  const auto stretch = [&](Codes codes, bool fast_to_slow) -> Result<Codes> {
    const double wanted =
        count ? static_cast<double>(*count)
              : 1 + std::ceil(static_cast<double>(codes.size() - 1) * count_factor - kNoise);
    if (wanted < 1 || wanted > static_cast<double>(kMaxCodes)) {
      return fail(fmt::format("a side would have {:.0f} codes; allowed: 1..{}", wanted, kMaxCodes));
    }
    if (fast_to_slow) std::reverse(codes.begin(), codes.end());
    Codes out = stretched(codes, static_cast<std::size_t>(wanted));
    if (fast_to_slow) std::reverse(out.begin(), out.end());
    return out;
  };
  // The cruise delay follows from the last code only as long as that is the fastest one.
  auto accel = stretch(content.accel, false);
  if (!accel) return fail(accel.error());
  content.accel = std::move(*accel);
  if (content.decel) {
    auto decel = stretch(*content.decel, true);
    if (!decel) return fail(decel.error());
    content.decel = std::move(*decel);
  }
  return checked(std::move(content));
}

std::optional<Error> factor_fault(double factor) {
  if (std::isfinite(factor) && factor > 0) return std::nullopt;
  return Error{.message = fmt::format("a factor of {}; allowed: above 0", factor)};
}

}  // namespace

Result<TableContent> set_codes(TableContent content, SideKey side, std::size_t index,
                               std::span<const std::uint16_t> codes) {
  const auto edited = editable(content, side, index + codes.size() - 1, false);
  if (!edited) return fail(edited.error());
  std::copy(codes.begin(), codes.end(), (*edited)->begin() + static_cast<std::ptrdiff_t>(index));
  return checked(std::move(content));
}

Result<TableContent> insert_codes(TableContent content, SideKey side, std::size_t index,
                                  std::span<const std::uint16_t> codes) {
  const auto edited = editable(content, side, index, true);
  if (!edited) return fail(edited.error());
  (*edited)->insert((*edited)->begin() + static_cast<std::ptrdiff_t>(index), codes.begin(),
                    codes.end());
  return checked(std::move(content));
}

Result<TableContent> delete_codes(TableContent content, SideKey side, std::size_t index,
                                  std::size_t count) {
  if (count == 0 || count > kMaxCodes)
    return fail("a number of codes to delete; allowed: 1 or more");
  const auto edited = editable(content, side, index + count - 1, false);
  if (!edited) return fail(edited.error());
  const auto from = (*edited)->begin() + static_cast<std::ptrdiff_t>(index);
  (*edited)->erase(from, from + static_cast<std::ptrdiff_t>(count));
  return checked(std::move(content));
}

Result<TableContent> scale_speed(TableContent content, double factor) {
  if (auto fault = factor_fault(factor)) return fail(*fault);
  return with_all_codes(std::move(content), 1 / factor);
}

Result<TableContent> scale_acceleration(TableContent content, double factor) {
  if (auto fault = factor_fault(factor)) return fail(*fault);
  return with_sides(std::move(content), 1 / factor, std::nullopt);
}

Result<TableContent> resample_unit(TableContent content, std::uint32_t time_unit_ns) {
  if (time_unit_ns < 1 || time_unit_ns > kMaxTimeUnitNs) {
    return fail(fmt::format("a time unit of {} ns; allowed: 1..{}", time_unit_ns, kMaxTimeUnitNs));
  }
  const double factor = static_cast<double>(content.time_unit_ns) / time_unit_ns;
  content.time_unit_ns = time_unit_ns;
  return with_all_codes(std::move(content), factor);
}

Result<TableContent> resample_codes(TableContent content, std::size_t codes) {
  return with_sides(std::move(content), 1, codes);
}

Result<TableContent> reverse(TableContent content) {
  if (!content.decel) return content;
  if (!content.cruise) content.cruise = content.accel.back();
  Codes accel(content.decel->rbegin(), content.decel->rend());
  content.decel = Codes(content.accel.rbegin(), content.accel.rend());
  content.accel = std::move(accel);
  return checked(std::move(content));
}

}  // namespace bushd::tables
