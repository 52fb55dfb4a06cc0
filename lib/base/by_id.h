// A list that only its own kind of identifier can look into.
#pragma once

#include <cstddef>
#include <ranges>
#include <utility>
#include <vector>

namespace bushd {

template <class Id, class T>
class ById {
 public:
  T& operator[](Id id) { return all_[id.value]; }
  const T& operator[](Id id) const { return all_[id.value]; }

  // Returns the id of the new element.
  template <class... Args>
  Id add(Args&&... args) {
    all_.emplace_back(std::forward<Args>(args)...);
    return Id{all_.size() - 1};
  }
  std::size_t size() const { return all_.size(); }
  // In order.
  auto ids() const {
    return std::views::iota(std::size_t{0}, all_.size()) |
           std::views::transform([](std::size_t value) { return Id{value}; });
  }

  auto begin() { return all_.begin(); }
  auto end() { return all_.end(); }
  auto begin() const { return all_.begin(); }
  auto end() const { return all_.end(); }

  friend bool operator==(const ById&, const ById&) = default;

 private:
  std::vector<T> all_;
};

}  // namespace bushd
