// What a microcontroller must provide. Everything that the core cannot do by itself comes in
// through this struct; `context` is handed back in every call. No function may block.
#ifndef BUSHD_FIRMWARE_CORE_PORT_H
#define BUSHD_FIRMWARE_CORE_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bushd_port {
  void* context;

  // Sends these bytes on the bus: the first bit `delay_ns` after the last stop bit of the frame
  // that has just been handed over, or as soon as the line is the MCU's if that is later (driver
  // enable, turnaround and its release after the last stop bit are the port's). The buffer stays
  // valid until the next call.
  void (*transmit)(void* context, const uint8_t* wire, size_t size, uint32_t delay_ns);

  // Keeps the address for the next boots; false if it cannot.
  bool (*store_address)(void* context, uint8_t address);

  // EN, common to all drivers of the MCU; true = drivers powered.
  void (*set_enable)(void* context, bool on);

  // Length of all later ticks, in ns, from the next tick boundary on.
  void (*set_tick)(void* context, uint32_t tick_ns);

  // Makes the next tick longer (> 0) or shorter (< 0) by this much, once.
  void (*adjust_tick)(void* context, int32_t ns);

  // How far the present tick has gone, in ns.
  uint32_t (*time_in_tick_ns)(void* context);

  // Inputs, one bit per motor.
  uint16_t (*read_inputs)(void* context);

  // Tests of the hardware at boot (memory, stuck inputs); true = good.
  bool (*self_test)(void* context);
} bushd_port;

#ifdef __cplusplus
}
#endif
#endif
