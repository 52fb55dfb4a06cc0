// What BUSHD-1 and BUSHD-2 have in common (JINR P10-85-635, 1985): their eleven commands, the
// memory of motion programs and the control register.
//
//     F0A0   read memory, address + 1   Q = not L     F8A0   test L                  Q = L
//     F0A1   read address register      Q = 1         F10A0  clear L                 Q = 0
//     F0A2   read control register      Q = 1         F16A0  write memory, address + 1   Q = not L
//     F0A3   read request register      Q = 1         F16A1  write address register  Q = 1
//     F24A0  forbid control             Q = 0         F16A2  write control register  Q = 1
//     F26A0  permit motion              Q = 0
//
// All other commands answer X = 0, Q = 0. Bits of data that a register does not have are ignored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "heritage/camac/counting_memory.h"
#include "heritage/camac/module.h"

namespace bushd::camac {

class MotionModule : public Module {
 public:
  Response cycle(const Command& command) final;
  void initialise() final;
  void clear() final { clear_requests(); }
  void set_inhibit(bool inhibited) final { inhibited_ = inhibited; }

  // What is kept over power cuts: Z leaves it as it is, too.
  std::span<const std::uint8_t> memory() const { return memory_.bytes(); }
  void load_memory(std::span<const std::uint8_t> bytes) { memory_.load(bytes); }
  std::uint8_t control() const { return control_; }

 protected:
  explicit MotionModule(std::size_t memory_bytes) : memory_(memory_bytes) {}

  // Bits are numbered from 1, as in the report.
  static constexpr std::uint32_t bit(int number) { return 1U << (number - 1); }
  bool is_enabled(int control_bit) const { return (control_ & bit(control_bit)) != 0; }
  void load_control(std::uint8_t bits) { control_ = bits; }
  const CountingMemory& programs() const { return memory_; }
  CountingMemory& programs() { return memory_; }

 private:
  virtual std::uint32_t request_register() const = 0;
  virtual void clear_lam() = 0;       // F10A0
  virtual void clear_requests() = 0;  // Z, C
  virtual void address_overflows() = 0;
  virtual void start() = 0;  // F26A0; without effect while it moves
  virtual void stop() = 0;   // F24A0, Z

  Response read(int register_number);
  Response write(int register_number, std::uint32_t data);
  Response control_cycle(int function);
  void next_address();

  CountingMemory memory_;
  std::uint8_t control_ = 0;
  bool inhibited_ = false;
};

}  // namespace bushd::camac
