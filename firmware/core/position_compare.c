// The compare output: a pulse, a chosen time after the step with which a motor's counter arrives
// at a chosen position. Steps lie in slots, so the pulse does: it begins within half a slot of its
// time. One pulse at a time; a motor that arrives while one waits or is out makes none.
#include "firmware/core/position_compare.h"

#include "firmware/core/access.h"

enum { PULSE_NONE = 0, PULSE_RISES, PULSE_FALLS };

static bushd_mcu_slots in_slots(const bushd_mcu* mcu, uint32_t us) {
  const uint32_t tick_ns = mcu->tick_ns;
  const uint16_t slot_count = mcu->config.slots;
  const uint32_t ns = us * 1000u;
  // The rest is less than a tick: its product fits.
  const uint64_t scaled = (uint64_t)(ns % tick_ns) * slot_count + tick_ns / 2u;
  bushd_mcu_slots time = {(uint16_t)(ns / tick_ns), (uint16_t)(scaled / tick_ns)};
  if (time.slots == slot_count) {
    time.slots = 0;
    ++time.ticks;
  }
  return time;
}

static void set_width(bushd_mcu* mcu, uint32_t us) {
  bushd_mcu_slots* width = &mcu->position_compare.width;
  *width = in_slots(mcu, us);
  if (width->ticks == 0 && width->slots == 0) width->slots = 1;
}

bushd_status bushd_mcu_take_position_compare(bushd_mcu* mcu,
                                             const bushd_position_compare* message) {
  bushd_mcu_position_compare* compare = &mcu->position_compare;
  if (message->motor >= mcu->config.motors) return BUSHD_E_FORMAT;
  // One that is out ends in its time.
  if (compare->pulse == PULSE_RISES) compare->pulse = PULSE_NONE;
  compare->motor = message->motor & 0xFu;
  compare->arrivals = message->arrivals & 3u;
  compare->position_steps = message->position_steps;
  compare->delay = in_slots(mcu, message->delay_us);
  set_width(mcu, message->width_us);
  return BUSHD_OK;
}

bool bushd_mcu_pulse_now(bushd_mcu* mcu, uint32_t width_us) {
  bushd_mcu_position_compare* compare = &mcu->position_compare;
  if (compare->pulse != PULSE_NONE) return false;
  compare->arrivals = 0;
  set_width(mcu, width_us);
  compare->next.ticks = compare->next.slots = 0;
  compare->pulse = PULSE_RISES;
  return true;
}

static void add(const bushd_mcu* mcu, bushd_mcu_slots* time, const bushd_mcu_slots* more) {
  time->ticks = (uint16_t)(time->ticks + more->ticks);
  time->slots = (uint16_t)(time->slots + more->slots);
  if (time->slots < mcu->config.slots) return;
  time->slots = (uint16_t)(time->slots - mcu->config.slots);
  ++time->ticks;
}

// Where the motor makes its `nth` step (from 1) of this slot_buffer.
static uint16_t slot_of_step(const bushd_mcu* mcu, const bushd_slot_buffer* slot_buffer,
                             uint16_t bit, uint16_t nth) {
  const uint16_t last = (uint16_t)(mcu->config.slots - 1u);
  uint16_t slot = 0;
  while (slot < last && ((slot_buffer->step[slot] & bit) == 0 || --nth != 0)) ++slot;
  return slot;
}

static void look_for_arrival(bushd_mcu* mcu, const bushd_slot_buffer* slot_buffer) {
  bushd_mcu_position_compare* compare = &mcu->position_compare;
  const uint8_t m = compare->motor;
  const int16_t steps = slot_buffer->steps[m];
  const uint8_t wanted = steps > 0 ? BUSHD_ARRIVES_POSITIVE : BUSHD_ARRIVES_NEGATIVE;
  if (steps == 0 || (compare->arrivals & wanted) == 0) return;
  // Unsigned: the counter wraps.
  const uint32_t begin =
      (uint32_t)mcu->motor[m].position_steps + (uint32_t)mcu->slot_buffer[mcu->front].steps[m];
  const uint32_t way = (uint32_t)compare->position_steps - begin;
  const uint32_t nth = steps > 0 ? way : 0u - way;
  const uint16_t made = (uint16_t)(steps > 0 ? steps : -steps);
  if (nth == 0 || nth > made) return;
  compare->next.ticks = 0;
  compare->next.slots = slot_of_step(mcu, slot_buffer, motor_bit(m), (uint16_t)nth);
  add(mcu, &compare->next, &compare->delay);
  compare->pulse = PULSE_RISES;
}

void bushd_mcu_emit_position_compare(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer) {
  bushd_mcu_position_compare* compare = &mcu->position_compare;
  if (compare->pulse == PULSE_NONE) look_for_arrival(mcu, slot_buffer);
  if (compare->pulse == PULSE_RISES && compare->next.ticks == 0) {
    slot_buffer->compare_rise = (uint16_t)(compare->next.slots + 1u);
    add(mcu, &compare->next, &compare->width);
    compare->pulse = PULSE_FALLS;
  }
  if (compare->pulse == PULSE_FALLS && compare->next.ticks == 0) {
    slot_buffer->compare_fall = (uint16_t)(compare->next.slots + 1u);
    compare->pulse = PULSE_NONE;
  }
  if (compare->pulse != PULSE_NONE) --compare->next.ticks;
}
