#include "firmware/core/mcu.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/assertion.h"
#include "firmware/core/currents.h"
#include "firmware/core/drivers.h"
#include "firmware/core/emission.h"
#include "firmware/core/homing.h"
#include "firmware/core/inputs.h"
#include "firmware/core/line_run.h"
#include "firmware/core/local.h"
#include "firmware/core/motor.h"
#include "firmware/core/program_run.h"
#include "firmware/core/requests.h"
#include "firmware/core/state.h"
#include "firmware/core/stop.h"
#include "firmware/core/stream.h"
#include "firmware/core/sync.h"
#include "firmware/core/travel.h"
#include "firmware/core/trigger.h"

#define STALE_SEQUENCES 128u
#define STALE_NS 100000000u  // no line or adapter keeps a frame back for so long

// The engine against known answers: a wrong compiler, a broken flash cell or bad RAM shows here
// before a motor can move by it.
static bool engine_self_test(bushd_mcu* mcu) {
  // Not as constants, which would take RAM for good on some MCUs.
  uint8_t digits[9];
  for (uint8_t i = 0; i < sizeof digits; ++i) digits[i] = (uint8_t)('1' + i);
  if (~bushd_crc32(BUSHD_CRC32_START, digits, sizeof digits) != 0xCBF43926) return false;
  uint16_t codes[3];
  for (uint8_t i = 0; i < 3; ++i) codes[i] = (uint16_t)(4u - i);
  bushd_table table;
  memset(&table, 0, sizeof table);
  table.accel.code = codes;
  table.accel.count = 3;
  table.decel = table.accel;
  table.cruise = 2;
  table.time_unit_ns = 1;
  // Delays 4 3 2 3 4: steps at 4, 7, 9, 12, 16; ticks of 6 end at 6, 12, 18.
  bushd_run run;
  uint8_t counts[3];
  bushd_run_start(&run, &table, 5, 1, 0);
  if (bushd_run_expand_coarse(&run, 6, 3, counts, 1) != 3) return false;
  if (counts[0] != 0x81 || counts[1] != 0x83 || counts[2] != 0x81) return false;
  // Two steps in a tick lie at a quarter and at three quarters of it.
  uint16_t* const masks = mcu->slot_buffer[0].step;
  int16_t remainder = 0;
  const uint16_t slots = mcu->config.slots;
  const int16_t steps = bushd_slots_add(masks, slots, 1, 512, &remainder, BUSHD_CROSSING_COARSE);
  const bool good =
      steps == 2 && masks[slots / 4] == 1 && masks[3 * slots / 4] == 1 && remainder == 0;
  memset(masks, 0, sizeof mcu->slot_buffer[0].step);
  return good;
}

void bushd_mcu_boot(bushd_mcu* mcu, const bushd_port* port, const bushd_mcu_config* config) {
  memset(mcu, 0, sizeof *mcu);
  mcu->port = *port;
  mcu->config = *config;
  if (config->scratch != NULL) memset(config->scratch, 0, sizeof *config->scratch);
#if BUSHD_PROGRAMS
  bushd_mcu_boot_program(mcu);
#endif
  mcu->tick_ns = BUSHD_BOOT_TICK_NS;
  mcu->low_water_ticks = mcu->reports.low_water_ticks = UINT16_MAX;
  bushd_mcu_drive_enable(mcu);
  port->set_tick(port->context, mcu->tick_ns);
  for (uint8_t m = 0; m < config->motors; ++m) mcu->motor[m].table = -1;
  bushd_mcu_clear_streams(mcu);
  bushd_mcu_default_emission(mcu);
  bushd_mcu_default_switches(mcu);
  mcu->failed_tests = port->self_test(port->context);
  if (!engine_self_test(mcu)) mcu->failed_tests |= BUSHD_TEST_ENGINE;
  if (mcu->failed_tests & BUSHD_TEST_EEPROM) mcu->faults |= BUSHD_FAULT_EEPROM;
  if (mcu->failed_tests & (uint8_t)~BUSHD_TEST_EEPROM) mcu->faults |= BUSHD_FAULT_SELF_TEST;
  if (config->enable_at_boot && (mcu->faults & BUSHD_FAULT_SELF_TEST) == 0) {
    mcu->flags |= BUSHD_FLAG_ENABLED;
    bushd_mcu_drive_enable(mcu);
    // Until settings say otherwise: there may be another reset before a master tells them.
    port->keep_enable(port->context, true);
  }
  bushd_mcu_update_state(mcu);
}

#ifndef BUSHD_OWN_ADD_STEPS
void bushd_mcu_add_steps(int32_t* counter, size_t stride, const int16_t* steps, uint8_t motors) {
  for (; motors > 0; --motors, counter = (int32_t*)(void*)((char*)counter + stride)) {
    // Unsigned: the counter may be set to any value, and then wraps.
    *counter = (int32_t)((uint32_t)*counter + (uint32_t)*steps++);
  }
}
#endif

const bushd_slot_buffer* bushd_mcu_swap(bushd_mcu* mcu) {
  const bushd_slot_buffer* ended = &mcu->slot_buffer[mcu->front];
  if (ended->active != 0) {
    bushd_mcu_add_steps(&mcu->motor[0].position_steps, sizeof mcu->motor[0], ended->steps,
                        mcu->config.motors);
    mcu->reports.moved |= ended->active;
  }
  mcu->front ^= 1u;
  ++mcu->tick;
  ++mcu->uptime;
  mcu->reception.silent_ticks = saturating_increment(mcu->reception.silent_ticks);
  bushd_mcu_slew(mcu);
  return &mcu->slot_buffer[mcu->front];
}

