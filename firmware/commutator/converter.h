// A commutator board whose steps are counted pulses of a voltage-to-frequency converter (V. M.
// Ivanov, 2023, figure 3). Motors, windings and bytes are those of the commutator board
// (commutator.h), but a code is no delay:
//
//     to the board    1..255     after a header: K, for the DAC before the converter. Its next
//                                pulse is the step
//     from the board  status     as of the commutator board; or bit 6, without a step: no pulse
//     came
//                                within BUSHD_CONVERTER_WATCH_MS
//
// While no code waits for a pulse, K is 0, and pulses count for nothing. So the motor makes the
// steps that were asked for, whatever gain, offset and drift the converter has: they change when
// the steps come. All functions are O(1), and none may be called in an interrupt while another one
// runs.
#ifndef BUSHD_FIRMWARE_COMMUTATOR_CONVERTER_H
#define BUSHD_FIRMWARE_COMMUTATOR_CONVERTER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commutator/commutator.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_CONVERTER_WATCH_MS 1000u
// A bit of the status byte, beside those of bushd_commutator_bit.
#define BUSHD_CONVERTER_NO_PULSE 32u

typedef struct bushd_converter {
  bushd_commutator board;  // motors, windings, and whether a code waits (`counting`)
  uint16_t watch;          // of the port's units of time; at least so many are 1 s
  uint8_t code;            // K, which the DAC has
  uint16_t pulses;         // as counted when the code came
  uint16_t since;          // the time when it came
} bushd_converter;

// No motor is selected, all are at phase 0, and K is 0. Precondition: watch < 2^15.
void bushd_converter_begin(bushd_converter* converter, uint16_t watch);
// A byte has come; the time, and the pulses counted so far, are modulo 2^16. `code` is what the DAC
// is to have from now on, here and below.
void bushd_converter_receive(bushd_converter* converter, uint16_t now, uint16_t pulses,
                             uint8_t byte);
void bushd_converter_receive_damaged(bushd_converter* converter);
// Whether what waits is over: by a pulse, or because none comes. To be asked at least once in 2^15
// units of time and 2^16 - 1 pulses.
bool bushd_converter_is_due(const bushd_converter* converter, uint16_t now, uint16_t pulses);
// Makes the step, if there was a pulse and `inputs` of its motor let it, as bushd_commutator_step.
// K is 0 afterwards. Returns the bits of the status that are not those of inputs. Precondition: it
// is due by these pulses.
uint8_t bushd_converter_step(bushd_converter* converter, uint16_t pulses, uint8_t inputs);

#ifdef __cplusplus
}
#endif
#endif
