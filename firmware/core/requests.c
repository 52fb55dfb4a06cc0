// Frames for this MCU: what they ask for, and what is answered.
#include "firmware/core/requests.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/assertion.h"
#include "firmware/core/drivers.h"
#include "firmware/core/emission.h"
#include "firmware/core/inputs.h"
#include "firmware/core/local.h"
#include "firmware/core/program.h"
#include "firmware/core/report.h"
#include "firmware/core/state.h"
#include "firmware/core/sync.h"
#include "firmware/core/tables.h"
#include "firmware/core/velocity.h"

static uint32_t capabilities_of(const bushd_mcu* mcu) {
  uint32_t all = BUSHD_CAN_COARSE | BUSHD_CAN_FINE | BUSHD_CAN_TABLE_TICKS | BUSHD_CAN_TABLE_RUN |
                 BUSHD_CAN_HOME | BUSHD_CAN_LOCAL | BUSHD_CAN_POSITION_COMPARE | BUSHD_CAN_BURST |
                 BUSHD_CAN_COMMON_DIR | BUSHD_CAN_STAGGERED | BUSHD_CAN_PHASES |
                 BUSHD_CAN_MOTOR_INPUTS | BUSHD_CAN_LINE_RUN | BUSHD_CAN_TRAVEL |
                 BUSHD_CAN_CLEAR_NAMED | BUSHD_CAN_OUTPUTS | BUSHD_CAN_DISABLE;
  if (mcu->port.set_trigger != NULL) all |= BUSHD_CAN_TRIGGER;
  if (mcu->port.set_current != NULL) all |= BUSHD_CAN_CURRENTS;
  if (mcu->config.velocity_motors != 0) all |= BUSHD_CAN_VELOCITY;
  if (mcu->config.keypad) all |= BUSHD_CAN_KEYPAD;
  if (mcu->config.scratch != NULL) all |= BUSHD_CAN_SCRATCH;
  if (BUSHD_SLOW_RUNS && !mcu->config.no_slow_runs) all |= BUSHD_CAN_SLOW_RUNS;
  const bool lines = (mcu->config.disabled_capabilities & BUSHD_CAN_LINE_RUN) == 0;
  if (BUSHD_ELEMENTARY && lines && !mcu->config.no_elementary) all |= BUSHD_CAN_ELEMENTARY;
#if BUSHD_PROGRAMS
  if (mcu->config.program != NULL) all |= BUSHD_CAN_PROGRAM;
#endif
  return all & ~(uint32_t)mcu->config.disabled_capabilities;
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
  identity.capabilities = capabilities_of(mcu);
  memcpy(identity.unique_id, mcu->config.unique_id, sizeof identity.unique_id);
  return bushd_encode_identity(&identity, payload);
}

bushd_status bushd_mcu_take_configure(bushd_mcu* mcu, const bushd_configure* message) {
  const bool same = (mcu->flags & BUSHD_FLAG_CONFIGURED) != 0 && mcu->tick_ns == message->tick_ns &&
                    mcu->format == message->format;
  if (!same && bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  if (message->tick_ns < mcu->config.min_tick_ns) return BUSHD_E_CAPACITY;
  mcu->reception.comm_timeout_ticks = message->comm_timeout_ticks;
  if (same) return BUSHD_OK;
  bushd_mcu_wait_for_local(mcu);
  // What it counts in slots lasts as long in another tick no more.
  mcu->position_compare.arrivals = 0;
  mcu->tick_ns = message->tick_ns;
  mcu->format = message->format;
  // Another tick length is another time: the MCU must be told the bus's tick again, and its tables
  // and its emission be checked against it again.
  mcu->flags = (uint8_t)((mcu->flags | BUSHD_FLAG_CONFIGURED) &
                         ~(BUSHD_FLAG_SYNCED | BUSHD_FLAG_SYNC_HEARD));
  bushd_mcu_new_tick_length(mcu);
  bushd_mcu_default_emission(mcu);
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    mcu->motor[m].table = -1;
    mcu->motor[m].remainder = 0;
  }
  bushd_mcu_forget_velocities(mcu);
  mcu->port.set_tick(mcu->port.context, mcu->tick_ns);
  return BUSHD_OK;
}

