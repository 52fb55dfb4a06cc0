// The whole MCU program on a port that only records, for fuzz targets. What ports do with the bytes
// of the line, with answers and with what is kept over resets differs: targets derive from this.
//
// Promises checked: counters are the sum of the STEP pulses, whatever comes, and are set at rest
// only, or where homing ends; no pulse without EN; corrections of the clock within their bounds;
// every transmission is one valid frame; after all of it the MCU still identifies itself and
// reports those counters. What it keeps over a reset comes back.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "fuzz/core_programme.h"

namespace bushd::fuzz {

struct CoreConfiguration {
  std::uint8_t motors;
  std::uint16_t queue_ticks;
  std::uint16_t codes;
  std::uint32_t min_tick_ns = BUSHD_MIN_TICK_NS;
  std::int32_t pulse_ns = 0;
  std::uint32_t disabled_capabilities = 0;  // BUSHD_CAN_*
  bool in_pieces = false;
};

class CoreRig : public Programmed {
 public:
  explicit CoreRig(const CoreConfiguration& configuration);

  Sight sight() override;
  std::uint32_t table_crc(std::uint8_t bank) override;
  void begin() override;
  void pass() override;
  // As it is here, the core gets bytes at once.
  void feed(Bytes bytes) override;
  void frame(std::uint8_t address, std::uint8_t type, Bytes payload,
             std::uint8_t later = 0) override;
  void set_time(std::uint16_t share) override { share_ = share; }
  void set_pins(std::uint16_t motors, std::uint8_t system, std::uint16_t current) override;
  void trigger(std::int16_t share) override;
  void sample(std::uint16_t share, std::uint16_t current) override;
  void work(unsigned pieces) override;
  // The queue runs out, and motors begin to run down; then it answers.
  void check_answers() override;

  const bushd_mcu& core() const { return mcu_; }

 protected:
  std::uint8_t motors() const { return configuration_.motors; }
  // Where answers are made; here, in memory of their own.
  virtual std::uint8_t* reply() { return reply_.data(); }
  virtual void transmit(Bytes wire, std::uint32_t delay_ns);
  // All that has come is worked off, and answers that are due are sent.
  virtual void finish() {}

  void boot();          // again and again
  void boot_is_over();  // what was kept is there again
  // What must hold when bytes have been handed over to the core.
  void check_after_frames();
  void check_transmission(Bytes wire);
  // A walk through what is kept (bushd_mcu_nvm_scan_next) stands within it.
  void check_walk(const bushd_mcu_nvm_scan& walk);
  // What was kept is there again, all of it.
  void check_restored(std::size_t size, std::uint32_t crc);
  std::uint32_t time_in_tick_ns() const {
    return static_cast<std::uint32_t>(std::uint64_t{tick_ns_} * share_ >> 16);
  }

  const CoreConfiguration configuration_;
  // On the heap, each by itself: there a sanitizer sees what lies beside them.
  std::vector<std::int16_t> queue_;
  std::vector<std::uint16_t> codes_;
  std::vector<bushd_mcu_scratch> scratch_ = std::vector<bushd_mcu_scratch>(1);
  std::array<bushd_mcu_currents, BUSHD_MAX_CURRENT_MOTORS> currents_{};
  std::array<bushd_mcu_velocity, BUSHD_MAX_VELOCITY_MOTORS> velocity_{};
  std::array<std::uint8_t, 128> program_bytes_{};
  bushd_mcu_program program_{};
  std::vector<std::uint8_t> reply_ = std::vector<std::uint8_t>(BUSHD_MCU_MAX_REPLY);
  bushd_mcu mcu_{};
  bushd_report report_{};

 private:
  struct Pins {
    bushd_inputs inputs;
    std::uint16_t current;
  };

  // From here on exactly one answer is due; returns it.
  bushd_frame ask(std::uint8_t address, std::uint8_t type, Bytes payload);
  // What reports have told, with one that is asked for now.
  const bushd_report& next_report();
  // Counters may be set to anything and then wrap.
  std::uint32_t position(std::size_t m) const {
    return static_cast<std::uint32_t>(mcu_.motor[m].position_steps);
  }
  std::uint16_t current() const { return pins_ ? pins_->current : pins().motors; }
  bushd_inputs pins() const;
  void take_home();
  void adjusted(std::int32_t ns) const;
  void count_pulses(const bushd_slot_buffer& slot_buffer);
  void check_state() const;
  void check_motor(const bushd_mcu_motor& motor) const;

  bushd_receiver listener_{};
  bushd_frame answer_{};
  int answers_ = 0;
  std::uint16_t boot_number_ = 4660;
  std::uint8_t next_sequence_ = 0;
  bool enable_at_boot_ = false;
  bushd_edge awaited_ = BUSHD_EDGE_NONE;
  std::optional<Pins> pins_;
  std::uint8_t address_ = kAddress;
  bool enabled_ = true;
  bool prepared_enabled_ = true;  // when the tick that comes next was prepared
  std::uint32_t tick_ns_ = 0;
  std::uint16_t share_ = 0;
  using Counters = std::array<std::uint32_t, BUSHD_MOTORS_PER_MCU>;
  Counters begun_{};    // at the beginning of the present tick
  Counters counted_{};  // at its end
};

}  // namespace bushd::fuzz
