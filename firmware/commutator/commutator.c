#include "firmware/commutator/commutator.h"

#include <string.h>

// Codes that last 1 / F_start: docs/camac.md, U19 and D4 of its sources.
enum { CODES_PER_START_PERIOD = 250 };
enum { MOTION_OVER = 0, HEADER = 0x80, LEFT = 0x08, NUMBER = 0x07 };

void bushd_commutator_begin(bushd_commutator* board, uint32_t start_hz, uint32_t counts_per_s) {
  memset(board, 0, sizeof *board);
  // A division for each code would take as long as the shortest code.
  const uint32_t codes_per_s = CODES_PER_START_PERIOD * start_hz;
  board->unit = (counts_per_s * 256u + codes_per_s - 1u) / codes_per_s;
}

static void receive_code(bushd_commutator* board, uint32_t now, uint8_t code) {
  board->due = now + ((code * board->unit + 255u) >> 8);
  board->counting = true;
}

void bushd_commutator_receive(bushd_commutator* board, uint32_t now, uint8_t byte) {
  if (byte == MOTION_OVER) {
    board->selected = false;
    board->counting = false;
  } else if (board->selected) {
    if (!board->counting) receive_code(board, now, byte);
  } else if ((byte & ~(LEFT | NUMBER)) == HEADER) {
    board->selected = true;
    board->motor = byte & NUMBER;
    board->left = (byte & LEFT) != 0;
  }
}

void bushd_commutator_receive_damaged(bushd_commutator* board) {
  bushd_commutator_receive(board, 0, MOTION_OVER);
}

bool bushd_commutator_is_due(const bushd_commutator* board, uint32_t now) {
  return board->counting && now - board->due < UINT32_C(1) << 31;
}

bool bushd_commutator_step(bushd_commutator* board, uint8_t inputs) {
  board->counting = false;
  if ((inputs & (BUSHD_COMMUTATOR_SUPPLY_MISSING | BUSHD_COMMUTATOR_NOT_CONNECTED)) != 0) {
    return false;
  }
  uint8_t* const phase = &board->phase[board->motor];
  *phase = (uint8_t)(*phase + (board->left ? BUSHD_COMMUTATOR_PHASES - 1u : 1u)) %
           BUSHD_COMMUTATOR_PHASES;
  return true;
}

uint8_t bushd_commutator_status(bool step_done, uint8_t inputs) {
  return (uint8_t)(inputs | (step_done ? BUSHD_COMMUTATOR_STEP_DONE : 0));
}

uint8_t bushd_commutator_windings(const bushd_commutator* board, uint8_t motor) {
  switch (board->phase[motor]) {
    case 0:
      return 0x3;
    case 1:
      return 0x6;
    case 2:
      return 0xC;
    default:
      return 0x9;
  }
}
