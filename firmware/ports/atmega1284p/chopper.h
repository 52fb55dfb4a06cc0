// Chopper current control of motor 0, as in "Stepper motor controller, part 3": every 25 us the
// windings of the present phase are switched on; the comparator of a pair of windings switches that
// pair off when its current has reached the reference, which a PWM of 8 bits makes. Windings 0 and 2
// share a sense resistor and INT0, windings 1 and 3 another one and INT1: of a pair one is on at
// most. The edge of a comparator is awaited once a period.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA1284P_CHOPPER_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA1284P_CHOPPER_H

#include <stdbool.h>
#include <stdint.h>

#define CHOPPER_PERIOD_US 25u

// With interrupts off, once. The chopper is off: windings are on for as long as their phase is.
void chopper_init(void);

// Peak current in 1/50 A, so that 255 is 5.1 A; 0: the chopper is off. For the main loop. O(1).
void chopper_set(uint8_t reference, bool fast_decay);

#endif
