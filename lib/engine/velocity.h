// The velocity loop of "Stepper motor controller, part 3": a motor that follows a wanted speed with
// constant acceleration, in whole numbers.
//
// VC, the speed now, and VR, the wanted one, are signed, in 1/64 step/s. Every 15.625 ms, which are
// 625 intervals of 25 us, VC moves towards VR by A and is no more than VR then. So it goes through
// 0 by itself where their signs differ. The period of steps, in intervals, is
//
//     T = floor(2560000 / max(|VC|, VMIN))
//
// and takes effect when the one that is running has ended. With VC = 0 no step is made.
#ifndef BUSHD_ENGINE_VELOCITY_H
#define BUSHD_ENGINE_VELOCITY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_VELOCITY_INTERVAL_NS UINT32_C(25000)
#define BUSHD_VELOCITY_UPDATE_INTERVALS 625u  // 1/64 s
#define BUSHD_VELOCITY_PERIOD_OF_ONE 2560000u
// The least VMIN, since T has 16 bits, and the most of all, since the variables have 24.
#define BUSHD_VELOCITY_LEAST 40
#define BUSHD_VELOCITY_MOST 0x7FFFFF

typedef struct bushd_velocity {
  // Settings, in 1/64 step/s.
  int32_t wanted;  // VR, |VR| <= BUSHD_VELOCITY_MOST
  int32_t change;  // A, 1..BUSHD_VELOCITY_MOST: of the speed in 1/64 s, which is steps/s^2
  int32_t least;   // VMIN, BUSHD_VELOCITY_LEAST..BUSHD_VELOCITY_MOST
  // State.
  int32_t now;         // VC
  uint16_t period;     // T
  uint16_t step_left;  // intervals of the running period (STCNT)
  uint16_t update_left;
} bushd_velocity;

// T at this speed, of either sign.
uint16_t bushd_velocity_period(int32_t speed, int32_t least);
// At rest. Preconditions: the ranges above.
void bushd_velocity_init(bushd_velocity* velocity, int32_t change, int32_t least);

// VC and T, at the end of BUSHD_VELOCITY_UPDATE_INTERVALS. One division.
void bushd_velocity_update(bushd_velocity* velocity);

// Intervals before the next one at whose end a step may be made, or VC changes. O(1).
static inline uint16_t bushd_velocity_idle(const bushd_velocity* velocity) {
  const uint16_t left =
      velocity->step_left < velocity->update_left ? velocity->step_left : velocity->update_left;
  return (uint16_t)(left - 1u);
}
// Lets as many pass. Precondition: intervals <= bushd_velocity_idle.
static inline void bushd_velocity_skip(bushd_velocity* velocity, uint16_t intervals) {
  velocity->step_left = (uint16_t)(velocity->step_left - intervals);
  velocity->update_left = (uint16_t)(velocity->update_left - intervals);
}
// The next interval of 25 us: +1 or -1 if a step is made at its end, else 0. O(1), a division in
// one interval of 625.
static inline int8_t bushd_velocity_interval(bushd_velocity* velocity) {
  int8_t step = 0;
  if (--velocity->step_left == 0) {
    velocity->step_left = velocity->period;
    step = (int8_t)((velocity->now > 0) - (velocity->now < 0));
  }
  if (--velocity->update_left == 0) {
    velocity->update_left = BUSHD_VELOCITY_UPDATE_INTERVALS;
    bushd_velocity_update(velocity);
  }
  return step;
}

#ifdef __cplusplus
}
#endif
#endif
