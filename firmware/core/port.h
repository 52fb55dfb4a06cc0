// What a microcontroller must provide. Everything that the core cannot do by itself comes in
// through this struct; `context` is handed back in every call. No function may block.
#ifndef BUSHD_FIRMWARE_CORE_PORT_H
#define BUSHD_FIRMWARE_CORE_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/message.h"

#ifdef __cplusplus
extern "C" {
#endif

// What the pins say: 1 is active as the port wires it (docs/firmware.md). The core turns those
// round whose switches rest at the other level (bushd_set_inputs).
typedef struct bushd_inputs {
  uint16_t motors;  // bit per input: switches of motors
  uint8_t system;   // BUSHD_INPUT_*
} bushd_inputs;

typedef struct bushd_port {
  void* context;

  // Sends these bytes on the bus: the first bit `delay_ns` after the last stop bit of the frame
  // that has just been handed over, or as soon as the line is the MCU's if that is later (driver
  // enable, turnaround and its release after the last stop bit are the port's). The buffer stays
  // valid until the next call.
  void (*transmit)(void* context, const uint8_t* wire, size_t size, uint32_t delay_ns);

  // Keeps the address for the next boots; false if it cannot.
  bool (*store_address)(void* context, uint8_t address);

  // EN, common to all drivers of the MCU; true = drivers powered. `levels` says which level of it
  // that is, and where STEP and the common DIR rest; while levels->enabled is 0 nobody has told,
  // and EN and STEP are left to the resistors of the board: not driven. `levels` stay where they
  // are, and change while the drivers are disabled and no motor moves, with another call.
  // off_at: EN goes off by itself within a slot of this edge at the emergency input, without the
  // core; at once if the input is so already. From then on read_inputs says that the input is as
  // after the edge, until a call with `on` false, and EN stays off until then: with `on` true the
  // core cannot have seen it. No press is too short. What keep_enable was told is void, since a
  // core that hangs would not see it before a reset. BUSHD_EDGE_NONE: it does not, and never does
  // with `on` false.
  void (*set_enable)(void* context, bool on, const bushd_set_outputs* levels, bushd_edge off_at);

  // Length of all later ticks, in ns, from the next tick boundary on.
  void (*set_tick)(void* context, uint32_t tick_ns);

  // Makes the next tick longer (> 0) or shorter (< 0) by this much, once; what it was told before
  // for that tick counts no more. By up to 1/64 of it to stay in step with the bus; longer by up to
  // a whole one to come into step, while no motor moves.
  void (*adjust_tick)(void* context, int32_t ns);

  // How far the present tick has gone, in ns.
  uint32_t (*time_in_tick_ns)(void* context);

  // Asked once a tick, before it is prepared, and with requests and reports at any time.
  bushd_inputs (*read_inputs)(void* context);

  // The last reading of the supply current, 0..1023; 0 where nothing measures it.
  uint16_t (*read_current)(void* context);

  // Tests of the hardware at boot: BUSHD_TEST_* of all that failed.
  uint8_t (*self_test)(void* context);

  // Remembers over a watchdog reset whether the drivers are to be enabled at once after it, and by
  // which level of EN: then bushd_mcu_config.enable_at_boot and .outputs say so.
  void (*keep_enable)(void* context, bool on);

  // From now on this edge at the trigger input is captured, once, and handed over by
  // bushd_mcu_trigger; BUSHD_EDGE_NONE: none is. Edges of before do not count. NULL: there is no
  // such input.
  void (*set_trigger)(void* context, bushd_edge edge);

  // Peak current of the windings of this motor, driven by phases, from the next tick on; 0: it is
  // not controlled. NULL: no current is.
  void (*set_current)(void* context, uint8_t motor, uint16_t ma, bool fast_decay);
} bushd_port;

#ifdef __cplusplus
}
#endif
#endif
