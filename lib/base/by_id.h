// A list that only its own kind of identifier can look into.
#pragma once

#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

namespace bushd {

// The first `size` identifiers.
template <class Id>
class Ids {
 public:
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Id;
    using difference_type = std::ptrdiff_t;
    using pointer = const Id*;
    using reference = Id;

    Iterator() = default;
    explicit Iterator(std::size_t value) : value_(value) {}
    Id operator*() const { return Id{value_}; }
    Iterator& operator++() {
      ++value_;
      return *this;
    }
    Iterator operator++(int) { return Iterator(value_++); }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    std::size_t value_ = 0;
  };

  explicit Ids(std::size_t size) : size_(size) {}
  Iterator begin() const { return Iterator(0); }
  Iterator end() const { return Iterator(size_); }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_;
};

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
  // In order; of the elements that there are now.
  Ids<Id> ids() const { return Ids<Id>(all_.size()); }

  auto begin() { return all_.begin(); }
  auto end() { return all_.end(); }
  auto begin() const { return all_.begin(); }
  auto end() const { return all_.end(); }

  friend bool operator==(const ById&, const ById&) = default;

 private:
  std::vector<T> all_;
};

}  // namespace bushd
