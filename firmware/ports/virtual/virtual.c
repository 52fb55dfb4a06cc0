#include "firmware/ports/virtual/virtual.h"

#include <assert.h>
#include <string.h>

enum { kMillion = 1000000 };

// Both conversions split whole multiples off first, so that no product can overflow in years of
// simulated time. A perfect clock is the common case and spared the divisions: it is asked for
// every byte and edge.
static int64_t own_time(const bushd_virtual* v, int64_t time_ns) {
  const int64_t since_boot = time_ns - v->config.boot_ns;
  if (v->config.clock_ppm == 0) return since_boot;
  const int64_t rate = kMillion + v->config.clock_ppm;
  return since_boot / kMillion * rate + since_boot % kMillion * rate / kMillion;
}

static int64_t true_time(const bushd_virtual* v, int64_t own_ns) {
  if (v->config.clock_ppm == 0) return v->config.boot_ns + own_ns;
  const int64_t rate = kMillion + v->config.clock_ppm;
  const int64_t whole = own_ns / rate * kMillion;
  return v->config.boot_ns + whole + (own_ns % rate * kMillion + rate - 1) / rate;
}

static void emit(bushd_virtual* v, int64_t time_ns, bushd_virtual_signal signal, uint8_t index,
                 bool level) {
  if (v->config.edge != NULL) v->config.edge(v->config.context, time_ns, signal, index, level);
}

// One edge for every pin in which `levels` and `*present` differ.
static void drive(bushd_virtual* v, int64_t time_ns, bushd_virtual_signal signal, uint16_t* present,
                  uint16_t levels) {
  const uint16_t changed = (uint16_t)(*present ^ levels);
  *present = levels;
  for (uint8_t i = 0; changed >> i != 0; ++i) {
    if (changed >> i & 1) emit(v, time_ns, signal, i, levels >> i & 1);
  }
}

static int64_t edge_time(const bushd_virtual* v, uint16_t edge) {
  return true_time(
      v, v->tick_start_own_ns + edge * v->tick_length_ns / (2 * (int64_t)v->config.mcu.slots));
}

// What the STEP outputs have from this edge of the present tick on.
static uint16_t step_levels_at(const bushd_virtual* v, uint16_t edge) {
  if (v->slot_buffer->outputs == BUSHD_OUTPUTS_LEVELS) return v->slot_buffer->step[edge / 2];
  const bool pulse_is_over = edge % 2 == 1;
  return (pulse_is_over ? 0 : v->slot_buffer->step[edge / 2]) ^ v->rest.step_low;
}

static bool common_dir_rests_high(const bushd_virtual* v) {
  return (v->rest.direction_low & 1) != 0;
}

// The same for the common DIR.
static uint16_t common_dir_at(const bushd_virtual* v, uint16_t edge) {
  const uint16_t slot = (uint16_t)((edge + 1) / 2);
  const bool right = v->slot_buffer->outputs == BUSHD_OUTPUTS_COMMON_DIR &&
                     slot < v->config.mcu.slots && slot % 2 != 0;
  return right != common_dir_rests_high(v);
}

static void drive_compare(bushd_virtual* v, int64_t time_ns, bool level) {
  if (level == v->compare_level) return;
  v->compare_level = level;
  emit(v, time_ns, BUSHD_VIRTUAL_COMPARE, 0, level);
}

static bool has_edges(const bushd_slot_buffer* slot_buffer) {
  return (slot_buffer->active | slot_buffer->compare_rise | slot_buffer->compare_fall) != 0;
}

