#include "engine/status.h"

const char* bushd_status_text(unsigned status) {
  switch (status) {
    case BUSHD_OK:
      return "ok";
    case BUSHD_E_LENGTH:
      return "impossible length";
    case BUSHD_E_CRC:
      return "checksum mismatch";
    case BUSHD_E_FORMAT:
      return "field out of range";
    case BUSHD_E_CAPACITY:
      return "capacity exceeded";
    case BUSHD_E_LATE:
      return "too late";
    case BUSHD_E_GAP:
      return "ticks are missing before these";
    case BUSHD_E_EPOCH:
      return "other stream epoch";
    case BUSHD_E_STATE:
      return "not allowed in this state";
    case BUSHD_E_NO_TABLE:
      return "motor has no table";
    case BUSHD_E_TABLE_EMPTY:
      return "table side is empty";
    case BUSHD_E_TABLE_ZERO:
      return "table holds a delay of 0";
    case BUSHD_E_TABLE_UNSORTED:
      return "table side is not sorted from slow to fast";
    case BUSHD_E_TABLE_TOO_LONG:
      return "table side lasts too long";
    case BUSHD_E_VERSION:
      return "protocol versions differ";
    case BUSHD_E_UNKNOWN_MESSAGE:
      return "unknown message";
    case BUSHD_E_FORBIDDEN:
      return "a limit switch forbids this direction";
    case BUSHD_E_PULSE_WIDTH:
      return "pulses longer than half a slot";
    case BUSHD_E_DIR_SETUP:
      return "no time for the DIR setup";
    case BUSHD_E_STEP_PERIOD:
      return "step period longer than a tick";
  }
  return "unknown status";
}
