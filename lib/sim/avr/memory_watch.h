// Looks at every access of an image for AVR to memory. The first one that must not be stops the
// CPU, and says which code made it:
// - a write outside of the objects that the writer's source file owns (AvrMemoryMap)
// - a write, or a stack, in the last kReserve bytes between variables and stack
// - a write to what is borrowed: the reply while the line sends it or is to send it, a frame while
//   rows of it are still to be taken
// - an address beyond RAM, and one of an I/O register through a pointer, but by inputs.c
// - an address of the EEPROM beyond its end
//
// What a function finds in its frame that it has not written is no address: a pointer never set is
// seen by the first use, whatever the stack held.
//
// From `main` on, until the next reset: what comes before has RAM to itself.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sim/avr/avr_chip.h"
#include "sim/avr/memory_map.h"

struct avr_t;

namespace bushd::sim {

class AvrMemoryWatch {
 public:
  static constexpr std::uint16_t kReserve = 512;

  // `image`: its ELF. The map is read once for each image.
  AvrMemoryWatch(avr_t* avr, const AvrChip& chip, const std::string& image,
                 const std::string& owners);
  ~AvrMemoryWatch();
  AvrMemoryWatch(const AvrMemoryWatch&) = delete;
  AvrMemoryWatch& operator=(const AvrMemoryWatch&) = delete;

  void reset() { in_main_ = false; }
  // What was done wrong, once.
  const std::optional<std::string>& violation() const { return violation_; }

  // Accesses that simavr makes, by the instruction at the program counter.
  void write(std::uint16_t address, std::uint8_t value);
  void read(std::uint16_t address);
  void stack_pointer(std::uint16_t address, std::uint8_t value);
  void eeprom_control(std::uint8_t value);

 private:
  struct Borrowed;  // where the image tells who has it
  std::uint16_t opcode() const;
  std::uint16_t stack_pointer() const;
  std::optional<std::uint32_t> library_caller() const;
  AvrMemoryMap::Unit writer() const;
  void check_stack(std::uint16_t address);
  void check_borrowed(AvrMemoryMap::Unit unit, std::uint16_t address);
  void violate(const std::string& what);

  avr_t* avr_;
  const AvrChip& chip_;
  std::shared_ptr<const AvrMemoryMap> map_;
  std::unique_ptr<const Borrowed> borrowed_;
  AvrMemoryMap::Unit main_;
  AvrMemoryMap::Unit inputs_;
  bool in_main_ = false;
  std::uint16_t frame_top_ = 0;  // the stack pointer before the frame that is being made
  std::optional<std::string> violation_;
};

}  // namespace bushd::sim
