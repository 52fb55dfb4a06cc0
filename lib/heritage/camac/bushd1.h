// BUSHD-1: a beam shutter between two limit switches.
//
// Memory of 256 bytes:
//
//     0         number of steps, 1..126
//     2, 3      adjustable delay from the reactor start, the low byte first
//     4..255    126 delay codes of two bytes each
//
// in units of 50 us; 0 counts as 1, more than 30000 (1.5 s) as 30000.
// Control register: enables of the requests 1 right limit, 2 left limit, 3 step done, 5 failure,
// 6 address overflow; 4 is the direction, 1: left; 7, 8 the mode (kAutomatic, kSecondMode).
// Request register: 1 right limit reached, 2 left limit reached, 3 step done, 4 step not done in
// time, 5 automatic travel failed, 6 address overflow; 7, 8 the levels of the right and left limit.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "heritage/camac/motion_module.h"
#include "heritage/camac/shutter.h"

namespace bushd::camac {

class Bushd1 final : public MotionModule {
 public:
  static constexpr std::size_t kMemoryBytes = 256;
  static constexpr std::size_t kDelayAddress = 2;
  static constexpr std::size_t kFirstCode = 4;
  static constexpr int kMostSteps = 126;
  static constexpr std::uint16_t kMostDelay = 30'000;

  // The report writes modes as two digits for bits 7 and 8, taken to be in this order: 10 is
  // automatic, 01 a single step with the sensor, 11 automatic and synchronous.
  static constexpr int kAutomatic = 7;
  static constexpr int kSecondMode = 8;

  // `shutter` outlives the module.
  explicit Bushd1(Shutter& shutter, AdjustableDelay adjusts = AdjustableDelay::kReturn)
      : MotionModule(kMemoryBytes), shutter_(shutter), adjusts_(adjusts) {}

  bool lam() const override;

  // The inputs, whenever one has changed.
  void limits(bool right, bool left);
  // A single step is made, with the sensor if there is one; or was not seen by it in time.
  // What comes while nothing of its kind moves is ignored, here and below.
  void step_done();
  void step_not_done();
  // A step of a run is made; the run has ended, after its last step.
  void run_step_done();
  void run_ends();
  // The motor stands for good: it was stopped, or cannot go on.
  void stands();

  bool is_moving() const { return motion_.has_value(); }
  // A travel of so many steps that was begun with this control register goes on, in its first run
  // as far as this module, which has lost its registers since, is told. Precondition: none is made.
  void goes_on(std::uint8_t control, int steps);
  bool goes_left() const { return motion_ && motion_->left; }

 private:
  // From F26A0 until the motor stands; between two travels as well.
  struct Motion {
    bool automatic = false;
    bool left = false;  // the run, or step, that is made now
    bool synchronous = false;
    bool returns = false;
    int steps = 0;
    int made = 0;  // of this run
    bool stopping = false;
  };

  std::uint32_t request_register() const override;
  void clear_lam() override { requests_ = 0; }
  void clear_requests() override { requests_ = 0; }
  void address_overflows() override;
  void start() override;
  void stop() override;

  void start_step(bool left);
  void start_travel(bool left);
  std::uint16_t delay_at(std::size_t address) const;
  void raise(int request) { requests_ |= bit(request); }
  void end_step(int request);
  void fail();
  bool at_limit(bool left) const { return left ? left_limit_ : right_limit_; }
  bool runs() const { return motion_ && (!motion_->automatic || motion_->made > 0); }

  Shutter& shutter_;
  const AdjustableDelay adjusts_;
  std::uint32_t requests_ = 0;  // bits 1..6
  bool right_limit_ = false;
  bool left_limit_ = false;
  std::optional<Motion> motion_;
};

// Whether delays fall and then rise, as those of a run that accelerates and then slows down.
bool rise_and_fall_once(std::span<const std::uint16_t> delays);

}  // namespace bushd::camac
