// The margin of a start that one frame tells: time for this program and the port's driver. Starts
// that were missed make it four times as long; its half is forgotten every ten seconds.
#pragma once

#include <algorithm>
#include <cstdint>

namespace bushd::link {

class StartMargin {
 public:
  static constexpr std::int64_t kLeastUs = 2'000;
  static constexpr std::int64_t kMostUs = 100'000;

  std::int64_t margin_us(std::int64_t now_us) const {
    const std::int64_t halvings =
        std::clamp<std::int64_t>((now_us - since_us_) / kHalfLifeUs, 0, 32);
    return std::max(margin_us_ >> halvings, kLeastUs);
  }
  // All that is missed at one time counts as one.
  void missed(std::int64_t now_us) {
    if (now_us == since_us_) return;
    margin_us_ = std::min(4 * margin_us(now_us), kMostUs);
    since_us_ = now_us;
  }

 private:
  static constexpr std::int64_t kHalfLifeUs = 10'000'000;

  std::int64_t margin_us_ = kLeastUs;
  std::int64_t since_us_ = 0;
};

}  // namespace bushd::link