// Calls back the edges of the present tick up to until_ns.
static void emit_slots(bushd_virtual* v, int64_t until_ns) {
  const uint16_t edges = (uint16_t)(2 * v->config.mcu.slots);
  const bushd_slot_buffer* slot_buffer = v->slot_buffer;
  if (v->config.edge == NULL || slot_buffer == NULL || !has_edges(slot_buffer)) return;
  for (; v->edge_cursor < edges; ++v->edge_cursor) {
    const uint16_t slot = v->edge_cursor / 2;
    const bool begins = v->edge_cursor % 2 == 0;
    const bool rises = begins && slot_buffer->compare_rise == slot + 1;
    const bool falls = begins && slot_buffer->compare_fall == slot + 1;
    // A slot_buffer without steps has no masks.
    const bool steps = slot_buffer->active != 0;
    const uint16_t levels = steps ? step_levels_at(v, v->edge_cursor) : v->step_levels;
    const uint16_t common_dir = steps ? common_dir_at(v, v->edge_cursor) : v->common_dir_level;
    const bool same = levels == v->step_levels && common_dir == v->common_dir_level;
    if (same && !rises && !falls) continue;
    const int64_t time_ns = edge_time(v, v->edge_cursor);
    if (time_ns > until_ns) return;
    drive(v, time_ns, BUSHD_VIRTUAL_STEP, &v->step_levels, levels);
    drive(v, time_ns, BUSHD_VIRTUAL_COMMON_DIR, &v->common_dir_level, common_dir);
    if (rises || falls) drive_compare(v, time_ns, rises);
  }
}

static void turn(bushd_virtual_shaft* shaft, int steps) {
  shaft->position_steps += steps;
  shaft->travel_steps += (uint64_t)(steps < 0 ? -steps : steps);
}

static void turn_for_whole_tick(bushd_virtual* v) {
  if (v->slot_buffer == NULL || v->slot_buffer->active == 0) return;
  for (uint8_t i = 0; i < v->config.mcu.motors; ++i) turn(&v->shaft[i], v->slot_buffer->steps[i]);
}

// Motors that step in this slot; `before` are the outputs of the slot before.
static uint16_t steps_of_slot(const bushd_slot_buffer* slot_buffer, uint16_t slot,
                              uint16_t before) {
  const uint16_t mask = slot_buffer->step[slot];
  if (slot_buffer->outputs != BUSHD_OUTPUTS_LEVELS) return mask;
  uint16_t motors = 0;
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU / BUSHD_PHASE_OUTPUTS; ++m) {
    const unsigned shift = BUSHD_PHASE_OUTPUTS * m;
    const unsigned was = (unsigned)before >> shift & 0xFu;
    const unsigned is = (unsigned)mask >> shift & 0xFu;
    if (was != 0 && is != 0 && was != is) motors = (uint16_t)(motors | 1u << m);
  }
  return motors;
}

// A reset cuts the tick short: only the steps that have begun count.
static void turn_for_cut_tick(bushd_virtual* v) {
  if (v->slot_buffer == NULL || v->slot_buffer->active == 0) return;
  uint16_t before = v->levels_before_tick;
  for (uint16_t slot = 0; slot < v->config.mcu.slots; ++slot) {
    const uint16_t steps = steps_of_slot(v->slot_buffer, slot, before);
    before = v->slot_buffer->step[slot];
    if (steps == 0) continue;
    if (edge_time(v, (uint16_t)(2 * slot)) > v->now_ns) return;
    for (uint8_t i = 0; i < v->config.mcu.motors; ++i) {
      if (steps >> i & 1) turn(&v->shaft[i], v->slot_buffer->steps[i] < 0 ? -1 : 1);
    }
  }
}

static void begin_tick(bushd_virtual* v, int64_t start_own_ns) {
  v->tick_start_own_ns = start_own_ns;
  v->tick_start_ns = v->now_ns;
  v->tick_length_ns = (int64_t)v->tick_ns + v->adjust_ns;
  v->adjust_ns = 0;
  // Shorter, two edges would fall together: the core must never ask for it.
  assert(v->tick_length_ns >= 2 * (int64_t)v->config.mcu.slots);
  v->next_event_ns = true_time(v, start_own_ns + v->tick_length_ns);
  v->edge_cursor = 0;
}

// What the slot_buffer leaves at the STEP outputs.
static uint16_t last_levels(const bushd_virtual* v) {
  const bool levels = v->slot_buffer->outputs == BUSHD_OUTPUTS_LEVELS;
  return levels ? v->slot_buffer->step[v->config.mcu.slots - 1] : v->rest.step_low;
}

// Gives the samples of the tick that ends.
static void give_samples(bushd_virtual* v) {
  if (v->config.current == NULL || !bushd_mcu_wants_samples(&v->mcu)) return;
  for (int64_t at_ns = 0; at_ns < v->tick_length_ns; at_ns += BUSHD_VIRTUAL_SAMPLE_NS) {
    const int64_t time_ns = true_time(v, v->tick_start_own_ns + at_ns);
    bushd_mcu_sample(&v->mcu, (uint32_t)at_ns, v->config.current(v->config.context, time_ns));
  }
}

