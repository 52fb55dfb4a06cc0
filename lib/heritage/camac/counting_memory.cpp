#include "heritage/camac/counting_memory.h"

#include <algorithm>

namespace bushd::camac {

void CountingMemory::set_address(std::uint32_t address) {
  address_ = address & static_cast<std::uint32_t>(bytes_.size() - 1);
}

bool CountingMemory::count_up() {
  set_address(address_ + 1);
  return address_ == 0;
}

void CountingMemory::load(std::span<const std::uint8_t> bytes) {
  std::ranges::copy(bytes.first(std::min(bytes.size(), bytes_.size())), bytes_.begin());
}

std::uint16_t CountingMemory::word_at(std::size_t address) const {
  return static_cast<std::uint16_t>(bytes_[address] | bytes_[address + 1] << 8);
}

void CountingMemory::set_word_at(std::size_t address, std::uint16_t word) {
  bytes_[address] = static_cast<std::uint8_t>(word);
  bytes_[address + 1] = static_cast<std::uint8_t>(word >> 8);
}

}  // namespace bushd::camac
