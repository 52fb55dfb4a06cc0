// POLL and what it is answered by, REPORT (engine/message_motion.h).
#include "engine/cursor.h"

#define POLL_ENTRY 3u

size_t bushd_encode_poll(const bushd_poll_entry* entries, uint8_t count, uint8_t* payload) {
  writer w = {payload};
  put8(&w, count);
  for (uint8_t i = 0; i < count; ++i) {
    put8(&w, entries[i].address);
    put16(&w, entries[i].begin_units);
  }
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_poll(const uint8_t* payload, size_t size, bushd_poll* message) {
  reader r = read_from(payload, size);
  message->count = get8(&r);
  message->entries = take(&r, (size_t)message->count * POLL_ENTRY);
  return finish(&r, message->count >= 1);
}

bool bushd_poll_find(const bushd_poll* poll, uint8_t address, bushd_poll_entry* entry) {
  for (uint8_t i = 0; i < poll->count; ++i) {
    const uint8_t* const at = poll->entries + (size_t)i * POLL_ENTRY;
    if (at[0] != address) continue;
    entry->address = address;
    entry->begin_units = bushd_get_u16(at + 1);
    return true;
  }
  return false;
}

size_t bushd_encode_report(const bushd_report* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->state);
  put8(&w, message->faults);
  put8(&w, message->flags);
  put8(&w, message->epoch);
  put16(&w, message->boot_number);
  put32(&w, message->tick);
  put32(&w, message->tick_ns);
  put32(&w, message->sync_id);
  put32(&w, message->sync_tick);
  put32(&w, message->sync_ns);
  put32(&w, (uint32_t)message->rate_ppb);
  put16(&w, message->moving);
  put16(&w, message->running);
  put16(&w, message->inputs);
  put16(&w, message->bad_frames);
  put16(&w, message->rejected_frames);
  put8(&w, message->last_rejection);
  put16(&w, message->ramp_downs);
  put16(&w, message->low_water_ticks);
  put16(&w, message->out_of_order);
  put16(&w, message->out_of_order_from);
  put16(&w, message->out_of_order_until);
  put16(&w, message->forbidden_positive);
  put16(&w, message->forbidden_negative);
  put8(&w, message->system_inputs);
  put16(&w, message->current);
  put8(&w, message->reset_cause);
  put8(&w, message->failed_tests);
  put16(&w, message->autonomous);
  put16(&w, message->homed);
  put8(&w, message->homing);
  put16(&w, message->armed);
  put8(&w, message->trigger_number);
  put8(&w, message->trigger_state);
  put32(&w, message->start_tick);
  put32(&w, message->start_ns);
  put8(&w, message->motor_count);
  for (uint8_t i = 0; i < message->motor_count; ++i) {
    put32(&w, (uint32_t)message->motor[i].position_steps);
    put16(&w, message->motor[i].known_until);
  }
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_report(const uint8_t* payload, size_t size, bushd_report* message) {
  reader r = read_from(payload, size);
  message->state = get8(&r);
  message->faults = get8(&r);
  message->flags = get8(&r);
  message->epoch = get8(&r);
  message->boot_number = get16(&r);
  message->tick = get32(&r);
  message->tick_ns = get32(&r);
  message->sync_id = get32(&r);
  message->sync_tick = get32(&r);
  message->sync_ns = get32(&r);
  message->rate_ppb = (int32_t)get32(&r);
  message->moving = get16(&r);
  message->running = get16(&r);
  message->inputs = get16(&r);
  message->bad_frames = get16(&r);
  message->rejected_frames = get16(&r);
  message->last_rejection = get8(&r);
  message->ramp_downs = get16(&r);
  message->low_water_ticks = get16(&r);
  message->out_of_order = get16(&r);
  message->out_of_order_from = get16(&r);
  message->out_of_order_until = get16(&r);
  message->forbidden_positive = get16(&r);
  message->forbidden_negative = get16(&r);
  message->system_inputs = get8(&r);
  message->current = get16(&r);
  message->reset_cause = get8(&r);
  message->failed_tests = get8(&r);
  message->autonomous = get16(&r);
  message->homed = get16(&r);
  message->homing = get8(&r);
  message->armed = get16(&r);
  message->trigger_number = get8(&r);
  message->trigger_state = get8(&r);
  message->start_tick = get32(&r);
  message->start_ns = get32(&r);
  message->motor_count = get8(&r);
  if (message->motor_count > BUSHD_MOTORS_PER_MCU) return BUSHD_E_FORMAT;
  for (uint8_t i = 0; i < message->motor_count; ++i) {
    message->motor[i].position_steps = (int32_t)get32(&r);
    message->motor[i].known_until = get16(&r);
  }
  return finish(
      &r, message->state <= BUSHD_STATE_FAULT && message->trigger_state <= BUSHD_TRIGGER_FORBIDDEN);
}
