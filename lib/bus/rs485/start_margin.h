// How much time a frame that is enough to begin motions gets beyond what the line takes for it:
// what this program and the port's driver may take. It follows what is seen. Each start that was
// missed asks for four times as much; half of that is forgotten every ten seconds.
#pragma once

#include <algorithm>
#include <cstdint>

namespace bushd::link {

class StartMargin {
 public:
  static constexpr std::int64_t kLeastUs = 2'000;
  static constexpr std::int64_t kMostUs = 100'000;

  std::int64_t at(std::int64_t now_us) const {
    const std::int64_t halvings = std::clamp<std::int64_t>((now_us - since_us_) / kHalvesUs, 0, 32);
    return std::max(margin_us_ >> halvings, kLeastUs);
  }
  void missed(std::int64_t now_us) {
    margin_us_ = std::min(4 * at(now_us), kMostUs);
    since_us_ = now_us;
  }

 private:
  static constexpr std::int64_t kHalvesUs = 10'000'000;

  std::int64_t margin_us_ = kLeastUs;
  std::int64_t since_us_ = 0;
};

}  // namespace bushd::link
