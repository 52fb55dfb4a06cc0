// A memory of bytes behind an address register that counts up with every access.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace bushd::camac {

class CountingMemory {
 public:
  // Precondition: a power of 2, at most 65536.
  explicit CountingMemory(std::size_t bytes) : bytes_(bytes, 0) {}

  std::uint32_t address() const { return address_; }
  // Bits that the register does not have are ignored.
  void set_address(std::uint32_t address);

  // The byte at the address register.
  std::uint8_t read() const { return bytes_[address_]; }
  void write(std::uint8_t byte) { bytes_[address_] = byte; }
  // The register counts up. Returns whether it overflows: from the last address to 0.
  bool count_up();

  std::size_t size() const { return bytes_.size(); }
  std::span<const std::uint8_t> bytes() const { return bytes_; }
  // Loads all of it; what is more than the memory is ignored, what is less leaves the rest as it
  // is.
  void load(std::span<const std::uint8_t> bytes);
  // Two bytes, the low one at the lower address. Precondition: address + 1 < size().
  std::uint16_t word_at(std::size_t address) const;
  void set_word_at(std::size_t address, std::uint16_t word);

 private:
  std::vector<std::uint8_t> bytes_;
  std::uint32_t address_ = 0;
};

}  // namespace bushd::camac
