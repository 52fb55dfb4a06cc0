// The core as the LM3S6965 has it: its configuration, and the port's own walk through what its
// flash keeps, many bytes at a time (lm3s6965/port.h).
//
// Promises checked beside those of core_rig.h: the walk touches no codes but those of tables; flash
// is written where it may be; what a reset finds whole is as long as its head says, and what the
// core had.
#include "fuzz/core_rig.h"
#include "fuzz/lm3s6965/port.h"
#include "fuzz/poison.h"

namespace bushd::fuzz {
namespace {

constexpr unsigned kPollsPerTick = 8;
constexpr unsigned kPollsPerRestTick = 64;
constexpr unsigned kMostRestTicks = 1300;

class Lm3s6965Rig final : public CoreRig {
 public:
  Lm3s6965Rig()
      : CoreRig({.motors = BUSHD_MOTORS_PER_MCU,
                 .queue_ticks = 512,
                 .codes = 12288,
                 .min_tick_ns = 250'000,
                 .pulse_ns = -5000}) {
    host_blank_flash();
    host_reset();
    nvm_find();
  }

  void pass() override {
    CoreRig::pass();
    poll(kPollsPerTick);
  }

  void work(unsigned pieces) override { poll(pieces); }

  void reset() override {
    host_reset();
    const nvm_found found = nvm_find();
    boot();
    if (found == NVM_WHOLE) {
      nvm_load(&mcu_);
      check_restored(host_nvm_size(), host_nvm_crc());
    }
    boot_is_over();
  }

  // Long enough to write what is kept.
  void rest(unsigned ticks) {
    for (; ticks > 0 && rested_ < kMostRestTicks; --ticks, ++rested_) {
      pass();
      poll(kPollsPerRestTick);
    }
  }

 private:
  void poll(unsigned times) {
    const bool moves = mcu_.state == BUSHD_STATE_RUN ||
                       (mcu_.slot_buffer[0].active | mcu_.slot_buffer[1].active) != 0;
    if (moves || bushd_mcu_wants_samples(&mcu_)) return;
    const Poisoned free_codes(codes_.data() + mcu_.tables.codes_used,
                              (codes_.size() - mcu_.tables.codes_used) * sizeof codes_[0]);
    for (; times > 0; --times) {
      nvm_poll(&mcu_);
      check_walk(host_walk());
    }
  }

  unsigned rested_ = 0;
};

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::Lm3s6965Rig rig;
  bushd::fuzz::run(
      rig, {data, size},
      {[](bushd::fuzz::Input& input) { input.u8(); },  // a pace: that of firmware_core_avr
       [&](bushd::fuzz::Input& input) { rig.rest(bushd::fuzz::rest_ticks(input)); }});
  return 0;
}
