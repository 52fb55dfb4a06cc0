#include "code_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace bushtab {
namespace {

using bushd::tables::TableContent;
using Codes = std::vector<std::uint16_t>;

constexpr double kNoise = 1e-6;
constexpr std::uint16_t kMaxCode = std::numeric_limits<std::uint16_t>::max();

std::size_t decel_count(const TableContent& content) {
  return content.decel ? content.decel->size() : content.accel.size();
}

// What a range means for each side, in the order of the file.
struct Parts {
  std::optional<CodeRange> accel;
  std::optional<CodeRange> decel;  // never of a mirrored table
  bool cruise = false;
};

Parts parts_of(const TableContent& content, CodeRange range) {
  const std::size_t cruise = content.accel.size();
  Parts parts;
  parts.cruise = range.contains(cruise);
  if (range.first < cruise) parts.accel = {range.first, std::min(range.last, cruise - 1)};
  if (range.last <= cruise) return parts;
  const CodeRange decel{std::max(range.first, cruise + 1) - cruise - 1, range.last - cruise - 1};
  if (content.decel) {
    parts.decel = decel;
    return parts;
  }
  // Both meet at the last code of accel if the range goes over cruise, so they are one range.
  const CodeRange mirrored{cruise - 1 - decel.last, cruise - 1 - decel.first};
  parts.accel =
      parts.accel ? CodeRange{std::min(parts.accel->first, mirrored.first), cruise - 1} : mirrored;
  return parts;
}

// The last code of accel stands for a cruise delay that is not told.
bool cruise_follows(const TableContent& content, const Parts& parts) {
  return !content.cruise && parts.accel && parts.accel->last + 1 == content.accel.size();
}

std::uint16_t bounded(double code, std::uint16_t low, std::uint16_t high) {
  return static_cast<std::uint16_t>(
      std::clamp(std::ceil(code - kNoise), static_cast<double>(low), static_cast<double>(high)));
}

// Returns how many codes were held.
std::size_t change_side(Codes& codes, CodeRange range, bool slow_to_fast,
                        const CodeChange& change) {
  std::uint16_t slow = kMaxCode;
  std::uint16_t fast = 1;
  if (range.first > 0) (slow_to_fast ? slow : fast) = codes[range.first - 1];
  if (range.last + 1 < codes.size()) (slow_to_fast ? fast : slow) = codes[range.last + 1];
  std::size_t held = 0;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    const double wanted = change(codes[i]);
    codes[i] = bounded(wanted, fast, slow);
    if (codes[i] != bounded(wanted, 1, kMaxCode)) ++held;
  }
  return held;
}

void erase(Codes& codes, CodeRange range) {
  const auto begin = codes.begin();
  codes.erase(begin + static_cast<std::ptrdiff_t>(range.first),
              begin + static_cast<std::ptrdiff_t>(range.last + 1));
}

std::string side_difference(const char* name, const Codes& before, const Codes& after) {
  if (before == after) return "";
  if (before.size() != after.size()) {
    return fmt::format("{} {} to {} codes", name, before.size(), after.size());
  }
  const auto first = std::mismatch(before.begin(), before.end(), after.begin()).first;
  const auto last = std::mismatch(before.rbegin(), before.rend(), after.rbegin()).first;
  const auto low = first - before.begin();
  const auto high = before.rend() - last - 1;
  return low == high ? fmt::format("{}[{}]", name, low)
                     : fmt::format("{}[{}..{}]", name, low, high);
}

}  // namespace

std::size_t code_count(const TableContent& content) {
  return content.accel.size() + 1 + decel_count(content);
}

CodePlace place_of(const TableContent& content, std::size_t at) {
  const std::size_t cruise = content.accel.size();
  if (at < cruise) return {CurveStep::Part::kAccel, at};
  if (at == cruise) return {CurveStep::Part::kCruise, 0};
  return {CurveStep::Part::kDecel, at - cruise - 1};
}

std::uint16_t code_at(const TableContent& content, std::size_t at) {
  const CodePlace place = place_of(content, at);
  if (place.part == CurveStep::Part::kAccel) return content.accel[place.index];
  if (place.part == CurveStep::Part::kCruise) return content.cruise.value_or(content.accel.back());
  return content.decel ? (*content.decel)[place.index]
                       : content.accel[content.accel.size() - 1 - place.index];
}

std::string place_text(const TableContent& content, std::size_t at) {
  const CodePlace place = place_of(content, at);
  if (place.part == CurveStep::Part::kCruise) return "cruise";
  return fmt::format("{}[{}]", place.part == CurveStep::Part::kAccel ? "accel" : "decel",
                     place.index);
}

Changed change_codes(TableContent content, CodeRange range, const CodeChange& change) {
  const Parts parts = parts_of(content, range);
  std::size_t held = 0;
  if (parts.cruise && !cruise_follows(content, parts)) {
    content.cruise = bounded(change(code_at(content, content.accel.size())), 1, kMaxCode);
  }
  if (parts.accel) held += change_side(content.accel, *parts.accel, true, change);
  if (parts.decel) held += change_side(*content.decel, *parts.decel, false, change);
  return {std::move(content), held};
}

TableContent with_code(TableContent content, CodeRange range, std::uint16_t code) {
  const Parts parts = parts_of(content, range);
  const auto fill = [code](Codes& codes, CodeRange part) {
    std::fill(codes.begin() + static_cast<std::ptrdiff_t>(part.first),
              codes.begin() + static_cast<std::ptrdiff_t>(part.last + 1), code);
  };
  if (parts.cruise && !cruise_follows(content, parts)) content.cruise = code;
  if (parts.accel) fill(content.accel, *parts.accel);
  if (parts.decel) fill(*content.decel, *parts.decel);
  return content;
}

TableContent with_copy(TableContent content, std::size_t at) {
  const Parts parts = parts_of(content, {at, at});
  const auto copy = [](Codes& codes, std::size_t index) {
    codes.insert(codes.begin() + static_cast<std::ptrdiff_t>(index), codes[index]);
  };
  if (parts.accel) copy(content.accel, parts.accel->first);
  if (parts.decel) copy(*content.decel, parts.decel->first);
  return content;
}

TableContent without_codes(TableContent content, CodeRange range) {
  const Parts parts = parts_of(content, range);
  if (parts.cruise) content.cruise.reset();
  if (parts.accel) erase(content.accel, *parts.accel);
  if (parts.decel) erase(*content.decel, *parts.decel);
  return content;
}

std::string difference_text(const TableContent& before, const TableContent& after) {
  std::vector<std::string> parts{side_difference("accel", before.accel, after.accel)};
  if (before.decel && after.decel) {
    parts.push_back(side_difference("decel", *before.decel, *after.decel));
  } else if (before.decel || after.decel) {
    parts.emplace_back(after.decel ? "decel by itself" : "decel mirrors accel");
  }
  if (before.cruise != after.cruise) parts.emplace_back("cruise");
  std::string text;
  for (const std::string& part : parts) {
    if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
  }
  return text;
}

}  // namespace bushtab
