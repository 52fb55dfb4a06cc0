// Chopper current control of motor 0, as in "Stepper motor controller, part 3": every 25 us the
// windings of the present phase are switched on; the comparator of a pair of windings switches that
// pair off when its current has reached the reference, which a PWM of 8 bits makes. Windings 0 and
// 2 share a sense resistor and INT0, windings 1 and 3 another one and INT1: of a pair one is on at
// most. The edge of a comparator is awaited once a period.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA1284P_CHOPPER_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA1284P_CHOPPER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/core/currents.h"

#define CHOPPER_PERIOD_US 25u

// With interrupts off, once. The chopper is off: windings are on for as long as their phase is.
void chopper_init(void);

// As in bushd_port, for motor 0: the reference is its peak current in 256ths of 5110 mA, one of
// them at least.
void chopper_set(void* context, uint8_t motor, uint16_t ma, bool fast_decay);

// What the core keeps of its one motor.
extern bushd_mcu_currents chopper_currents[1];

#endif
