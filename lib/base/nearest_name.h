// "Did you mean": the name that somebody may have wanted to write.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace bushd {

// How many letters have to be put in, left out, changed or exchanged with the next one, to make one
// word of the other; capitals do not count. (Optimal string alignment.)
inline std::size_t letters_apart(std::string_view a, std::string_view b) {
  const auto letter = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::size_t> before_last;
  std::vector<std::size_t> last(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::vector<std::size_t> row(b.size() + 1, i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = letter(a[i - 1]) == letter(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool exchanged = i > 1 && j > 1 && letter(a[i - 1]) == letter(b[j - 2]) &&
                             letter(a[i - 2]) == letter(b[j - 1]);
      if (exchanged) row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last = std::move(last);
    last = std::move(row);
  }
  return last[b.size()];
}

// " (did you mean \"theta\"?)" of the nearest one, the first of several; "" if none is near: one
// letter in three may be wrong, and two at most.
inline std::string did_you_mean(std::string_view written, const auto& names) {
  constexpr std::size_t kLongest = 64;  // of what is looked at: others are no slips
  if (written.empty() || written.size() > kLongest) return {};
  std::size_t allowed = std::min<std::size_t>(2, std::max<std::size_t>(written.size() / 3, 1));
  std::string nearest;
  for (const auto& name : names) {
    const std::string_view candidate(name);
    const std::size_t longer = std::max(candidate.size(), written.size());
    if (longer - std::min(candidate.size(), written.size()) > allowed) continue;
    const std::size_t apart = letters_apart(written, candidate);
    if (apart > allowed || candidate == written || (!nearest.empty() && apart == allowed)) continue;
    nearest = candidate;
    allowed = apart;
  }
  return nearest.empty() ? std::string() : " (did you mean \"" + nearest + "\"?)";
}

}  // namespace bushd
