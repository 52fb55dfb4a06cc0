// The MCU program on an ATmega2560: the core, its memory, and the main loop. Interrupts emit slots,
// collect bytes with the times of delimiters, and send; the core runs in the main loop only.
#include <avr/interrupt.h>
#include <avr/wdt.h>
#include <board.h>

#include "firmware/ports/atmega2560/boot_tests.h"
#include "firmware/ports/atmega2560/clock.h"
#include "firmware/ports/atmega2560/compare_output.h"
#include "firmware/ports/atmega2560/eeprom.h"
#include "firmware/ports/atmega2560/emission.h"
#include "firmware/ports/atmega2560/identity.h"
#include "firmware/ports/atmega2560/inputs.h"
#include "firmware/ports/atmega2560/keypad_line.h"
#include "firmware/ports/atmega2560/line.h"
#include "firmware/ports/atmega2560/nvm.h"
#include "firmware/ports/atmega2560/trigger.h"
#include "firmware/ports/memory_names.h"

_Static_assert(BUSHD_MCU_NVM_MAX_BYTES(BOARD_TABLE_CODES) <= NVM_MOST_BYTES,
               "the EEPROM holds all of it");
// Only a new tick keeps it quiet, which takes timer, interrupts and main loop. The longest lasts 20
// ms.
#define WATCHDOG WDTO_120MS

static bushd_mcu mcu;
static int16_t queue[BOARD_QUEUE_TICKS * BOARD_MOTORS];
static uint16_t codes[BOARD_TABLE_CODES];
#if BOARD_VELOCITY_MOTORS > 0
static bushd_mcu_velocity velocity[BOARD_VELOCITY_MOTORS];
#define VELOCITY velocity
#else
#define VELOCITY NULL
#endif

static inline void name_parts(void) {
  name_parts_of_core();
  NAME_BYTES("reply", offsetof(bushd_mcu, receiver.buffer) + LINE_REPLY_AT, BUSHD_MCU_MAX_REPLY);
  NAME_PART("answer.size", answer.size);
  NAME_PART("rows.next", stream.rows.next);
  NAME_PART("rows.count", stream.rows.ticks.count);
  NAME_PART("config.queue", config.queue);
  NAME_PART("config.codes", config.codes);
  NAME_PART("config.reply", config.reply);
}

static void port_transmit(void* context, const uint8_t* wire, size_t size, uint32_t delay_ns) {
  (void)context;
  line_transmit(wire, size, delay_ns);
}

static bool port_store_address(void* context, uint8_t address) {
  (void)context;
  return identity_store_address(address);
}

static void port_set_enable(void* context, bool on, const bushd_set_outputs* levels,
                            bushd_edge off_at) {
  (void)context;
  if (!inputs_unwatch(on)) {
    identity_keep_enable(0);
    return;
  }
  if (levels->enabled == 0) return;
  if (on == (levels->enabled == BUSHD_ENABLED_HIGH)) {
    EN_PORT |= 1 << EN_BIT;
  } else {
    EN_PORT &= (uint8_t)~(1 << EN_BIT);
  }
  emission_set_rest(levels->step_low);
  board_set_common_dir((levels->direction_low & 1u) != 0);
  board_drive();
  inputs_switch_off_at(off_at);
}

static void port_set_tick(void* context, uint32_t tick_ns) {
  (void)context;
  emission_set_tick(tick_ns);
}

static void port_adjust_tick(void* context, int32_t ns) {
  (void)context;
  emission_adjust_tick(ns);
}

static uint32_t port_time_in_tick_ns(void* context) {
  (void)context;
  return (uint32_t)emission_time_in_tick_ns(clock_now());
}

static bushd_inputs port_read_inputs(void* context) {
  (void)context;
  return inputs_read();
}

static uint16_t port_read_current(void* context) {
  (void)context;
  return inputs_current();
}

static void port_set_trigger(void* context, bushd_edge edge) {
  (void)context;
  trigger_await(edge);
}

// At boot only: the context is what has failed.
static uint8_t port_self_test(void* context) {
  return (uint8_t)(uintptr_t)context;
}

static void port_keep_enable(void* context, bool on) {
  (void)context;
  identity_keep_enable(on ? mcu.config.outputs.enabled : 0);
}

// The gravest of several flags counts.
static bushd_reset_cause reset_cause(void) {
  const uint8_t flags = boot_cause();
  if (flags & 1 << PORF) return BUSHD_RESET_POWER_ON;
  if (flags & 1 << BORF) return BUSHD_RESET_BROWN_OUT;
  if (flags & 1 << EXTRF) return BUSHD_RESET_EXTERNAL;
  return flags & 1 << WDRF ? BUSHD_RESET_WATCHDOG : BUSHD_RESET_UNKNOWN;
}

