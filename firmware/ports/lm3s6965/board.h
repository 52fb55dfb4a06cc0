// LM3S6965 at 50 MHz: which pin is what. docs/firmware.md has the same as a table, with the wiring.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_BOARD_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/ports/lm3s6965/registers.h"

#define CYCLES_PER_US 50u
#define CYCLE_NS 20u

// Whole ports: motors 0..7 and 8..15.
#define STEP_LOW GPIO_DATA(GPIO_B, 0xFFu)
#define STEP_HIGH GPIO_DATA(GPIO_D, 0xFFu)

// There are too few pins for DIR and inputs of 16 motors: they go through shift registers, two
// 74HC595 and two 74HC165, that share a clock.
#define SHIFT_CLOCK GPIO_DATA(GPIO_E, 1u << 0)
#define DIR_DATA GPIO_DATA(GPIO_E, 1u << 1)
#define DIR_LATCH GPIO_DATA(GPIO_E, 1u << 2)
#define INPUT_LOAD GPIO_DATA(GPIO_E, 1u << 3)  // low: the 165 take over their inputs
#define INPUT_DATA GPIO_DATA(GPIO_C, 1u << 4)

#define COMMON_DIR GPIO_DATA(GPIO_F, 1u << 0)
#define COMPARE_PIN GPIO_DATA(GPIO_F, 1u << 1)

// In the order of BUSHD_INPUT_*.
#define SYSTEM_INPUTS GPIO_DATA(GPIO_A, 0xF0u)
#define SYSTEM_INPUTS_SHIFT 4
// Both are of port A; no others interrupt.
#define EMERGENCY_PIN (1u << 4)
#define TRIGGER_PIN (1u << 7)

#define ENABLE GPIO_DATA(GPIO_A, 1u << 2)
// Driver-enable of the RS-485 transceiver, and its /RE: it does not hear itself.
#define DRIVER_ENABLE GPIO_DATA(GPIO_A, 1u << 3)

#define ALL_PINS 0xFFu  // for the masked addresses above: those of other pins are not touched

// Clock and pins, all outputs low but EN, STEP and the common DIR: they wait for who knows where
// they rest (board_drive).
void board_init(void);
// From now on these have the levels that are written to them. What was written before may have been
// lost.
void board_drive(void);

// Shifts the levels of DIR to where a pulse on DIR_LATCH brings them out.
void board_shift_directions(uint16_t levels);
static inline void board_latch_directions(void) {
  DIR_LATCH = ALL_PINS;
  DIR_LATCH = 0;
}

// What the inputs of the motors are now, levels. What was shifted for DIR is lost.
uint16_t board_read_inputs(void);

// Behind them comes the ground at the end of the registers. False if it does not: their data line
// is stuck, and no switch would ever be seen. What was shifted for DIR is lost.
bool board_test_inputs(void);

// The supply current as ADC 0 reads it, 0..1023, the mean of 4 us. A conversion that has been begun
// is to be read before the next one.
static inline void board_begin_current(void) {
  ADC_PSSI = ADC_SEQUENCER_3;
}
static inline bool board_has_current(void) {
  return (ADC_SSFSTAT3 & ADC_SSFSTAT_EMPTY) == 0;
}
// The last one that is over.
uint16_t board_read_current(void);

// From now on the MCU is reset if watchdog_reset is not called within 60 to 120 ms.
void watchdog_start(void);
static inline void watchdog_reset(void) {
  WDT_ICR = 1;
}

#endif
