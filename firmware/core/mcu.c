#include "firmware/core/mcu.h"

#include <string.h>

#include "firmware/core/internal.h"

uint16_t bushd_mcu_moving(const bushd_mcu* mcu) {
  uint16_t moving = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    const bushd_mcu_motor* motor = &mcu->motor[m];
    const bool queued = ticks_after(motor->known_until, mcu->tick + 2u) > 0;
    const bool emitted = ((mcu->plane[0].active | mcu->plane[1].active) & motor_bit(m)) != 0;
    if (motor->running_down || motor->delay != 0 || queued || emitted) moving |= motor_bit(m);
  }
  return moving;
}

void bushd_mcu_update_state(bushd_mcu* mcu) {
  const uint8_t ready = BUSHD_FLAG_CONFIGURED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_ENABLED;
  if (mcu->faults != 0) {
    mcu->state = BUSHD_STATE_FAULT;
  } else if ((mcu->flags & ready) != ready) {
    mcu->state = BUSHD_STATE_BUSY;
  } else {
    mcu->state = bushd_mcu_moving(mcu) != 0 ? BUSHD_STATE_RUN : BUSHD_STATE_READY;
  }
}

// The engine against known answers: a wrong compiler, a broken flash cell or bad RAM shows here
// before a motor can move by it.
static bool engine_self_test(bushd_mcu* mcu) {
  static const uint8_t kDigits[9] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  static const uint16_t kCodes[3] = {4, 3, 2};
  if (bushd_crc16(BUSHD_CRC16_START, kDigits, sizeof kDigits) != 0x29B1) return false;
  bushd_table table;
  memset(&table, 0, sizeof table);
  table.accel.code = kCodes;
  table.accel.count = 3;
  table.decel = table.accel;
  table.cruise = 2;
  table.time_unit_ns = 1;
  // Delays 4 3 2 3 4: steps at 4, 7, 9, 12, 16; ticks of 6 end at 6, 12, 18.
  bushd_run run;
  uint8_t counts[3];
  bushd_run_start(&run, &table, 5, 1);
  if (bushd_run_expand_coarse(&run, 6, 3, counts, 1) != 3) return false;
  if (counts[0] != 0x81 || counts[1] != 0x83 || counts[2] != 0x81) return false;
  // Two steps in a tick lie at a quarter and at three quarters of it.
  uint16_t* const masks = mcu->plane[0].step;
  int16_t remainder = 0;
  const uint16_t slots = mcu->config.slots;
  if (bushd_slots_add(masks, slots, 1, 512, &remainder, BUSHD_CROSSING_COARSE) != 2) return false;
  const bool good = masks[slots / 4] == 1 && masks[3 * slots / 4] == 1 && remainder == 0;
  memset(masks, 0, sizeof mcu->plane[0].step);
  return good;
}

void bushd_mcu_boot(bushd_mcu* mcu, const bushd_port* port, const bushd_mcu_config* config) {
  memset(mcu, 0, sizeof *mcu);
  mcu->port = *port;
  mcu->config = *config;
  mcu->tick_ns = BUSHD_BOOT_TICK_NS;
  port->set_enable(port->context, false);
  port->set_tick(port->context, mcu->tick_ns);
  for (uint8_t m = 0; m < config->motors; ++m) mcu->motor[m].table = -1;
  bushd_mcu_clear_streams(mcu);
  if (!engine_self_test(mcu) || !port->self_test(port->context)) {
    mcu->faults |= BUSHD_FAULT_SELF_TEST;
  }
  bushd_mcu_update_state(mcu);
}

const bushd_plane* bushd_mcu_swap(bushd_mcu* mcu) {
  const bushd_plane* ended = &mcu->plane[mcu->front];
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    // Unsigned: the counter may be set to any value, and then wraps.
    const uint32_t position = (uint32_t)mcu->motor[m].position_steps + (uint32_t)ended->steps[m];
    mcu->motor[m].position_steps = (int32_t)position;
  }
  mcu->front ^= 1u;
  ++mcu->tick;
  bushd_mcu_slew(mcu);
  return &mcu->plane[mcu->front];
}

