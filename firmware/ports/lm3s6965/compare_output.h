// The position compare output. Timer 3 waits for the edges of a tick, from the tick's beginning on:
// a tick that comes late takes its pulse along.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_COMPARE_OUTPUT_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_COMPARE_OUTPUT_H

#include <stdbool.h>
#include <stdint.h>

typedef struct compare_edges {
  bool rises;
  bool falls;
  uint32_t rise;  // cycles from the tick's beginning
  uint32_t fall;  // later, if both
} compare_edges;

void compare_init(void);

// The tick that has them begins: for its interrupt. Those of the one before are over.
void compare_emit(const compare_edges* edges);

#endif
