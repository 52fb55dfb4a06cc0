// The MCU program on an LM3S6965: the core, its memory, and the main loop. Interrupts emit slots,
// collect bytes with the times of delimiters, and send; the core runs in the main loop only.
#include "firmware/ports/lm3s6965/board.h"
#include "firmware/ports/lm3s6965/boot.h"
#include "firmware/ports/lm3s6965/clock.h"
#include "firmware/ports/lm3s6965/compare_output.h"
#include "firmware/ports/lm3s6965/edges.h"
#include "firmware/ports/lm3s6965/emission.h"
#include "firmware/ports/lm3s6965/journal.h"
#include "firmware/ports/lm3s6965/line.h"
#include "firmware/ports/lm3s6965/nvm.h"
#include "firmware/ports/lm3s6965/timer.h"
#include "firmware/ports/memory_names.h"

#define QUEUE_TICKS 512u
#define TABLE_CODES 12288u
#define PROGRAM_BYTES 4096u

static bushd_mcu mcu;
static int16_t queue[QUEUE_TICKS * BUSHD_MOTORS_PER_MCU];
static uint16_t codes[TABLE_CODES];
static bushd_mcu_scratch scratch;
static uint8_t program_bytes[PROGRAM_BYTES];
static bushd_mcu_program program = {.bytes = program_bytes, .memory = PROGRAM_BYTES};
static uint8_t reply[BUSHD_MCU_MAX_REPLY];
static bool eeprom_failed;
static uint16_t motor_inputs;

static void port_transmit(void* context, const uint8_t* wire, size_t size, uint32_t delay_ns) {
  (void)context;
  line_transmit(wire, size, delay_ns);
}

static bool port_store_address(void* context, uint8_t address) {
  (void)context;
  return journal_store_address(address);
}

static void put_outputs(bool on, const bushd_set_outputs* levels) {
  ENABLE = on == (levels->enabled == BUSHD_ENABLED_HIGH) ? ALL_PINS : 0;
  emission_set_rest(levels->step_low, (levels->direction_low & 1u) != 0);
}

static void port_set_enable(void* context, bool on, const bushd_set_outputs* levels,
                            bushd_edge off_at) {
  static bool driven;
  (void)context;
  if (!emergency_unwatch(on)) return;
  if (levels->enabled == 0) return;
  put_outputs(on, levels);
  if (!driven) {
    driven = true;
    board_drive();
    put_outputs(on, levels);
  }
  emergency_await(off_at, levels->enabled == BUSHD_ENABLED_LOW);
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
  return emission_time_in_tick_ns(clock_now());
}

// Switches close to ground. Those of motors as they were when the tick began: when DIR of the next
// one has been shifted, to read them would lose it.
static bushd_inputs port_read_inputs(void* context) {
  (void)context;
  const uint32_t levels = emergency_latched(SYSTEM_INPUTS);
  const bushd_inputs inputs = {motor_inputs,
                               (uint8_t)(~levels >> SYSTEM_INPUTS_SHIFT & BUSHD_SYSTEM_INPUTS)};
  return inputs;
}

static uint16_t port_read_current(void* context) {
  (void)context;
  return board_read_current();
}

static uint8_t port_self_test(void* context) {
  (void)context;
  uint8_t failed = eeprom_failed ? BUSHD_TEST_EEPROM : 0;
  if (boot_ram_faults != 0) failed |= BUSHD_TEST_RAM;
  if (!boot_flash_is_sealed()) failed |= BUSHD_TEST_FLASH;
  if (!board_test_inputs()) failed |= BUSHD_TEST_INPUTS;
  return failed;
}

static void port_keep_enable(void* context, bool on) {
  (void)context;
  emergency_keep_enable(on ? mcu.config.outputs.enabled : 0);
}

static void port_set_trigger(void* context, bushd_edge edge) {
  (void)context;
  trigger_await(edge);
}

