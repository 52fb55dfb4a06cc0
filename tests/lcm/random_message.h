// Random messages of any type, by the fields that it declares.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "lcm/wire.h"

namespace bushd::test {

using Random = std::mt19937_64;

inline std::size_t below(Random& random, std::size_t limit) {
  return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
}

// Words that some field knows, ratios, and texts of anything but NUL.
inline std::string text(Random& random) {
  static const std::array<std::string, 16> kKnown = {
      "",      "done",  "reached", "link", "rest", "arming", "home", "known",
      "stale", "READY", "OFFLINE", "ramp", "both", "320",    "1/3",  "positive"};
  if (below(random, 2) == 0) return kKnown.at(below(random, kKnown.size()));
  std::string out(below(random, 24), ' ');
  for (char& c : out) c = static_cast<char>(1 + below(random, 255));
  return out;
}

// Sets all fields. What means nothing is tried again; what is no message in the end, `good` says.
class RandomFields {
 public:
  explicit RandomFields(Random& random) : random_(random) {}

  void operator()(const fields::Field& /*field*/, auto& value) { make(value); }
  void operator()(const fields::Field& /*field*/, auto& value, const auto& form) {
    take(value, form);
  }
  template <class T, class Form = fields::Same>
  void list(const fields::Field& /*count*/, const fields::Field& /*field*/, std::vector<T>& list,
            const Form& form = {}) {
    list.resize(below(random_, 4));
    for (T& element : list) take(element, form);
  }
  void set(auto& member, auto value) { member = std::move(value); }
  void require(bool condition) { good = good && condition; }

  static constexpr bool kReads = true;
  bool good = true;

 private:
  template <class T, class Form>
  void take(T& value, const Form& form) {
    lcm::wire::Told<Form, T> told{};
    do make(told);
    while (!form.taken(told, value));
  }
  template <class T>
  void make(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = below(random_, 2) == 0;
    } else if constexpr (std::is_same_v<T, double>) {
      value = static_cast<double>(static_cast<std::int32_t>(random_())) / 4096;
    } else if constexpr (std::is_same_v<T, std::int16_t>) {
      value = static_cast<T>(below(random_, 3));  // outputs
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<T>(below(random_, 2) == 0 ? below(random_, 5) : random_());
    } else if constexpr (std::is_same_v<T, std::string>) {
      value = text(random_);
    } else {
      const bool good_before = good;
      do {
        good = true;
        value = T{};
        T::fields(value, *this);
      } while (!good);
      good = good_before;
    }
  }

  Random& random_;
};

template <class T>
T random_message(Random& random) {
  for (;;) {
    T message{};
    RandomFields fields(random);
    T::fields(message, fields);
    if (fields.good) return message;
  }
}

}  // namespace bushd::test
