// ATmega2560 at 16 MHz: which pin is what. docs/firmware.md has the same as a table, with the
// wiring.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_BOARD_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_BOARD_H

#include <avr/io.h>

#define CYCLES_PER_US 16u

// Whole ports, so that the pulses of a slot begin together: motors 0..7 in _LOW, 8..15 in _HIGH.
// Those of STEP lie in the I/O space, where a write takes one cycle.
#define STEP_LOW PORTA
#define STEP_HIGH PORTC
#define DIR_LOW PORTL
#define DIR_HIGH PORTB
#define COMMON_DIR_PORT PORTF
#define COMMON_DIR_PIN PINF
#define COMMON_DIR_BIT 2
// Inputs, with pull-ups; closed to ground: active.
#define INPUT_LOW PINK
#define INPUT_HIGH PINJ
// Those that are no motor's. The trigger's and the emergency input have interrupts of their own,
// INT0 and INT1.
#define INPUT_SYSTEM PIND
#define TRIGGER_BIT 0
#define EMERGENCY_BIT 1
#define FORWARD_BIT 2
#define REVERSE_BIT 3
#define SYSTEM_BITS (1 << TRIGGER_BIT | 1 << EMERGENCY_BIT | 1 << FORWARD_BIT | 1 << REVERSE_BIT)
// The current sensor is at ADC0.

// Where STEP rests, for the interrupts: in registers of timer 2, which stands still.
#define REST_LOW OCR2A
#define REST_HIGH OCR2B

// Output of the position compare pulse.
#define COMPARE_PORT PORTG
#define COMPARE_BIT 5
#define EN_PORT PORTH
#define EN_PIN PINH  // a 1 written to it turns the output over
#define EN_BIT 3
// Driver-enable of the RS-485 transceiver, and its /RE: it does not hear itself.
#define DE_PORT PORTE
#define DE_BIT 4

// What main.c makes of it. A frame of TABLE_TICKS stands for more ticks than it could make in one.
#define BOARD_MOTORS 16u
#define BOARD_DISABLED BUSHD_CAN_TABLE_TICKS
#define BOARD_QUEUE_TICKS 64u
#define BOARD_TABLE_CODES 952u  // four tables of 238 codes
// No current of windings is controlled.
#define BOARD_CURRENT_MOTORS 0u
#define BOARD_CURRENTS NULL
#define BOARD_SET_CURRENT NULL
#define BOARD_VELOCITY_MOTORS 0u
// UART 2 is the line of a keypad.
#define BOARD_KEYPAD 1
// Shorter, slots would not hold their interrupts.
#define BOARD_MIN_TICK_NS 900000u

// Timer 1, of the slots.
#define BOARD_SLOT_FLAGS (1 << OCF1A | 1 << OCF1B | 1 << OCF1C)
#define BOARD_SLOT_INTERRUPTS (1 << OCIE1A | 1 << OCIE1B | 1 << OCIE1C)

// Interrupt of the trigger input.
#define TRIGGER_VECTOR INT0_vect
#define TRIGGER_INT INT0
#define TRIGGER_FLAG INTF0
#define TRIGGER_FALLING (1 << ISC01)
#define TRIGGER_RISING (1 << ISC01 | 1 << ISC00)
// Edges of other interrupts.
#define BOARD_EDGES (EICRA & EMERGENCY_EDGES)

// Interrupt of the emergency input.
#define EMERGENCY_VECTOR INT1_vect
#define EMERGENCY_INT INT1
#define EMERGENCY_FLAG INTF1
#define EMERGENCY_FALLING (1 << ISC11)
#define EMERGENCY_EDGES (1 << ISC11 | 1 << ISC10)  // both bits: rising

// Timer of clock.h, and of its bytes.
#define CLOCK_COUNT TCNT5
#define CLOCK_COUNT_LOW TCNT5L
#define CLOCK_COUNT_HIGH TCNT5H

// Where the next byte to be sent lies: in registers of timer 0, which is at rest.
#define LINE_SENDING_LOW OCR0A
#define LINE_SENDING_HIGH OCR0B

// What the line waits by, timer 3: cycles of a count, and its interrupts without compare A.
#define LINE_COUNT_CYCLES 1u
#define LINE_OTHER_INTERRUPTS 0u

#ifndef __ASSEMBLER__

#include <stdbool.h>
#include <stdint.h>

static inline uint16_t board_rest(void) {
  return (uint16_t)(REST_LOW | REST_HIGH << 8);
}
// With interrupts off.
static inline void board_set_rest(uint16_t step) {
  STEP_LOW = REST_LOW = (uint8_t)step;
  STEP_HIGH = REST_HIGH = (uint8_t)(step >> 8);
}
static inline void board_set_common_dir(bool high) {
  if (high) {
    COMMON_DIR_PORT |= 1 << COMMON_DIR_BIT;
  } else {
    COMMON_DIR_PORT &= (uint8_t)~(1 << COMMON_DIR_BIT);
  }
}
// From now on these pins have the levels of their ports.
static inline void board_drive(void) {
  DDRA = DDRC = 0xFF;
  DDRF = 1 << COMMON_DIR_BIT;
  DDRH = 1 << EN_BIT;
}

static inline void line_set_sending(const uint8_t* wire) {
  LINE_SENDING_LOW = (uint8_t)(uintptr_t)wire;
  LINE_SENDING_HIGH = (uint8_t)((uintptr_t)wire >> 8);
}
static inline void line_timer_start(void) {
  TCCR3B = 1 << CS30;
}
static inline uint16_t line_timer_now(void) {
  return TCNT3;
}
static inline void line_timer_wait(uint16_t count) {
  OCR3A = count;
}

static inline void clock_start(void) {
  // Timer 4, of the position compare output, begins in the same cycle, from the same prescaler.
  GTCCR = 1 << TSM | 1 << PSRSYNC;
  TCCR5B = 1 << CS51;
  TCCR4B = 1 << CS41 | 1 << CS40;
  GTCCR = 0;
}

static inline void board_init(void) {
  // Outputs are low since reset; EN and STEP wait for who knows where they rest.
  DDRL = DDRB = 0xFF;
  DDRE = 1 << DE_BIT;
  DDRG = 1 << COMPARE_BIT;
  // Pull-ups: the inputs, and the receiver's line while the transceiver does not drive it.
  PORTK = PORTJ = 0xFF;
  PORTD = SYSTEM_BITS;
  PORTE = 1 << 0;
}
#endif

#endif