static uint8_t actions_at_rest_only(const bushd_mcu* mcu, uint8_t faults) {
  const uint8_t all =
      BUSHD_CONTROL_DISABLE | BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_FORGET_TABLES;
#if BUSHD_PROGRAMS
  // A program without host may go on for days, and none of these ends it. One that does must be
  // named by nobody before the program has seen it, and it looks once a tick.
  const bool ends_none = faults != 0 && (faults & BUSHD_MCU_PROGRAM_ENDING_FAULTS) == 0;
  const uint16_t others = bushd_mcu_engaged(mcu) & (uint16_t)~bushd_mcu_moved_without_host(mcu);
  if (ends_none && others == 0) return all & (uint8_t)~BUSHD_CONTROL_CLEAR_FAULTS;
#else
  (void)mcu;
  (void)faults;
#endif
  return all;
}

// EN falls and may rise, so a press that nobody has seen yet is looked at first.
bushd_status bushd_mcu_take_set_outputs(bushd_mcu* mcu, const bushd_set_outputs* message) {
  bushd_mcu_watch_emergency_input(mcu);
  return bushd_mcu_set_outputs(mcu, message);
}

bushd_status bushd_mcu_take_control(bushd_mcu* mcu, const bushd_control* message) {
  const uint8_t at_rest_only = actions_at_rest_only(mcu, message->faults);
  if ((message->actions & at_rest_only) != 0 && bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  bushd_mcu_watch_emergency_input(mcu);
  if (message->actions & BUSHD_CONTROL_CLEAR_FAULTS) bushd_mcu_clear_faults(mcu, message->faults);
  if (message->actions & BUSHD_CONTROL_FORGET_TABLES) bushd_mcu_forget_tables(mcu);
  if (message->actions & BUSHD_CONTROL_DISABLE) bushd_mcu_set_enable(mcu, false);
  if (message->actions & BUSHD_CONTROL_ENABLE) {
    const uint8_t forbid = BUSHD_FAULT_SELF_TEST | BUSHD_FAULT_OVERCURRENT | BUSHD_FAULT_DISABLED;
    if (mcu->faults & forbid) return BUSHD_E_STATE;
    bushd_mcu_set_enable(mcu, true);
  }
  return BUSHD_OK;
}

bushd_status bushd_mcu_take_set_position(bushd_mcu* mcu, const bushd_set_position* message) {
  if (message->motor >= mcu->config.motors) return BUSHD_E_FORMAT;
  if (bushd_mcu_engaged(mcu) & motor_bit(message->motor)) return BUSHD_E_STATE;
  mcu->motor[message->motor].position_steps = message->position_steps;
  mcu->reports.moved |= motor_bit(message->motor);
  mcu->motor[message->motor].remainder = 0;
  return BUSHD_OK;
}

static bushd_status set_address(bushd_mcu* mcu, const bushd_set_address* message) {
  if (bushd_mcu_moving(mcu) != 0) return BUSHD_E_STATE;
  if (message->address == mcu->config.address) return BUSHD_OK;
  if (!mcu->port.store_address(mcu->port.context, message->address)) return BUSHD_E_STATE;
  mcu->config.address = message->address;
  return BUSHD_OK;
}

// What goes back. Size 0: an acknowledgement of the status.
typedef struct answer {
  bool due;
  uint32_t delay_ns;
  size_t size;
  uint8_t* payload;  // where it stands in the frame already: a small MCU has no room for it twice
} answer;

// In units of BUSHD_REPLY_UNIT_NS; as far as a port can count.
static bool answer_at(answer* a, uint32_t units) {
  a->due = units <= UINT32_MAX / BUSHD_REPLY_UNIT_NS;
  a->delay_ns = a->due ? units * BUSHD_REPLY_UNIT_NS : 0;
  return a->due;
}

static bushd_status answer_identify(bushd_mcu* mcu, const bushd_frame* frame, answer* a) {
  bushd_identify message;
  const bushd_status status = bushd_decode_identify(frame->payload, frame->payload_size, &message);
  if (status != BUSHD_OK) return status;
  const uint8_t window =
      bushd_identify_window(mcu->config.unique_id, message.salt, message.windows);
  if (!answer_at(a, (uint32_t)window * message.window_units)) return BUSHD_E_FORMAT;
  a->size = encode_identity(mcu, a->payload);
  return BUSHD_OK;
}

static bushd_status answer_poll(bushd_mcu* mcu, const bushd_frame* frame, answer* a) {
  a->due = false;
  bushd_poll message;
  const bushd_status status = bushd_decode_poll(frame->payload, frame->payload_size, &message);
  bushd_poll_entry entry;
  if (status != BUSHD_OK || !bushd_poll_find(&message, mcu->config.address, &entry)) return status;
  answer_at(a, entry.begin_units);
  a->size = bushd_mcu_encode_report(mcu, &entry, a->payload);
  return BUSHD_OK;
}

static bushd_status answer_set_address(bushd_mcu* mcu, const bushd_frame* frame, answer* a) {
  bushd_set_address message;
  const bushd_status status =
      bushd_decode_set_address(frame->payload, frame->payload_size, &message);
  if (status != BUSHD_OK) return status;
  a->due = memcmp(message.unique_id, mcu->config.unique_id, sizeof message.unique_id) == 0;
  return a->due ? set_address(mcu, &message) : BUSHD_OK;
}

static bushd_status answer_tables(bushd_mcu* mcu, const bushd_frame* frame, answer* a) {
  if (frame->payload_size != 0) return BUSHD_E_LENGTH;
  if (!a->due) return BUSHD_OK;
  const bushd_tables tables = bushd_mcu_tables(mcu);
  a->size = bushd_encode_tables(&tables, a->payload);
  return BUSHD_OK;
}

#if BUSHD_PROGRAMS
static bushd_status answer_program_state(bushd_mcu* mcu, const bushd_frame* frame, answer* a) {
  if (frame->payload_size != 0) return BUSHD_E_LENGTH;
  if (!a->due) return BUSHD_OK;
  const bushd_program_state state = bushd_mcu_state_of_program(mcu);
  a->size = bushd_encode_program_state(&state, a->payload);
  return BUSHD_OK;
}
#endif

static bushd_status hear_sync(bushd_mcu* mcu, const bushd_frame* frame, int32_t time_in_tick_ns) {
  bushd_sync sync;
  const bushd_status status = bushd_decode_sync(frame->payload, frame->payload_size, &sync);
  if (status == BUSHD_OK) bushd_mcu_sync(mcu, &sync, time_in_tick_ns);
  return status;
}

// Decodes the payload and passes it on; a decoding error is the status as it is.
#define TAKE(kind)                                                               \
  do {                                                                           \
    bushd_##kind message;                                                        \
    const bushd_status decoded =                                                 \
        bushd_decode_##kind(frame->payload, frame->payload_size, &message);      \
    return decoded == BUSHD_OK ? bushd_mcu_take_##kind(mcu, &message) : decoded; \
  } while (0)
#define CASE_TAKE(type, number, kind, needs) \
  case BUSHD_MSG_##type:                     \
    TAKE(kind);

// What nobody answers.
static bushd_status hear(bushd_mcu* mcu, const bushd_frame* frame, int32_t time_in_tick_ns) {
  switch (frame->type) {
    case BUSHD_MSG_SYNC:
      return hear_sync(mcu, frame, time_in_tick_ns);
    case BUSHD_MSG_EMERGENCY:
      TAKE(emergency);
      BUSHD_STREAMED(CASE_TAKE)
    default:
      return BUSHD_E_UNKNOWN_MESSAGE;
  }
}

static bool is_answered(uint8_t type) {
  switch (type) {
    case BUSHD_MSG_SYNC:
    case BUSHD_MSG_EMERGENCY:
      BUSHD_STREAMED(BUSHD_CASE)
      return false;
    default:
      return true;
  }
}

// The capabilities without which a message of this type is unknown. Modes of emission have
// statuses of their own.
#define CASE_NEEDS(type, number, kind, needs) \
  case BUSHD_MSG_##type:                      \
    return needs;
static uint32_t capability_of(uint8_t type) {
  switch (type) {
    BUSHD_MESSAGES(CASE_NEEDS)
    default:
      return 0;
  }
}

static bushd_status handle(bushd_mcu* mcu, const bushd_frame* frame, int32_t time_in_tick_ns,
                           answer* a) {
  if (!is_answered(frame->type)) return hear(mcu, frame, time_in_tick_ns);
  switch (frame->type) {
    case BUSHD_MSG_IDENTIFY:
      return answer_identify(mcu, frame, a);
    case BUSHD_MSG_POLL:
      return answer_poll(mcu, frame, a);
    case BUSHD_MSG_SET_ADDRESS:
      return answer_set_address(mcu, frame, a);
    case BUSHD_MSG_TABLES:
      return answer_tables(mcu, frame, a);
      BUSHD_SETUP_REQUESTS(CASE_TAKE)
      BUSHD_MOTION_REQUESTS(CASE_TAKE)
#if BUSHD_PROGRAMS
      BUSHD_PROGRAM_REQUESTS(CASE_TAKE)
    case BUSHD_MSG_PROGRAM_STATE:
      return answer_program_state(mcu, frame, a);
#endif
    default:
      return BUSHD_E_UNKNOWN_MESSAGE;
  }
}

void bushd_mcu_handle_frame(bushd_mcu* mcu, const bushd_frame* frame, int32_t time_in_tick_ns) {
  BUSHD_ASSERT(bushd_mcu_owner_of_buffer(mcu) == BUSHD_MCU_BUFFER_RECEIVER);
  answer a;
  a.due = frame->address != BUSHD_ADDRESS_BROADCAST && is_answered(frame->type);
  a.delay_ns = 0;
  a.size = 0;
  // The frame may lie in the same buffer (bushd_mcu_config.reply): it is read by then.
  a.payload = mcu->config.reply + 2 + BUSHD_FRAME_HEADER;
  const uint32_t needed = capability_of(frame->type);
  const bool denied = (needed & ~capabilities_of(mcu)) != 0;
  const bushd_status status =
      denied ? BUSHD_E_UNKNOWN_MESSAGE : handle(mcu, frame, time_in_tick_ns, &a);
  // Ticks look to it themselves; these two change nothing that it tells.
  if (frame->type != BUSHD_MSG_TICKS && frame->type != BUSHD_MSG_POLL &&
      frame->type != BUSHD_MSG_SYNC) {
    mcu->stream.queue_summary.stale = true;
  }
  if (status != BUSHD_OK) bushd_mcu_reject(mcu, status);
  if (!a.due) return;
  if (a.size == 0) {
    const bushd_acknowledgement acknowledgement = {(uint8_t)status};
    a.size = bushd_encode_acknowledgement(&acknowledgement, a.payload);
  }
  // What is answered reads no more of the frame.
  BUSHD_ASSERT(bushd_mcu_owner_of_buffer(mcu) == BUSHD_MCU_BUFFER_RECEIVER);
  BUSHD_ASSERT(BUSHD_FRAME_HEADER + a.size + BUSHD_FRAME_CRC + 3u <= BUSHD_MCU_MAX_REPLY);
  uint8_t* const raw = mcu->config.reply + 2;
  raw[0] = mcu->config.address;
  raw[1] = (uint8_t)(frame->type | BUSHD_TYPE_REPLY);
  raw[2] = frame->sequence;
  mcu->answer.size = (uint8_t)(BUSHD_FRAME_HEADER + a.size);
  mcu->answer.checked = 0;
  mcu->answer.delay_ns = a.delay_ns;
  bushd_put_u32(raw + mcu->answer.size, BUSHD_CRC32_START);
  if (mcu->config.in_pieces) return;
  while (bushd_mcu_go_on_answering(mcu)) {
  }
}

bool bushd_mcu_go_on_answering(bushd_mcu* mcu) {
  enum { PIECE = 48 };
  bushd_mcu_answer* reply = &mcu->answer;
  if (reply->size == 0) return false;
  uint8_t* const raw = mcu->config.reply + 2;
  const uint8_t left = (uint8_t)(reply->size - reply->checked);
  const uint32_t crc = bushd_get_u32(raw + reply->size);
  if (left != 0) {
    const uint8_t count = left < PIECE ? left : PIECE;
    bushd_put_u32(raw + reply->size, bushd_crc32(crc, raw + reply->checked, count));
    reply->checked = (uint8_t)(reply->checked + count);
    return true;
  }
  // A delimiter comes first: it ends whatever the master took, while the line was idle, for a
  // frame's beginning.
  mcu->config.reply[0] = 0;
  const size_t wire = bushd_frame_close(mcu->config.reply + 1, reply->size, crc);
  reply->size = 0;
  mcu->port.transmit(mcu->port.context, mcu->config.reply, wire + 1, reply->delay_ns);
  return true;
}