// The gravest of several flags counts.
static bushd_reset_cause reset_cause(void) {
  const uint32_t flags = SYSCTL_RESC;
  SYSCTL_RESC = 0;
  if (flags & RESC_POWER_ON) return BUSHD_RESET_POWER_ON;
  if (flags & RESC_BROWN_OUT) return BUSHD_RESET_BROWN_OUT;
  if (flags & RESC_EXTERNAL) return BUSHD_RESET_EXTERNAL;
  return flags & RESC_WATCHDOG ? BUSHD_RESET_WATCHDOG : BUSHD_RESET_UNKNOWN;
}

static void boot(void) {
  static const bushd_port kPort = {.transmit = port_transmit,
                                   .store_address = port_store_address,
                                   .set_enable = port_set_enable,
                                   .set_tick = port_set_tick,
                                   .adjust_tick = port_adjust_tick,
                                   .time_in_tick_ns = port_time_in_tick_ns,
                                   .read_inputs = port_read_inputs,
                                   .read_current = port_read_current,
                                   .self_test = port_self_test,
                                   .keep_enable = port_keep_enable,
                                   .set_trigger = port_set_trigger};
  bushd_mcu_config config = {.motors = BUSHD_MOTORS_PER_MCU,
                             .slots = EMISSION_SLOTS,
                             .min_tick_ns = EMISSION_MIN_TICK_NS,
                             .pulse_ns = -EMISSION_LATE_NS,
                             .queue = queue,
                             .queue_ticks = QUEUE_TICKS,
                             .codes = codes,
                             .code_count = TABLE_CODES,
                             .scratch = &scratch,
                             .program = &program,
                             .keeps_programs = true,
                             .reply = reply};
  journal_state kept;
  name_parts_of_core();
  motor_inputs = (uint16_t)~board_read_inputs();
  config.reset_cause = reset_cause();
  const nvm_found found = nvm_find();
  if (found == NVM_WHOLE) config.outputs = nvm_outputs();
  const uint8_t enabled = emergency_kept_enable();
  config.enable_at_boot = config.reset_cause == BUSHD_RESET_WATCHDOG && enabled != 0;
  // The flash may not have it yet.
  if (config.enable_at_boot) config.outputs.enabled = enabled;
  eeprom_failed = !journal_open(&kept) || found == NVM_BROKEN;
  config.address = kept.address;
  config.boot_number = kept.boot_number;
  for (uint8_t i = 0; i < BUSHD_UNIQUE_ID_SIZE; ++i) config.unique_id[i] = kept.unique_id[i];
  bushd_mcu_boot(&mcu, &kPort, &config);
  if (found == NVM_WHOLE) nvm_load(&mcu);
}

static void prepare(void) {
  motor_inputs = (uint16_t)~board_read_inputs();
  bushd_mcu_prepare(&mcu);
  emission_ready(&mcu.slot_buffer[mcu.front ^ 1u]);
}

static bool moves(void) {
  return mcu.state == BUSHD_STATE_RUN ||
         (mcu.slot_buffer[0].active | mcu.slot_buffer[1].active) != 0;
}

static void hear_line(void) {
  uint32_t time = 0;
  uint8_t byte = 0;
  if (line_take(&byte, &time)) {
    bushd_mcu_receive(&mcu, byte, (int32_t)emission_time_in_tick_ns(time));
  } else if (!bushd_mcu_wants_samples(&mcu)) {
    if (!moves()) nvm_poll(&mcu);
  } else if (board_has_current()) {
    bushd_mcu_sample(&mcu, emission_time_in_tick_ns(clock_now()), board_read_current());
    board_begin_current();
  }
}

static void hear_trigger(void) {
  uint32_t time = 0;
  if (trigger_came(&time)) bushd_mcu_trigger(&mcu, (int32_t)emission_time_in_tick_ns(time));
}

int main(void) {
  board_init();
  clock_init();
  timer_measure_excess();
  boot();
  prepare();
  line_init();
  edges_init();
  compare_init();
  emission_start();
  watchdog_start();
  for (;;) {
    uint32_t start = 0;
    // A frame that ended in the tick before must be heard by the core in that tick.
    if (emission_begun(&start) && !line_has_frame_before(start)) {
      emission_swap();
      bushd_mcu_swap(&mcu);
      prepare();
      watchdog_reset();
    } else {
      hear_line();
    }
    hear_trigger();
  }
}
