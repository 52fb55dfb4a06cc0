// The trigger input.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_TRIGGER_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_TRIGGER_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

void trigger_init(void);

// As in bushd_port.
void trigger_await(bushd_edge edge);

// The edge has come: when (clock.h). Each is told once. For the main loop.
bool trigger_came(uint32_t* time);

#endif
