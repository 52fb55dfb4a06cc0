// Which of a client's request numbers have been seen: exact for the newest 1024, whatever their
// order, and "too old" below. Takes 144 bytes for ever.
#pragma once

#include <bitset>
#include <cstdint>

namespace bushd::api {

class NumberWindow {
 public:
  static constexpr std::uint64_t kNumbers = 1024;

  enum class Seen {
    kNew,
    kBefore,
    kTooOld  // kNumbers or more below the highest: it may have been seen or not
  };

  Seen look(std::int64_t number) const;
  // The same, and the number has been seen from now on.
  Seen note(std::int64_t number);

  // It is one of the newest that are told apart.
  bool holds(std::int64_t number) const {
    return any_ && number <= highest_ && below_highest(number) < kNumbers;
  }

 private:
  // In unsigned arithmetic, so that no distance between two numbers overflows.
  std::uint64_t below_highest(std::int64_t number) const {
    return static_cast<std::uint64_t>(highest_) - static_cast<std::uint64_t>(number);
  }

  bool any_ = false;
  std::int64_t highest_ = 0;
  std::bitset<kNumbers> seen_{};  // bit i: highest_ - i
};

}  // namespace bushd::api
