// ATmega1284P at 16 MHz: which pin is what. docs/firmware.md has the same as a table, with the
// wiring.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA1284P_BOARD_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA1284P_BOARD_H

#include <avr/io.h>

#define CYCLES_PER_US 16u

// A whole port in the low I/O space, so that the pulses of a slot begin together and each bit may
// be cleared by itself. With phases: motor 0 has bits 0..3, motor 1 bits 4..7.
#define STEP_PORT PORTC
// DIR of motors 0..7 goes through a 74HC595 at the SPI: only drivers with STEP and DIR need it.
#define DIR_LATCH_PORT PORTB
#define DIR_LATCH_BIT 4
#define DIR_BITS (1 << 4 | 1 << 5 | 1 << 7)  // latch, data, clock
// Inputs, with pull-ups; closed to ground: active. Input 0 is PB0, inputs 1..6 are PA1..PA6. The
// current sensor is at ADC0, PA0.
#define INPUT_LOW PINA
#define INPUT_LOW_BITS 0x7E
#define INPUT_SYSTEM PINB
#define INPUT_0_BIT 0
#define EMERGENCY_BIT 1
#define TRIGGER_BIT 2
#define FORWARD_BIT 3
#define REVERSE_BIT 6
#define SYSTEM_BITS \
  (1 << INPUT_0_BIT | 1 << EMERGENCY_BIT | 1 << TRIGGER_BIT | 1 << FORWARD_BIT | 1 << REVERSE_BIT)

// Fast decay of the windings' currents, while it is high.
#define DECAY_PORT PORTA
#define DECAY_BIT 7
// Outputs of the comparators of both pairs of windings of motor 0, low while the current is above
// the reference. The reference is the mean of the PWM at PD7.
#define COMPARATORS PIND
#define COMPARATOR_0_BIT 2
#define COMPARATOR_1_BIT 3
#define COMPARATOR_BITS (1 << COMPARATOR_0_BIT | 1 << COMPARATOR_1_BIT)
#define REFERENCE_BIT 7
// Where STEP rests, for the interrupts: in a register of timer 0, which makes no use of it.
#define REST_LOW OCR0B
// Output of the position compare pulse.
#define COMPARE_PORT PORTD
#define COMPARE_BIT 6
#define EN_PORT PORTD
#define EN_PIN PIND  // a 1 written to it turns the output over
#define EN_BIT 5
// Driver-enable of the RS-485 transceiver, and its /RE: it does not hear itself.
#define DE_PORT PORTD
#define DE_BIT 4

// What main.c makes of it. What the bigger chip cannot with sixteen motors, this one cannot with
// eight beside its chopper; there is no common DIR.
#define BOARD_MOTORS 8u
#define BOARD_DISABLED (BUSHD_CAN_TABLE_TICKS | BUSHD_CAN_LINE_RUN | BUSHD_CAN_COMMON_DIR)
// To clear the queue takes its time: with 256 ticks of it a ramp-down would come a tick late.
#define BOARD_QUEUE_TICKS 64u
#define BOARD_TABLE_CODES 1536u
// Motor 0 has the chopper.
#define BOARD_CURRENT_MOTORS 1u
#define BOARD_CURRENTS chopper_currents
#define BOARD_SET_CURRENT chopper_set
// Each takes some 15 % of the CPU while it moves by the velocity loop.
#define BOARD_VELOCITY_MOTORS 2u
// The comparators have the pins of UART 1.
#define BOARD_KEYPAD 0
// Shorter, slots would not hold their interrupts: a slot then has 250 cycles.
#define BOARD_MIN_TICK_NS 2000000u

// Timer 1, of the slots.
#define BOARD_SLOT_FLAGS (1 << OCF1A | 1 << OCF1B)
#define BOARD_SLOT_INTERRUPTS (1 << OCIE1A | 1 << OCIE1B)

// Interrupt of the trigger input.
#define TRIGGER_VECTOR INT2_vect
#define TRIGGER_INT INT2
#define TRIGGER_FLAG INTF2
#define TRIGGER_FALLING (1 << ISC21)
#define TRIGGER_RISING (1 << ISC21 | 1 << ISC20)
// Edges of the comparators: their outputs fall when the current is reached.
#define BOARD_EDGES (1 << ISC01 | 1 << ISC11)

// Interrupt of the emergency input: at any change of its pin.
#define EMERGENCY_VECTOR PCINT1_vect
#define EMERGENCY_CHANGE (1 << PCINT9)  // of PCMSK1

// Timer 3 is the clock, what the line waits by (compare A) and that of the position compare pulse
// (compare B).
#define CLOCK_COUNT TCNT3
#define CLOCK_COUNT_LOW TCNT3L
#define CLOCK_COUNT_HIGH TCNT3H
#define LINE_COUNT_CYCLES 8u
#define LINE_OTHER_INTERRUPTS (1 << OCIE3B)

#ifndef __ASSEMBLER__

#include <stdbool.h>
#include <stdint.h>
#include <util/atomic.h>

#include "firmware/ports/atmega1284p/chopper.h"

extern volatile uint16_t line_sending;

static inline uint16_t board_rest(void) {
  return REST_LOW;
}
// With interrupts off.
static inline void board_set_rest(uint16_t step) {
  STEP_PORT = REST_LOW = (uint8_t)step;
}
static inline void board_set_common_dir(bool high) {
  (void)high;
}
// From now on these pins have the levels of their ports.
static inline void board_drive(void) {
  DDRC = 0xFF;
  DDRD |= 1 << EN_BIT;
}

static inline void line_set_sending(const uint8_t* wire) {
  line_sending = (uint16_t)(uintptr_t)wire;
}
// Interrupts read the timer through the register for its high byte: others have it to themselves
// while they use it.
static inline uint16_t line_timer_now(void) {
  uint16_t count = 0;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    count = TCNT3;
  }
  return count;
}
static inline void line_timer_wait(uint16_t count) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    OCR3A = count;
  }
}
static inline void clock_start(void) {
  TCCR3B = 1 << CS31;
}
static inline void line_timer_start(void) {
  TIMSK3 = LINE_OTHER_INTERRUPTS;
}

static inline void board_init(void) {
  // Outputs are low since reset; EN and STEP wait for who knows where they rest.
  DDRA = 1 << DECAY_BIT;
  DDRB = DIR_BITS;
  DDRD = 1 << DE_BIT | 1 << COMPARE_BIT | 1 << REFERENCE_BIT;
  // Pull-ups: the inputs, and the receiver's line while the transceiver does not drive it.
  PORTA = INPUT_LOW_BITS;
  PORTB = SYSTEM_BITS;
  PORTD = 1 << 0 | COMPARATOR_BITS;
  SPCR = 1 << SPE | 1 << MSTR;
  SPSR = 1 << SPI2X;
  SPDR = 0;
  __builtin_avr_delay_cycles(20);
  DIR_LATCH_PORT |= 1 << DIR_LATCH_BIT;
  DIR_LATCH_PORT &= (uint8_t)~(1 << DIR_LATCH_BIT);
  chopper_init();
}
#endif

#endif
