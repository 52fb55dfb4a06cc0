#include "api/number_window.h"

namespace bushd::api {

NumberWindow::Seen NumberWindow::look(std::int64_t number) const {
  if (!any_ || number > highest_) return Seen::kNew;
  const std::uint64_t below = below_highest(number);
  if (below >= kNumbers) return Seen::kTooOld;
  return seen_[below] ? Seen::kBefore : Seen::kNew;
}

NumberWindow::Seen NumberWindow::note(std::int64_t number) {
  const Seen seen = look(number);
  if (seen != Seen::kNew) return seen;
  if (!any_ || number > highest_) {
    // A shift by as many bits as there are, or more, leaves none.
    if (any_) {
      const std::uint64_t above =
          static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(highest_);
      seen_ = above < kNumbers ? seen_ << above : std::bitset<kNumbers>{};
    }
    any_ = true;
    highest_ = number;
  }
  seen_.set(below_highest(number));
  return Seen::kNew;
}

}  // namespace bushd::api
