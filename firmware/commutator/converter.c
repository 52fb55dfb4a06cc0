#include "firmware/commutator/converter.h"

#include <string.h>

void bushd_converter_begin(bushd_converter* converter, uint16_t watch) {
  memset(converter, 0, sizeof *converter);
  converter->watch = watch;
}

void bushd_converter_receive(bushd_converter* converter, uint16_t now, uint16_t pulses,
                             uint8_t byte) {
  bushd_commutator* const board = &converter->board;
  const bool waited = board->counting;
  bushd_commutator_receive(board, 0, byte);
  if (!board->counting) {
    converter->code = 0;
  } else if (!waited) {
    converter->code = byte;
    converter->pulses = pulses;
    converter->since = now;
  }
}

void bushd_converter_receive_damaged(bushd_converter* converter) {
  bushd_commutator_receive_damaged(&converter->board);
  converter->code = 0;
}

bool bushd_converter_is_due(const bushd_converter* converter, uint16_t now, uint16_t pulses) {
  if (!converter->board.counting) return false;
  return pulses != converter->pulses || (uint16_t)(now - converter->since) > converter->watch;
}

uint8_t bushd_converter_step(bushd_converter* converter, uint16_t pulses, uint8_t inputs) {
  converter->code = 0;
  if (pulses == converter->pulses) {
    converter->board.counting = false;
    return BUSHD_CONVERTER_NO_PULSE;
  }
  return bushd_commutator_step(&converter->board, inputs) ? BUSHD_COMMUTATOR_STEP_DONE : 0;
}
