// Status codes of the engine. The values are the wire codes: never renumber, only append.
#ifndef BUSHD_ENGINE_STATUS_H
#define BUSHD_ENGINE_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

typedef enum bushd_status {
  BUSHD_OK = 0,
  BUSHD_E_LENGTH = 1,    // a frame or a message has an impossible length
  BUSHD_E_CRC = 2,       // checksum mismatch
  BUSHD_E_FORMAT = 3,    // a field holds a value that the message does not allow
  BUSHD_E_CAPACITY = 4,  // the caller's memory or the tick queue is too small
  BUSHD_E_LATE = 5,      // ticks whose time is over, or too near to be prepared
  BUSHD_E_GAP = 6,       // ticks of a moving motor that do not join those already queued
  BUSHD_E_EPOCH = 7,     // a frame of another stream epoch (before or after a replacement)
  BUSHD_E_STATE = 8,  // not allowed in the present state (moving, disabled, faulty, not configured)
  BUSHD_E_NO_TABLE = 9,          // a motor without a table cannot be asked to move
  BUSHD_E_TABLE_EMPTY = 10,      // a table side without a code
  BUSHD_E_TABLE_ZERO = 11,       // a delay code of 0
  BUSHD_E_TABLE_UNSORTED = 12,   // a side that does not fall from slow to fast
  BUSHD_E_TABLE_TOO_LONG = 13,   // a side lasts 2^31 time units or longer
  BUSHD_E_VERSION = 14,          // protocol versions differ
  BUSHD_E_UNKNOWN_MESSAGE = 15,  // no such message type
  BUSHD_E_FORBIDDEN = 16,        // a start into a direction that a limit switch forbids
  // Emission settings that the slots of this tick cannot keep.
  BUSHD_E_PULSE_WIDTH = 17,  // STEP pulses longer than half a slot
  BUSHD_E_DIR_SETUP = 18,    // DIR earlier before a step than it can be
  BUSHD_E_STEP_PERIOD = 19   // T_step longer than a tick
} bushd_status;

// A short English phrase for a bushd_status, never NULL; "unknown status" for any other value, as
// the line may bring one.
const char* bushd_status_text(unsigned status);

#ifdef __cplusplus
}
#endif
#endif
