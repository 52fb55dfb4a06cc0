// What both CAMAC modules are to programs: a memory behind an address register that counts up, and
// a control register.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/snapshot.h"
#include "sim/edge.h"
#include "words/camac.h"

namespace bushfaults {

using bushd::camac::Naf;
using bushd::camac::Response;
using bushd::sim::TimeNs;
using Wrong = std::optional<std::string>;  // what is, if something is

enum ModuleFunction {
  kRead = 0,
  kTestLam = 8,
  kClearLam = 10,
  kWrite = 16,
  kForbid = 24,
  kPermit = 26
};

class ModuleRegisters {
 public:
  explicit ModuleRegisters(std::size_t bytes) : memory_(bytes, 0) {}

  // `kept`: it has what an earlier daemon has put on the disk.
  void daemon_started(TimeNs now_ns, bool kept);
  void initialise() { address_ = control_ = 0; }
  static bool is_memory(const Naf& naf) {
    return naf.subaddress == 0 && (naf.function == kRead || naf.function == kWrite);
  }
  // Precondition: is_memory(naf).
  Wrong memory_cycle(TimeNs now_ns, const Naf& naf, const Response& response);
  // A read of the address or the control register.
  Wrong read(const Naf& naf, const Response& response) const;
  void write(const Naf& naf);
  // The byte at the address changes by itself.
  void forget_byte() { memory_[address_].reset(); }
  void count_up() { address_ = (address_ + 1) % memory_.size(); }

  std::size_t address() const { return address_; }
  std::uint32_t control() const { return control_; }
  // What is not known counts as 0.
  std::uint8_t operator[](std::size_t at) const { return memory_[at].value_or(0); }

 private:
  std::vector<std::optional<std::uint8_t>> memory_;
  TimeNs written_ns_ = 0;
  std::size_t address_ = 0;
  std::uint32_t control_ = 0;
};

}  // namespace bushfaults
