// The core with few motors and little memory, so that an input reaches much of it; what it keeps
// comes back at once.
#include "fuzz/core_rig.h"

namespace bushd::fuzz {
namespace {

class PlainRig final : public CoreRig {
 public:
  PlainRig() : CoreRig({.motors = 4, .queue_ticks = 16, .codes = 24}) {}

  void reset() override {
    std::vector<std::vector<std::uint8_t>> kept;
    for (std::uint8_t i = 0; i < 255; ++i) {
      const bushd_mcu_nvm_region piece = bushd_mcu_nvm_region_at(&mcu_, i);
      if (piece.size == 0 && piece.at == nullptr) break;
      const auto* const from = static_cast<const std::uint8_t*>(piece.at);
      kept.emplace_back(from, from + piece.size);
    }
    boot();
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const bushd_mcu_nvm_region piece =
          bushd_mcu_nvm_region_at(&mcu_, static_cast<std::uint8_t>(i));
      BUSHD_REQUIRE(piece.size == kept[i].size());
      std::copy(kept[i].begin(), kept[i].end(), static_cast<std::uint8_t*>(piece.at));
    }
    bushd_mcu_nvm_restored(&mcu_);
    boot_is_over();
  }
};

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::PlainRig rig;
  bushd::fuzz::run(rig, {data, size});
  return 0;
}
