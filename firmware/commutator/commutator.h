// A commutator board of BUSHD-2 (JINR P10-85-635, figure 5): it takes the number of a motor, a
// direction and delay codes from a serial line, counts each delay, switches the windings of that
// motor, and answers with what its inputs say. Bytes and times come in, windings and answers go
// out; clock, line and pins are the port's (firmware/ports/commutator).
//
//     to the board    0          the motion before is over: a code that is being counted is
//                                dropped, without a step and without an answer
//                     1000 dnnn  after 0: number n of the motor, direction d (1: left)
//                     1..255     after a header: code / (250 F_start), then a step
//     from the board  status     the bits of bushd_commutator_bit, after each code that was counted
//
// It has one timer: what else comes while it counts is no code, but for 0. Bytes that have no
// meaning where they come are ignored. A byte that was damaged on the way may have been a 0, after
// which a header would be taken for a code, so it counts as one. All functions are O(1), and none
// may be called in an interrupt while another one runs.
#ifndef BUSHD_FIRMWARE_COMMUTATOR_COMMUTATOR_H
#define BUSHD_FIRMWARE_COMMUTATOR_COMMUTATOR_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_COMMUTATOR_MOTORS 8u
#define BUSHD_COMMUTATOR_PHASES 4u
#define BUSHD_COMMUTATOR_MAX_START_HZ 100u
#define BUSHD_COMMUTATOR_MAX_COUNTS_PER_S UINT32_C(8000000)

// The status byte. The first four are what a port reads at the inputs of a motor as well.
typedef enum bushd_commutator_bit {
  BUSHD_COMMUTATOR_RIGHT_LIMIT = 1,
  BUSHD_COMMUTATOR_LEFT_LIMIT = 2,
  BUSHD_COMMUTATOR_SUPPLY_MISSING = 4,
  BUSHD_COMMUTATOR_NOT_CONNECTED = 8,
  BUSHD_COMMUTATOR_STEP_DONE = 16
} bushd_commutator_bit;

typedef struct bushd_commutator {
  // That of a code in 256ths of the port's counts, rounded up; 0 where codes are no delays
  // (converter.h).
  uint32_t unit;
  uint32_t due;  // the step, if it counts
  uint8_t phase[BUSHD_COMMUTATOR_MOTORS];
  uint8_t motor;  // the last that was selected
  bool left;
  bool selected;  // so a code is what comes next
  bool counting;
} bushd_commutator;

// No motor is selected, and all are at phase 0. Preconditions: F_start 1..100 Hz, a clock of
// 25000..8000000 counts a second. A division.
void bushd_commutator_begin(bushd_commutator* board, uint32_t start_hz, uint32_t counts_per_s);
// A byte whose stop bit ended at `now`: counts of the port's clock, modulo 2^32.
void bushd_commutator_receive(bushd_commutator* board, uint32_t now, uint8_t byte);
void bushd_commutator_receive_damaged(bushd_commutator* board);
// Whether the step of board->motor is due. To be asked at least once in 2^31 counts less the
// longest delay.
bool bushd_commutator_is_due(const bushd_commutator* board, uint32_t now);
// It is made, and true returned, if `inputs` of its motor let it: its windings are other ones now.
// Either way the delay is over. Precondition: it is due.
bool bushd_commutator_step(bushd_commutator* board, uint8_t inputs);
// The answer, by the inputs as they are after the step.
uint8_t bushd_commutator_status(bool step_done, uint8_t inputs);
// Bit n: winding n of the motor is on. Two are, in each phase.
uint8_t bushd_commutator_windings(const bushd_commutator* board, uint8_t motor);

#ifdef __cplusplus
}
#endif
#endif