// Not inlined: what it needs would stay on the stack for good.
__attribute__((noinline)) static void boot(void) {
  name_parts();
  uint8_t failed_tests = 0;
  if (boot_faults() & BOOT_RAM_BAD) failed_tests |= BUSHD_TEST_RAM;
  if (boot_faults() & BOOT_FLASH_BAD) failed_tests |= BUSHD_TEST_FLASH;
  if (!inputs_test()) failed_tests |= BUSHD_TEST_INPUTS;
  // Field by field: a constant of it would lie in RAM for good.
  bushd_port port;
  port.transmit = port_transmit;
  port.store_address = port_store_address;
  port.set_enable = port_set_enable;
  port.set_tick = port_set_tick;
  port.adjust_tick = port_adjust_tick;
  port.time_in_tick_ns = port_time_in_tick_ns;
  port.read_inputs = port_read_inputs;
  port.read_current = port_read_current;
  port.self_test = port_self_test;
  port.keep_enable = port_keep_enable;
  port.set_trigger = port_set_trigger;
  port.set_current = BOARD_SET_CURRENT;
  bushd_mcu_config config = {.motors = BOARD_MOTORS,
                             .slots = EMISSION_SLOTS,
                             .min_tick_ns = BOARD_MIN_TICK_NS,
                             .disabled_capabilities = BOARD_DISABLED,
                             .pulse_ns = EMISSION_PULSE_NS,
                             .in_pieces = true,
                             .keypad = BOARD_KEYPAD,
                             .currents = BOARD_CURRENTS,
                             .current_motors = BOARD_CURRENT_MOTORS,
                             .velocity = VELOCITY,
                             .velocity_motors = BOARD_VELOCITY_MOTORS,
                             .queue = queue,
                             .queue_ticks = BOARD_QUEUE_TICKS,
                             .codes = codes,
                             .code_count = BOARD_TABLE_CODES,
                             .reply = line_reply(&mcu.receiver)};
  identity kept;
  config.reset_cause = reset_cause();
  const nvm_found found = nvm_find();
  if (found == NVM_WHOLE) config.outputs = nvm_outputs();
  const uint8_t enabled = boot_enable_kept();
  config.enable_at_boot = config.reset_cause == BUSHD_RESET_WATCHDOG && enabled != 0;
  // The EEPROM may not have it yet.
  if (config.enable_at_boot) config.outputs.enabled = enabled;
  const bool has_identity = identity_load(&kept, &config.boot_number);
  if (!has_identity || found == NVM_BROKEN) failed_tests |= BUSHD_TEST_EEPROM;
  config.address = kept.address;
  for (uint8_t i = 0; i < BUSHD_UNIQUE_ID_SIZE; ++i) config.unique_id[i] = kept.unique_id[i];
  port.context = (void*)(uintptr_t)failed_tests;
  bushd_mcu_boot(&mcu, &port, &config);
  if (found == NVM_WHOLE) nvm_load(&mcu);
}

static void poll_eeprom(void) {
  if (eeprom_writes) return;
  identity_poll();
  const bool moves =
      mcu.state == BUSHD_STATE_RUN || (mcu.slot_buffer[0].active | mcu.slot_buffer[1].active) != 0;
  if (!eeprom_writes && !moves) nvm_poll(&mcu);
}

static void prepare(void) {
  bushd_mcu_prepare(&mcu);
  bushd_slot_buffer* const slot_buffer = &mcu.slot_buffer[mcu.front ^ 1u];
  emission_ready(slot_buffer);
  if (slot_buffer->compare_rise) compare_rise(emission_slot_time(slot_buffer->compare_rise - 1u));
  if (slot_buffer->compare_fall) compare_fall(emission_slot_time(slot_buffer->compare_fall - 1u));
}

// In this order: between the two it may begin.
static bool tick_is_near(void) {
  return emission_begins_soon() || emission_begun();
}

static void hear_keypad(void) {
#if BOARD_KEYPAD
  keypad_line_hear(&mcu);
#endif
}

static void show_at_keypad(void) {
#if BOARD_KEYPAD
  if (mcu.local.settings.keypad != 0 && !tick_is_near()) keypad_line_show(&mcu);
#endif
}

static void hear_line(void) {
  uint32_t ended = 0;
  if (line_collect(&mcu.receiver, &ended)) {
    // A frame takes a while, and can wait; a tick that has begun meanwhile, or soon will, cannot.
    if (tick_is_near() || !line_may_take(&mcu.receiver)) return;
    line_take(&mcu.receiver);
    bushd_mcu_receive(&mcu, 0, emission_time_in_tick_ns(ended));
  } else if (bushd_mcu_wants_samples(&mcu)) {
    // The same conversion may be seen several times.
    bushd_mcu_sample(&mcu, (uint32_t)emission_time_in_tick_ns(clock_now()), inputs_current());
  } else if (line_is_idle()) {
    clock_now();  // a tick may last longer than it may go unasked
    poll_eeprom();
    show_at_keypad();
  }
}

static void hear_trigger(void) {
  uint32_t came = 0;
  if (trigger_came(&came)) bushd_mcu_trigger(&mcu, emission_time_in_tick_ns(came));
}

int main(void) {
  board_init();
  clock_init();
  inputs_init();
  boot();
  prepare();
  line_init();
  emission_start();
  wdt_enable(WATCHDOG);
  sei();
  for (;;) {
    if (emission_begun()) {
      emission_swap();
      clock_now();  // it must be asked every 30 ms
      bushd_mcu_swap(&mcu);
      hear_keypad();
      prepare();
      wdt_reset();
    } else if (!bushd_mcu_work(&mcu)) {
      hear_line();
    }
    hear_trigger();
  }
}
