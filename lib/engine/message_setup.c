// Messages that set an MCU up and tell what it is.
#include <string.h>

#include "engine/cursor.h"
#include "engine/velocity.h"

static void put_id(writer* w, const uint8_t* unique_id) {
  memcpy(w->at, unique_id, BUSHD_UNIQUE_ID_SIZE);
  w->at += BUSHD_UNIQUE_ID_SIZE;
}
static void get_id(reader* r, uint8_t* unique_id) {
  for (uint8_t i = 0; i < BUSHD_UNIQUE_ID_SIZE; ++i) unique_id[i] = get8(r);
}

size_t bushd_encode_identify(const bushd_identify* message, uint8_t* payload) {
  writer w = {payload};
  put16(&w, message->salt);
  put8(&w, message->windows);
  put16(&w, message->window_units);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_identify(const uint8_t* payload, size_t size, bushd_identify* message) {
  reader r = read_from(payload, size);
  message->salt = get16(&r);
  message->windows = get8(&r);
  message->window_units = get16(&r);
  return finish(&r, message->windows >= 1);
}

static uint32_t fnv1a(uint32_t hash, const uint8_t* bytes, uint8_t count) {
  for (uint8_t i = 0; i < count; ++i) hash = (hash ^ bytes[i]) * UINT32_C(16777619);
  return hash;
}

// A CRC would not do: it is linear, so two MCUs that share a window of 2^n would share it whatever
// the salt. Hence FNV-1a and the last mixing of MurmurHash3.
uint8_t bushd_identify_window(const uint8_t* unique_id, uint16_t salt, uint8_t windows) {
  uint8_t bytes[2];
  bushd_put_u16(bytes, salt);
  uint32_t hash = fnv1a(UINT32_C(2166136261), unique_id, BUSHD_UNIQUE_ID_SIZE);
  hash = fnv1a(hash, bytes, sizeof bytes);
  hash = (hash ^ hash >> 16) * UINT32_C(0x85EBCA6B);
  hash = (hash ^ hash >> 13) * UINT32_C(0xC2B2AE35);
  return (uint8_t)((hash ^ hash >> 16) % windows);
}

size_t bushd_encode_identity(const bushd_identity* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->protocol_version);
  put8(&w, message->motors);
  put16(&w, message->firmware_version);
  put16(&w, message->boot_number);
  put16(&w, message->slots);
  put16(&w, message->queue_ticks);
  put16(&w, message->table_codes);
  put32(&w, message->capabilities);
  put_id(&w, message->unique_id);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_identity(const uint8_t* payload, size_t size, bushd_identity* message) {
  reader r = read_from(payload, size);
  memset(message, 0, sizeof *message);
  message->protocol_version = get8(&r);
  if (r.short_of_bytes) return BUSHD_E_LENGTH;
  if (message->protocol_version != BUSHD_PROTOCOL_VERSION) return BUSHD_OK;
  message->motors = get8(&r);
  message->firmware_version = get16(&r);
  message->boot_number = get16(&r);
  message->slots = get16(&r);
  message->queue_ticks = get16(&r);
  message->table_codes = get16(&r);
  message->capabilities = get32(&r);
  get_id(&r, message->unique_id);
  return finish(&r, message->motors >= 1 && message->motors <= BUSHD_MOTORS_PER_MCU);
}

size_t bushd_encode_set_address(const bushd_set_address* message, uint8_t* payload) {
  writer w = {payload};
  put_id(&w, message->unique_id);
  put8(&w, message->address);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_set_address(const uint8_t* payload, size_t size,
                                      bushd_set_address* message) {
  reader r = read_from(payload, size);
  get_id(&r, message->unique_id);
  message->address = get8(&r);
  return finish(&r, message->address != BUSHD_ADDRESS_BROADCAST);
}

size_t bushd_encode_configure(const bushd_configure* message, uint8_t* payload) {
  writer w = {payload};
  put32(&w, message->tick_ns);
  put8(&w, (uint8_t)message->format);
  put16(&w, message->comm_timeout_ticks);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_configure(const uint8_t* payload, size_t size, bushd_configure* message) {
  reader r = read_from(payload, size);
  message->tick_ns = get32(&r);
  const uint8_t format = get8(&r);
  message->format = format == BUSHD_FORMAT_FINE ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE;
  message->comm_timeout_ticks = get16(&r);
  return finish(&r, message->tick_ns >= BUSHD_MIN_TICK_NS &&
                        message->tick_ns <= BUSHD_MAX_TICK_NS && format <= BUSHD_FORMAT_FINE &&
                        message->comm_timeout_ticks >= 1);
}

size_t bushd_encode_emission(const bushd_emission* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->mode);
  put8(&w, message->sequence);
  put8(&w, message->hold_current ? 1 : 0);
  put16(&w, message->step_us);
  put16(&w, message->settle_us);
  put16(&w, message->dir_setup_us);
  put16(&w, message->pulse_us);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_emission(const uint8_t* payload, size_t size, bushd_emission* message) {
  reader r = read_from(payload, size);
  memset(message, 0, sizeof *message);  // two of them may be compared as memory
  message->mode = get8(&r);
  message->sequence = get8(&r);
  const uint8_t hold_current = get8(&r);
  message->hold_current = hold_current != 0;
  message->step_us = get16(&r);
  message->settle_us = get16(&r);
  message->dir_setup_us = get16(&r);
  message->pulse_us = get16(&r);
  const bool has_period = bushd_emission_has_periods(message->mode);
  return finish(&r, message->mode <= BUSHD_EMISSION_COMMON_STAGGERED &&
                        message->sequence <= BUSHD_PHASES_THREE && hold_current <= 1 &&
                        (!has_period || message->step_us >= 1));
}

size_t bushd_encode_table_begin(const bushd_table_begin* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->bank);
  put16(&w, message->accel_count);
  put16(&w, message->decel_count);
  put16(&w, message->cruise);
  put32(&w, message->time_unit_ns);
  put32(&w, message->revision);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_begin(const uint8_t* payload, size_t size,
                                      bushd_table_begin* message) {
  reader r = read_from(payload, size);
  message->bank = get8(&r);
  message->accel_count = get16(&r);
  message->decel_count = get16(&r);
  message->cruise = get16(&r);
  message->time_unit_ns = get32(&r);
  message->revision = get32(&r);
  return finish(&r, message->bank <= BUSHD_SCRATCH_BANK && message->accel_count >= 1 &&
                        message->cruise >= 1 && message->time_unit_ns >= 1);
}

size_t bushd_encode_table_data(uint8_t bank, uint16_t offset, uint8_t count, const uint16_t* codes,
                               uint8_t* payload) {
  writer w = {payload};
  put8(&w, bank);
  put16(&w, offset);
  put8(&w, count);
  for (uint8_t i = 0; i < count; ++i) put16(&w, codes[i]);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_data(const uint8_t* payload, size_t size,
                                     bushd_table_data* message) {
  reader r = read_from(payload, size);
  message->bank = get8(&r);
  message->offset = get16(&r);
  message->count = get8(&r);
  message->codes = take(&r, 2u * message->count);
  return finish(&r, message->bank <= BUSHD_SCRATCH_BANK && message->count >= 1 &&
                        message->count <= BUSHD_TABLE_DATA_MAX_CODES);
}

size_t bushd_encode_table_end(const bushd_table_end* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->bank);
  put32(&w, message->crc);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_end(const uint8_t* payload, size_t size, bushd_table_end* message) {
  reader r = read_from(payload, size);
  message->bank = get8(&r);
  message->crc = get32(&r);
  return finish(&r, message->bank <= BUSHD_SCRATCH_BANK);
}

size_t bushd_encode_tables(const bushd_tables* message, uint8_t* payload) {
  writer w = {payload + 1};
  uint8_t valid = 0;
  for (uint8_t i = 0; i < BUSHD_TABLE_BANKS; ++i) {
    const bushd_table_held* held = &message->bank[i];
    if (held->valid) valid = (uint8_t)(valid | 1u << i);
    put32(&w, held->crc);
    put32(&w, held->revision);
  }
  payload[0] = valid;
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_tables(const uint8_t* payload, size_t size, bushd_tables* message) {
  reader r = read_from(payload, size);
  const uint8_t valid = get8(&r);
  for (uint8_t i = 0; i < BUSHD_TABLE_BANKS; ++i) {
    message->bank[i].valid = ((unsigned)valid >> i & 1u) != 0;
    message->bank[i].crc = get32(&r);
    message->bank[i].revision = get32(&r);
  }
  return finish(&r, true);
}

size_t bushd_encode_assign(const bushd_assign* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put8(&w, message->bank);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_assign(const uint8_t* payload, size_t size, bushd_assign* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->bank = get8(&r);
  return finish(&r, message->motor < BUSHD_MOTORS_PER_MCU && message->bank < BUSHD_TABLE_BANKS);
}

size_t bushd_encode_control(const bushd_control* message, uint8_t* payload) {
  payload[0] = message->actions;
  payload[1] = message->faults;
  return message->faults == 0 ? 1 : 2;
}

bushd_status bushd_decode_control(const uint8_t* payload, size_t size, bushd_control* message) {
  reader r = read_from(payload, size);
  message->actions = get8(&r);
  const bool named = size > 1;
  message->faults = named ? get8(&r) : 0;
  const uint8_t both = BUSHD_CONTROL_ENABLE | BUSHD_CONTROL_DISABLE;
  return finish(
      &r, message->actions <= (both | BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_FORGET_TABLES) &&
              (message->actions & both) != both &&
              (!named ||
               (message->faults != 0 && (message->actions & BUSHD_CONTROL_CLEAR_FAULTS) != 0)));
}

size_t bushd_encode_set_position(const bushd_set_position* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put32(&w, (uint32_t)message->position_steps);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_set_position(const uint8_t* payload, size_t size,
                                       bushd_set_position* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->position_steps = (int32_t)get32(&r);
  return finish(&r, message->motor < BUSHD_MOTORS_PER_MCU);
}

size_t bushd_encode_set_inputs(const bushd_set_inputs* message, uint8_t* payload) {
  writer w = {payload};
  put16(&w, message->limit_positive);
  put16(&w, message->limit_negative);
  put16(&w, message->limit_immediate);
  put16(&w, message->inverted);
  put8(&w, message->debounce_ticks);
  put8(&w, message->system_inverted);
  put8(&w, message->emergency);
  put16(&w, message->overcurrent);
  put8(&w, message->enable_after_watchdog ? 1 : 0);
  return (size_t)(w.at - payload);
}

size_t bushd_encode_set_outputs(const bushd_set_outputs* message, uint8_t* payload) {
  writer w = {payload};
  put16(&w, message->step_low);
  put16(&w, message->direction_low);
  put8(&w, message->enabled);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_set_outputs(const uint8_t* payload, size_t size,
                                      bushd_set_outputs* message) {
  reader r = read_from(payload, size);
  message->step_low = get16(&r);
  message->direction_low = get16(&r);
  message->enabled = get8(&r);
  return finish(&r,
                message->enabled == BUSHD_ENABLED_HIGH || message->enabled == BUSHD_ENABLED_LOW);
}

bushd_status bushd_decode_set_inputs(const uint8_t* payload, size_t size,
                                     bushd_set_inputs* message) {
  reader r = read_from(payload, size);
  message->limit_positive = get16(&r);
  message->limit_negative = get16(&r);
  message->limit_immediate = get16(&r);
  message->inverted = get16(&r);
  message->debounce_ticks = get8(&r);
  message->system_inverted = get8(&r);
  message->emergency = get8(&r);
  message->overcurrent = get16(&r);
  const uint8_t enable = get8(&r);
  message->enable_after_watchdog = enable == 1;
  return finish(&r, message->debounce_ticks <= BUSHD_MAX_DEBOUNCE_TICKS &&
                        message->system_inverted <= BUSHD_SYSTEM_INPUTS &&
                        message->emergency <= BUSHD_EMERGENCY_INPUT_DISABLE &&
                        message->overcurrent <= BUSHD_MAX_CURRENT && enable <= 1);
}

size_t bushd_encode_motor_inputs(const bushd_motor_inputs* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put8(&w, message->positive);
  put8(&w, message->negative);
  put8(&w, message->home);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_motor_inputs(const uint8_t* payload, size_t size,
                                       bushd_motor_inputs* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->positive = get8(&r);
  message->negative = get8(&r);
  message->home = get8(&r);
  return finish(
      &r, message->motor < BUSHD_MOTORS_PER_MCU && message->positive < BUSHD_MOTORS_PER_MCU &&
              message->negative < BUSHD_MOTORS_PER_MCU && message->home < BUSHD_MOTORS_PER_MCU);
}

size_t bushd_encode_currents(const bushd_currents* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put8(&w, message->decay);
  put16(&w, message->ramp_ma);
  put16(&w, message->cruise_ma);
  put16(&w, message->hold_ma);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_currents(const uint8_t* payload, size_t size, bushd_currents* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->decay = get8(&r);
  message->ramp_ma = get16(&r);
  message->cruise_ma = get16(&r);
  message->hold_ma = get16(&r);
  const bool none = (message->ramp_ma | message->cruise_ma | message->hold_ma) == 0;
  const bool all = message->ramp_ma != 0 && message->cruise_ma != 0 && message->hold_ma != 0;
  return finish(&r, message->motor < BUSHD_MOTORS_PER_MCU && message->decay <= BUSHD_DECAY_FAST &&
                        (none || all) && message->ramp_ma <= BUSHD_MAX_CURRENT_MA &&
                        message->cruise_ma <= BUSHD_MAX_CURRENT_MA &&
                        message->hold_ma <= BUSHD_MAX_CURRENT_MA);
}

size_t bushd_encode_set_velocity(const bushd_set_velocity* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put32(&w, (uint32_t)message->least);
  put32(&w, (uint32_t)message->most);
  put32(&w, (uint32_t)message->acceleration);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_set_velocity(const uint8_t* payload, size_t size,
                                       bushd_set_velocity* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->least = (int32_t)get32(&r);
  message->most = (int32_t)get32(&r);
  message->acceleration = (int32_t)get32(&r);
  const bool none = (message->least | message->most | message->acceleration) == 0;
  const bool all = message->least >= BUSHD_VELOCITY_LEAST && message->most >= message->least &&
                   message->most <= BUSHD_VELOCITY_MOST && message->acceleration >= 1 &&
                   message->acceleration <= BUSHD_VELOCITY_MOST;
  return finish(&r, message->motor < BUSHD_MOTORS_PER_MCU && (none || all));
}

size_t bushd_encode_acknowledgement(const bushd_acknowledgement* message, uint8_t* payload) {
  payload[0] = message->status;
  return 1;
}

bushd_status bushd_decode_acknowledgement(const uint8_t* payload, size_t size,
                                          bushd_acknowledgement* message) {
  reader r = read_from(payload, size);
  message->status = get8(&r);
  return finish(&r, true);
}
