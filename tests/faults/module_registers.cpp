#include "module_registers.h"

#include <fmt/core.h>

#include <algorithm>

#include "times.h"

namespace bushfaults {

// What was written so long before a daemon ended is on the disk: a disk fault lasts five seconds,
// and a power cut comes at once.
constexpr bushd::sim::TimeNs kMemoryOnDiskNs = 15 * kSecond;

void ModuleRegisters::daemon_started(TimeNs now_ns, bool kept) {
  const bool on_disk = kept && now_ns - written_ns_ >= kMemoryOnDiskNs;
  if (!on_disk) {
    std::ranges::fill(memory_, kept ? std::nullopt : std::optional<std::uint8_t>(0));
  }
  initialise();
}

Wrong ModuleRegisters::memory_cycle(TimeNs now_ns, const Naf& naf, const Response& response) {
  std::optional<std::uint8_t>& byte = memory_[address_];
  const std::size_t address = address_;
  count_up();
  if (naf.function == kWrite) {
    byte = static_cast<std::uint8_t>(naf.data);
    written_ns_ = now_ns;
  } else if (byte && response.data != *byte) {
    return fmt::format("address {} holds {}, and {} was written", address, response.data, *byte);
  } else {
    byte = static_cast<std::uint8_t>(response.data);
  }
  return std::nullopt;
}

Wrong ModuleRegisters::read(const Naf& naf, const Response& response) const {
  const std::uint32_t expected =
      naf.subaddress == 1 ? static_cast<std::uint32_t>(address_) : control_;
  if (response.data == expected) return std::nullopt;
  return fmt::format("it holds {}, not {}", response.data, expected);
}

void ModuleRegisters::write(const Naf& naf) {
  if (naf.subaddress == 1) address_ = naf.data % memory_.size();
  if (naf.subaddress == 2) control_ = naf.data & 0xFF;
}

}  // namespace bushfaults