void bushd_mcu_prepare(bushd_mcu* mcu) {
  bushd_plane* plane = &mcu->plane[mcu->front ^ 1u];
  memset(plane->step, 0, mcu->config.slots * sizeof plane->step[0]);
  plane->active = 0;
  const int16_t crossing =
      mcu->format == BUSHD_FORMAT_FINE ? BUSHD_CROSSING_FINE : BUSHD_CROSSING_COARSE;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    const int16_t displacement = bushd_mcu_next_displacement(mcu, m, mcu->tick + 1u);
    plane->steps[m] = 0;
    if (displacement == 0) continue;
    const uint16_t bit = motor_bit(m);
    if (displacement > 0) {
      mcu->direction |= bit;
    } else {
      mcu->direction &= (uint16_t)~bit;
    }
    plane->steps[m] = bushd_slots_add(plane->step, mcu->config.slots, bit, displacement,
                                      &mcu->motor[m].remainder, crossing);
    if (plane->steps[m] != 0) plane->active |= bit;
  }
  plane->direction = mcu->direction;
  bushd_mcu_update_state(mcu);
}

static uint16_t saturating_increment(uint16_t value) {
  return value < UINT16_MAX ? (uint16_t)(value + 1u) : value;
}

static size_t encode_report(bushd_mcu* mcu, uint8_t* payload) {
  bushd_mcu_update_state(mcu);
  bushd_report report;
  report.state = mcu->state;
  report.faults = mcu->faults;
  report.flags = mcu->flags;
  report.epoch = mcu->epoch;
  report.boot_number = mcu->config.boot_number;
  report.tick = mcu->tick;
  report.tick_ns = mcu->port.time_in_tick_ns(mcu->port.context);
  report.mark_tag = mcu->mark_tag;
  report.mark_tick = mcu->mark_tick;
  report.mark_ns = mcu->mark_ns;
  report.moving = bushd_mcu_moving(mcu);
  report.inputs = mcu->port.read_inputs(mcu->port.context);
  report.bad_frames = mcu->bad_frames;
  report.rejected_frames = mcu->rejected_frames;
  report.last_rejection = mcu->last_rejection;
  report.motor_count = mcu->config.motors;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    report.motor[m].position_steps = mcu->motor[m].position_steps;
    report.motor[m].known_until = (uint16_t)mcu->motor[m].known_until;
  }
  return bushd_encode_report(&report, payload);
}

static size_t encode_identity(const bushd_mcu* mcu, uint8_t* payload) {
  bushd_identity identity;
  identity.protocol_version = BUSHD_PROTOCOL_VERSION;
  identity.motors = mcu->config.motors;
  identity.firmware_version = BUSHD_FIRMWARE_VERSION;
  identity.boot_number = mcu->config.boot_number;
  identity.slots = mcu->config.slots;
  identity.queue_ticks = mcu->config.queue_ticks;
  identity.table_codes = mcu->config.code_count;
  return bushd_encode_identity(&identity, payload);
}

static bushd_status configure(bushd_mcu* mcu, const bushd_configure* message) {
  const bool same = (mcu->flags & BUSHD_FLAG_CONFIGURED) != 0 && mcu->tick_ns == message->tick_ns &&
                    mcu->format == message->format;
  if (same) return BUSHD_OK;
  if (bushd_mcu_moving(mcu) != 0) return BUSHD_E_STATE;
  mcu->tick_ns = message->tick_ns;
  mcu->format = message->format;
  // Another tick length is another time: the MCU must be told the bus's tick again, and its tables
  // be checked against it again.
  mcu->flags =
      (uint8_t)((mcu->flags | BUSHD_FLAG_CONFIGURED) & ~(BUSHD_FLAG_SYNCED | BUSHD_FLAG_MARK));
  mcu->behind_ns = 0;
  mcu->settling = 2;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    mcu->motor[m].table = -1;
    mcu->motor[m].remainder = 0;
  }
  mcu->port.set_tick(mcu->port.context, mcu->tick_ns);
  return BUSHD_OK;
}

static bushd_status control(bushd_mcu* mcu, const bushd_control* message) {
  const uint8_t at_rest_only = BUSHD_CONTROL_DISABLE | BUSHD_CONTROL_CLEAR_FAULTS;
  if ((message->actions & at_rest_only) != 0 && bushd_mcu_moving(mcu) != 0) return BUSHD_E_STATE;
  if (message->actions & BUSHD_CONTROL_CLEAR_FAULTS) mcu->faults &= BUSHD_FAULT_SELF_TEST;
  if (message->actions & BUSHD_CONTROL_DISABLE) {
    mcu->flags &= (uint8_t)~BUSHD_FLAG_ENABLED;
    mcu->port.set_enable(mcu->port.context, false);
  }
  if (message->actions & BUSHD_CONTROL_ENABLE) {
    if (mcu->faults & BUSHD_FAULT_SELF_TEST) return BUSHD_E_STATE;
    mcu->flags |= BUSHD_FLAG_ENABLED;
    mcu->port.set_enable(mcu->port.context, true);
  }
  return BUSHD_OK;
}

