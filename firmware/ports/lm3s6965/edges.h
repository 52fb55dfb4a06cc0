// Inputs whose edges interrupt: the trigger's, and the emergency input where it switches EN off.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_EDGES_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_EDGES_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

void edges_init(void);

// As in bushd_port.
void trigger_await(bushd_edge edge);

// The edge has come: when (clock.h). Each is told once. For the main loop.
bool trigger_came(uint32_t* time);

// Nothing is awaited any more: EN may be written, but not to be `on` (false) where it has been
// switched off since the last call with `on` false. With interrupts on.
bool emergency_unwatch(bool on);

// After that. As off_at of bushd_port.set_enable; `off_high`: the level of EN then. With interrupts
// on.
void emergency_await(bushd_edge edge, bool off_high);

// BUSHD_ENABLED_* of drivers to be enabled again after a watchdog reset, or 0. It is 0 once EN has
// been switched off by the input.
void emergency_keep_enable(uint8_t enabled);
uint8_t emergency_kept_enable(void);

// Levels of port A, with that of the emergency input as after the edge once it has come.
uint32_t emergency_latched(uint32_t levels);

#endif