// What outlives resets: compared a little in every tick, and written at once when it has stayed the
// same for as long as a real port wants it to.
static void write_nvm(bushd_virtual* v) {
  size_t at = 0;
  bushd_mcu_nvm_begin_scan(&v->scan);
  for (;;) {
    const bushd_mcu_nvm_region bytes = bushd_mcu_nvm_scan_next(&v->mcu, &v->scan, UINT16_MAX);
    if (bytes.at == NULL) break;
    assert(at + bytes.size <= v->config.nvm_size);
    memcpy(v->config.nvm + at, bytes.at, bytes.size);
    at += bytes.size;
  }
  v->kept.size = v->scan.size;
  v->kept.crc = v->scan.crc;
}

static void go_on_with_nvm(bushd_virtual* v) {
  if (v->config.nvm == NULL || v->mcu.state == BUSHD_STATE_RUN) return;
  if (bushd_mcu_nvm_scan_next(&v->mcu, &v->scan, BUSHD_VIRTUAL_COMPARED_BYTES).at != NULL) return;
  const bool same = v->kept.size == v->scan.size && v->kept.crc == v->scan.crc;
  bushd_mcu_nvm_compared(&v->mcu, same);
  const bool quiet = bushd_mcu_nvm_is_quiet(&v->mcu, &v->scan);
  if (!same && quiet && (v->kept.size != 0 || v->mcu.tables.codes_used != 0)) {
    const bushd_mcu_nvm_scan whole = v->scan;
    write_nvm(v);
    v->scan = whole;
  }
  bushd_mcu_nvm_begin_scan(&v->scan);
}

static void load_nvm(bushd_virtual* v) {
  v->scan = (bushd_mcu_nvm_scan){0};
  bushd_mcu_nvm_begin_scan(&v->scan);
  if (v->kept.size == 0) return;
  for (size_t at = 0;;) {
    const bushd_mcu_nvm_region bytes = bushd_mcu_nvm_scan_next(&v->mcu, &v->scan, UINT16_MAX);
    if (bytes.at == NULL) break;
    memcpy(bytes.at, v->config.nvm + at, bytes.size);
    at += bytes.size;
  }
  bushd_mcu_nvm_begin_scan(&v->scan);
  bushd_mcu_nvm_restored(&v->mcu);
}

static void tick_boundary(bushd_virtual* v) {
  emit_slots(v, v->next_event_ns);
  give_samples(v);
  turn_for_whole_tick(v);
  v->now_ns = v->next_event_ns;
  begin_tick(v, v->tick_start_own_ns + v->tick_length_ns);
  if (v->slot_buffer != NULL) v->levels_before_tick = last_levels(v);
  v->slot_buffer = bushd_mcu_swap(&v->mcu);
  drive(v, v->now_ns, BUSHD_VIRTUAL_DIR, &v->dir_levels, v->slot_buffer->direction);
  if (v->slot_buffer->active == 0) {
    drive(v, v->now_ns, BUSHD_VIRTUAL_STEP, &v->step_levels, last_levels(v));
  }
  bushd_mcu_prepare(&v->mcu);
  go_on_with_nvm(v);
}

// The delay is a few ms at most: the MCU's own clock is as good as true time for it.
static void port_transmit(void* context, const uint8_t* wire, size_t size, uint32_t delay_ns) {
  const bushd_virtual* v = context;
  const uint32_t turnaround_ns = v->config.turnaround_ns;
  const uint32_t begin_ns = delay_ns > turnaround_ns ? delay_ns : turnaround_ns;
  v->config.transmit(v->config.context, v->now_ns + begin_ns, wire, size);
}

static bool port_store_address(void* context, uint8_t address) {
  bushd_virtual* v = context;
  v->config.mcu.address = address;
  return true;
}

static void drive_enable(bushd_virtual* v, bool level) {
  if (level == v->enable_level) return;
  emit_slots(v, v->now_ns);
  v->enable_level = level;
  emit(v, v->now_ns, BUSHD_VIRTUAL_EN, 0, level);
}

