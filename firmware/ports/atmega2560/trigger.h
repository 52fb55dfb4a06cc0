// The trigger input.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_TRIGGER_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_TRIGGER_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

// As in bushd_port.
void trigger_await(bushd_edge edge);

// The edge has come, in the last 30 ms: when (clock.h). Each is told once. For the main loop.
bool trigger_came(uint32_t* time);

#endif
