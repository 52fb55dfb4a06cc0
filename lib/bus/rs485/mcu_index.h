// MCUs of one bus, as its master counts them.
#pragma once

#include <compare>
#include <cstddef>
#include <utility>
#include <vector>

namespace bushd::link {

// The place of an MCU in BusSetup::mcus. Not its address on the bus, nor its place among the MCUs
// of all buses: a type of its own.
struct McuIndex {
  std::size_t value = 0;
  auto operator<=>(const McuIndex&) const = default;
};

// McuIndex{0}, McuIndex{1}, ...
class McuIndices {
 public:
  class Iterator {
   public:
    explicit Iterator(std::size_t at) : at_(at) {}
    McuIndex operator*() const { return McuIndex{at_}; }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    bool operator==(const Iterator&) const = default;

   private:
    std::size_t at_;
  };

  explicit McuIndices(std::size_t count) : count_(count) {}
  Iterator begin() const { return Iterator(0); }
  Iterator end() const { return Iterator(count_); }

 private:
  std::size_t count_;
};

// One item for each MCU of a bus.
template <class T>
class PerMcu {
 public:
  PerMcu() = default;
  explicit PerMcu(std::size_t count) : items_(count) {}

  void push_back(T item) { items_.push_back(std::move(item)); }
  T& operator[](McuIndex mcu) { return items_[mcu.value]; }
  const T& operator[](McuIndex mcu) const { return items_[mcu.value]; }
  std::size_t size() const { return items_.size(); }
  McuIndices indices() const { return McuIndices(items_.size()); }
  auto begin() { return items_.begin(); }
  auto end() { return items_.end(); }
  auto begin() const { return items_.begin(); }
  auto end() const { return items_.end(); }

 private:
  std::vector<T> items_;
};

}  // namespace bushd::link