// STEP and the common DIR, where nothing moves.
static void drive_rest(bushd_virtual* v) {
  drive(v, v->now_ns, BUSHD_VIRTUAL_STEP, &v->step_levels, v->rest.step_low);
  drive(v, v->now_ns, BUSHD_VIRTUAL_COMMON_DIR, &v->common_dir_level, common_dir_rests_high(v));
}

static bool is_after(bushd_edge edge, bushd_inputs inputs) {
  return ((inputs.system & BUSHD_INPUT_EMERGENCY) != 0) == (edge == BUSHD_EDGE_RISING);
}

// Its interrupt, and what it finds when it is allowed.
static void follow_emergency(bushd_virtual* v) {
  if (v->off_at == BUSHD_EDGE_NONE || v->switched_off || !is_after(v->off_at, v->inputs)) return;
  v->switched_off = true;
  v->enable_kept = false;
  drive_enable(v, v->rest.enabled == BUSHD_ENABLED_LOW);
}

static void port_set_enable(void* context, bool on, const bushd_set_outputs* levels,
                            bushd_edge off_at) {
  bushd_virtual* v = context;
  if (on && v->switched_off) {
    v->enable_kept = false;
    return;
  }
  v->off_at = off_at;
  v->switched_off = false;
  if (levels->enabled == 0) return;
  const bool same =
      v->rest.step_low == levels->step_low && v->rest.direction_low == levels->direction_low;
  v->rest = *levels;
  drive_enable(v, on == (levels->enabled == BUSHD_ENABLED_HIGH));
  if (!same) drive_rest(v);
  follow_emergency(v);
}

static void port_set_tick(void* context, uint32_t tick_ns) {
  bushd_virtual* v = context;
  v->tick_ns = tick_ns;
}

static void port_adjust_tick(void* context, int32_t ns) {
  bushd_virtual* v = context;
  v->adjust_ns = ns;
}

static uint32_t port_time_in_tick_ns(void* context) {
  const bushd_virtual* v = context;
  return (uint32_t)(own_time(v, v->now_ns) - v->tick_start_own_ns);
}

static bushd_inputs port_read_inputs(void* context) {
  const bushd_virtual* v = context;
  const bool asks = v->config.read_inputs != NULL;
  bushd_inputs inputs = asks ? v->config.read_inputs(v->config.context, v->now_ns) : v->inputs;
  if (v->switched_off && !is_after(v->off_at, inputs)) inputs.system ^= BUSHD_INPUT_EMERGENCY;
  return inputs;
}

static void port_set_trigger(void* context, bushd_edge edge) {
  bushd_virtual* v = context;
  v->trigger_edge = edge;
}

static uint16_t port_read_current(void* context) {
  const bushd_virtual* v = context;
  if (v->config.current != NULL) return v->config.current(v->config.context, v->now_ns);
  return v->current;
}

static void port_set_current(void* context, uint8_t motor, uint16_t ma, bool fast_decay) {
  bushd_virtual* v = context;
  (void)fast_decay;
  v->current_ma[motor] = ma;
}

static uint8_t port_self_test(void* context) {
  const bushd_virtual* v = context;
  return v->failing_tests;
}

static void port_keep_enable(void* context, bool on) {
  bushd_virtual* v = context;
  v->enable_kept = on;
}

static void boot(bushd_virtual* v) {
  const bool has_trigger = (v->config.mcu.disabled_capabilities & BUSHD_CAN_TRIGGER) == 0;
  const bushd_port port = {
      .context = v,
      .transmit = port_transmit,
      .store_address = port_store_address,
      .set_enable = port_set_enable,
      .set_tick = port_set_tick,
      .adjust_tick = port_adjust_tick,
      .time_in_tick_ns = port_time_in_tick_ns,
      .read_inputs = port_read_inputs,
      .read_current = port_read_current,
      .self_test = port_self_test,
      .keep_enable = port_keep_enable,
      .set_trigger = has_trigger ? port_set_trigger : NULL,
      .set_current = v->config.mcu.current_motors > 0 ? port_set_current : NULL};
  v->config.mcu.reset_cause = v->reset_cause;
  v->config.mcu.enable_at_boot = v->enable_kept && v->reset_cause == BUSHD_RESET_WATCHDOG;
  v->enable_kept = false;
  v->reset_cause = BUSHD_RESET_EXTERNAL;
  v->now_ns = v->config.boot_ns;
  v->running = true;
  v->slot_buffer = NULL;
  v->tick_ns = BUSHD_BOOT_TICK_NS;
  v->adjust_ns = 0;
  v->trigger_edge = v->off_at = BUSHD_EDGE_NONE;
  v->switched_off = false;
  memset(v->currents, 0, sizeof v->currents);
  memset(v->current_ma, 0, sizeof v->current_ma);
  memset(v->velocity, 0, sizeof v->velocity);
  begin_tick(v, 0);
  bushd_mcu_boot(&v->mcu, &port, &v->config.mcu);
  load_nvm(v);
  bushd_mcu_prepare(&v->mcu);
}