void bushd_mcu_trigger(bushd_mcu* mcu, int32_t time_in_tick_ns) {
  if (mcu->trigger.armed != 0) {
    bushd_mcu_begin_armed(mcu, time_in_tick_ns);
  } else if (mcu->travel.stage == BUSHD_TRAVEL_ARMED) {
    bushd_mcu_travel_at_edge(mcu, time_in_tick_ns);
  }
}

static void move_by_itself(bushd_mcu* mcu) {
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  bushd_mcu_go_home(mcu, pins.motors ^ mcu->inputs.inverted);
  bushd_mcu_go_travel(mcu, pins.motors ^ mcu->inputs.inverted);
  if ((mcu->local.settings.motors | mcu->local.settings.keypad) != 0) {
    bushd_mcu_move_locally(mcu, pins.system ^ mcu->inputs.system_inverted);
  }
}

void bushd_mcu_prepare(bushd_mcu* mcu) {
  bushd_mcu_finish_row(mcu, mcu->tick + 1u);
  bushd_mcu_watch_inputs(mcu);
  const uint16_t by_people = mcu->local.settings.motors | mcu->local.settings.keypad;
  if ((mcu->autonomous | by_people) != 0) move_by_itself(mcu);
  bushd_mcu_watch_comm_timeout(mcu);
#if BUSHD_PROGRAMS
  if (bushd_mcu_program_motors(mcu) != 0) bushd_mcu_go_on_with_program(mcu);
#endif
  bushd_mcu_emit(mcu, &mcu->slot_buffer[mcu->front ^ 1u]);
  bushd_mcu_choose_currents(mcu);
  if (mcu->autonomous != 0) mcu->autonomous &= bushd_mcu_moving(mcu);
  if (mcu->trigger.armed != 0 && mcu->faults != 0) bushd_mcu_disarm(mcu, BUSHD_TRIGGER_FAULT);
  bushd_mcu_update_state(mcu);
}

// What a line or an adapter has kept back, or made twice, must not undo what was asked later: a
// position, drivers that were switched off, a start that was planned anew. Emergency stops always
// count, SYNCs have ids of their own, and questions change nothing.
static bool counts_in_order_only(uint8_t type) {
  switch (type) {
    case BUSHD_MSG_SET_ADDRESS:
      BUSHD_SETUP_REQUESTS(BUSHD_CASE)
      BUSHD_MOTION_REQUESTS(BUSHD_CASE)
      BUSHD_PROGRAM_REQUESTS(BUSHD_CASE)
      BUSHD_STREAMED(BUSHD_CASE)
      return true;
    default:
      return false;
  }
}

// The master counts its frames in their sequences. So one whose sequence is the newest or one of
// those before it has been heard, or was overtaken. After silence another master may have begun.
static bool is_stale(bushd_mcu* mcu, const bushd_frame* frame) {
  const uint8_t age = (uint8_t)(mcu->reception.newest_sequence - frame->sequence);
  if (mcu->reception.frames_heard && age < STALE_SEQUENCES &&
      mcu->uptime - mcu->reception.newest_uptime <= STALE_NS / mcu->tick_ns) {
    return true;
  }
  mcu->reception.frames_heard = true;
  mcu->reception.newest_sequence = frame->sequence;
  mcu->reception.newest_uptime = mcu->uptime;
  return false;
}

void bushd_mcu_receive(bushd_mcu* mcu, uint8_t byte, int32_t time_in_tick_ns) {
  bushd_mcu_finish_rows(mcu);
  BUSHD_ASSERT(bushd_mcu_owner_of_buffer(mcu) == BUSHD_MCU_BUFFER_RECEIVER);
  bushd_frame frame;
  switch (bushd_receive_byte(&mcu->receiver, byte, &frame)) {
    case BUSHD_RECEIVE_MORE:
      return;
    case BUSHD_RECEIVE_BAD_CRC:
    case BUSHD_RECEIVE_BAD_LENGTH:
      mcu->reception.bad_frames = saturating_increment(mcu->reception.bad_frames);
      bushd_mcu_tell(mcu, BUSHD_TELLS_COUNTERS);
      return;
    case BUSHD_RECEIVE_FRAME:
      break;
  }
  // Replies of other MCUs pass by on the same line.
  if (frame.type & BUSHD_TYPE_REPLY) return;
  const bool stale = is_stale(mcu, &frame);
  if (frame.address != mcu->config.address && frame.address != BUSHD_ADDRESS_BROADCAST) return;
  if (stale && counts_in_order_only(frame.type)) {
    bushd_mcu_reject(mcu, BUSHD_E_LATE);
    return;
  }
  mcu->reception.silent_ticks = 0;
  bushd_mcu_handle_frame(mcu, &frame, time_in_tick_ns);
}

// The port's background work: what a frame has left to do, the most urgent first.
bool bushd_mcu_work(bushd_mcu* mcu) {
  if (mcu->stream.queue_summary.stale) {
    bushd_mcu_summarise_queue(mcu, bushd_mcu_first_open(mcu));
    return true;
  }
  return bushd_mcu_go_on_answering(mcu) || bushd_mcu_put_next_row(mcu) ||
         (mcu->line.unplaced != 0 && bushd_mcu_place_on_line(mcu));
}