static bushd_status set_position(bushd_mcu* mcu, const bushd_set_position* message) {
  if (message->motor >= mcu->config.motors) return BUSHD_E_FORMAT;
  if (bushd_mcu_moving(mcu) & motor_bit(message->motor)) return BUSHD_E_STATE;
  mcu->motor[message->motor].position_steps = message->position_steps;
  mcu->motor[message->motor].remainder = 0;
  return BUSHD_OK;
}

// Decodes into a local and hands it to the function that acts; a decoding error is the answer as it
// is.
#define HANDLE(kind, act)                                                   \
  do {                                                                      \
    bushd_##kind message;                                                   \
    const bushd_status decoded =                                            \
        bushd_decode_##kind(frame->payload, frame->payload_size, &message); \
    return decoded == BUSHD_OK ? act(mcu, &message) : decoded;              \
  } while (0)

static bushd_status handle_request(bushd_mcu* mcu, const bushd_frame* frame) {
  switch (frame->type) {
    case BUSHD_MSG_CONFIGURE:
      HANDLE(configure, configure);
    case BUSHD_MSG_TABLE_BEGIN:
      HANDLE(table_begin, bushd_mcu_table_begin);
    case BUSHD_MSG_TABLE_DATA:
      HANDLE(table_data, bushd_mcu_table_data);
    case BUSHD_MSG_TABLE_END:
      HANDLE(table_end, bushd_mcu_table_end);
    case BUSHD_MSG_ASSIGN:
      HANDLE(assign, bushd_mcu_assign);
    case BUSHD_MSG_CONTROL:
      HANDLE(control, control);
    case BUSHD_MSG_SET_POSITION:
      HANDLE(set_position, set_position);
    case BUSHD_MSG_TICKS:
      HANDLE(ticks, bushd_mcu_take_ticks);
    default:
      return BUSHD_E_UNKNOWN_MESSAGE;
  }
}

static void handle_frame(bushd_mcu* mcu, const bushd_frame* frame, uint32_t time_in_tick_ns) {
  if (frame->type == BUSHD_MSG_SYNC) {
    bushd_sync sync;
    if (bushd_decode_sync(frame->payload, frame->payload_size, &sync) == BUSHD_OK) {
      bushd_mcu_sync(mcu, frame->tag, &sync, time_in_tick_ns);
    }
    return;
  }
  uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
  size_t size = 0;
  if (frame->type == BUSHD_MSG_IDENTIFY || frame->type == BUSHD_MSG_POLL) {
    if (frame->address == BUSHD_ADDRESS_BROADCAST) return;
    size =
        frame->type == BUSHD_MSG_POLL ? encode_report(mcu, payload) : encode_identity(mcu, payload);
  } else {
    const bushd_status status = handle_request(mcu, frame);
    if (status != BUSHD_OK) {
      mcu->rejected_frames = saturating_increment(mcu->rejected_frames);
      mcu->last_rejection = (uint8_t)status;
    }
    if (frame->type == BUSHD_MSG_TICKS || frame->address == BUSHD_ADDRESS_BROADCAST) return;
    const bushd_acknowledgement acknowledgement = {(uint8_t)status};
    size = bushd_encode_acknowledgement(&acknowledgement, payload);
  }
  // A delimiter comes first: it ends whatever the master took, while the line was idle, for a
  // frame's beginning.
  mcu->reply[0] = 0;
  const size_t wire =
      bushd_frame_encode(mcu->config.address, (uint8_t)(frame->type | BUSHD_TYPE_REPLY), frame->tag,
                         payload, size, mcu->reply + 1);
  mcu->port.transmit(mcu->port.context, mcu->reply, wire + 1);
}

void bushd_mcu_receive(bushd_mcu* mcu, uint8_t byte, uint32_t time_in_tick_ns) {
  bushd_frame frame;
  switch (bushd_receive_byte(&mcu->receiver, byte, &frame)) {
    case BUSHD_RECEIVE_MORE:
      return;
    case BUSHD_RECEIVE_BAD_CRC:
    case BUSHD_RECEIVE_BAD_LENGTH:
      mcu->bad_frames = saturating_increment(mcu->bad_frames);
      return;
    case BUSHD_RECEIVE_FRAME:
      break;
  }
  // Replies of other MCUs pass by on the same line.
  if (frame.type & BUSHD_TYPE_REPLY) return;
  if (frame.address != mcu->config.address && frame.address != BUSHD_ADDRESS_BROADCAST) return;
  handle_frame(mcu, &frame, time_in_tick_ns);
}