void bushd_virtual_init(bushd_virtual* v, const bushd_virtual_config* config) {
  assert(config->transmit != NULL);
  assert(config->clock_ppm >= -BUSHD_VIRTUAL_MAX_PPM && config->clock_ppm <= BUSHD_VIRTUAL_MAX_PPM);
  memset(v, 0, sizeof *v);
  v->config = *config;
  v->config.mcu.reply = v->reply;
  v->config.mcu.currents = v->currents;
  v->config.mcu.velocity = v->velocity;
  v->next_event_ns = config->boot_ns;
  v->reset_cause = BUSHD_RESET_POWER_ON;
}

int64_t bushd_virtual_next_event_ns(const bushd_virtual* v) {
  return v->next_event_ns;
}

void bushd_virtual_advance(bushd_virtual* v, int64_t now_ns) {
  assert(now_ns >= v->now_ns);
  while (v->next_event_ns <= now_ns) {
    if (v->running) {
      tick_boundary(v);
    } else {
      boot(v);
    }
  }
  v->now_ns = now_ns;
  if (v->running) emit_slots(v, now_ns);
}

void bushd_virtual_receive(bushd_virtual* v, uint8_t byte, int64_t now_ns) {
  bushd_virtual_advance(v, now_ns);
  if (v->running) bushd_mcu_receive(&v->mcu, byte, (int32_t)port_time_in_tick_ns(v));
}

void bushd_virtual_keypad_byte(bushd_virtual* v, uint8_t byte, int64_t now_ns) {
  bushd_virtual_advance(v, now_ns);
  if (v->running) bushd_mcu_keypad_byte(&v->mcu, byte);
}

void bushd_virtual_keypad_break(bushd_virtual* v, int64_t now_ns) {
  bushd_virtual_advance(v, now_ns);
  if (v->running) bushd_mcu_keypad_break(&v->mcu);
}

int bushd_virtual_keypad_display(bushd_virtual* v) {
  return v->running ? bushd_mcu_keypad_display(&v->mcu) : -1;
}

void bushd_virtual_set_inputs(bushd_virtual* v, bushd_inputs inputs) {
  const uint8_t changed = v->inputs.system ^ inputs.system;
  v->inputs = inputs;
  if (v->running) follow_emergency(v);
  if (!v->running || (changed & BUSHD_INPUT_TRIGGER) == 0) return;
  const bushd_edge edge =
      inputs.system & BUSHD_INPUT_TRIGGER ? BUSHD_EDGE_RISING : BUSHD_EDGE_FALLING;
  if (edge == v->trigger_edge) bushd_mcu_trigger(&v->mcu, (int32_t)port_time_in_tick_ns(v));
}

void bushd_virtual_reset(bushd_virtual* v, int64_t now_ns, int64_t boot_ns, uint16_t boot_number) {
  assert(boot_ns >= now_ns);
  bushd_virtual_advance(v, now_ns);
  if (v->running) {
    turn_for_cut_tick(v);
    v->config.mcu.outputs = v->mcu.config.outputs;
  }
  drive_rest(v);
  drive(v, now_ns, BUSHD_VIRTUAL_DIR, &v->dir_levels, 0);
  drive_compare(v, now_ns, false);
  drive_enable(v, v->config.mcu.outputs.enabled == BUSHD_ENABLED_LOW);
  v->running = false;
  v->config.boot_ns = boot_ns;
  v->config.mcu.boot_number = boot_number;
  v->next_event_ns = boot_ns;
}
