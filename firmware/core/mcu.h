// The MCU program without hardware: address filter, tick queue, the pipeline displacement -> slot
// masks -> outputs, position counters, states and replies. A port (firmware/ports/*) calls it from
// its interrupts.
//
// Who calls what:
// - bushd_mcu_boot: once after reset
// - bushd_mcu_receive: for every byte on the line
// - bushd_mcu_swap: at every tick boundary; the returned plane is emitted during the tick that
//   begins
// - bushd_mcu_prepare: after every swap and before the next; computes the plane of the tick that
//   follows
// The functions are not reentrant; a port that calls `swap` from an interrupt may do so between two
// calls of the others only (or masks it). Ticks run from boot on, whether or not the host has been
// heard.
#ifndef BUSHD_FIRMWARE_CORE_MCU_H
#define BUSHD_FIRMWARE_CORE_MCU_H

#include "engine/emission.h"
#include "engine/frame.h"
#include "engine/message.h"
#include "engine/run.h"
#include "engine/run_slots.h"
#include "engine/slots.h"
#include "engine/table.h"
#include "firmware/core/port.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_FIRMWARE_VERSION 2u
#define BUSHD_BOOT_TICK_NS 2560000u  // tick length until the host configures one

// What the masks of a plane are.
typedef enum bushd_outputs {
  BUSHD_OUTPUTS_PULSES = 0,
  // Pulses, and the common DIR is low in even slots and high in odd ones. It changes when the
  // pulses of a slot are over; after the last one, and in planes without steps, it is low.
  BUSHD_OUTPUTS_COMMON_DIR = 1,
  // Levels, from the slot's beginning until others follow; also in planes without steps.
  BUSHD_OUTPUTS_LEVELS = 2
} bushd_outputs;

// What is emitted during one tick.
typedef struct bushd_plane {
  uint16_t direction;                   // DIR levels, bit per motor, constant within the tick
  uint16_t step[BUSHD_MAX_SLOTS];       // STEP pulses of each slot, bit per motor
  uint8_t outputs;                      // bushd_outputs
  int16_t steps[BUSHD_MOTORS_PER_MCU];  // signed steps of the tick, for the position counters
  uint16_t active;                      // motors with a step in this tick
  // Slots of this tick, counted from 1, at whose beginning the reference output rises and falls; 0:
  // it does not. If both, it rises first.
  uint16_t reference_rise;
  uint16_t reference_fall;
} bushd_plane;

// The longest reply is a report; a delimiter stands in front.
#define BUSHD_MCU_MAX_REPLY (1u + BUSHD_REPORT_SIZE(BUSHD_MOTORS_PER_MCU) + BUSHD_FRAME_OVERHEAD)

// Memory and identity, given by the port; all of it outlives the MCU struct.
typedef struct bushd_mcu_config {
  uint8_t address;       // 1..255
  uint8_t motors;        // 1..BUSHD_MOTORS_PER_MCU
  uint16_t slots;        // BUSHD_MIN_SLOTS..BUSHD_MAX_SLOTS
  uint16_t boot_number;  // differs from that of the boot before
  uint8_t reset_cause;   // BUSHD_RESET_*
  bool enable_at_boot;   // what keep_enable was told last, after a watchdog reset; else false
  bool in_pieces;        // answers are left to bushd_mcu_work; else they are sent at once
  int16_t* queue;        // queue_ticks x motors displacements
  uint16_t
      queue_ticks;  // 32 .. 16384, a power of two (absolute tick numbers then wrap without a seam)
  uint32_t min_tick_ns;  // shorter ones are refused
  int32_t pulse_ns;  // how long STEP pulses last; 0: half a slot; less: so much shorter than that
  uint16_t lacks;    // BUSHD_CAN_* that it is too slow for: not in the identity, and refused
  uint16_t* codes;   // table memory
  uint16_t code_count;
  // BUSHD_MCU_MAX_REPLY bytes for answers. May be the end of the receiver's buffer, if the port
  // keeps the receiver out of it from the making of an answer until it is sent.
  uint8_t* reply;
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
} bushd_mcu_config;

typedef enum bushd_mcu_mode {
  BUSHD_MCU_STREAM = 0,     // the queue decides
  BUSHD_MCU_RUN_WAITS = 1,  // so it does until its start, then a table run follows
  BUSHD_MCU_TABLE_RUN = 2,
  BUSHD_MCU_RAMP_DOWN = 3,
  BUSHD_MCU_AUTONOMOUS =
      4  // `run` is made, whatever its stage, until homing or local inputs end it
} bushd_mcu_mode;

// Ticks that are queued beyond a gap.
typedef struct bushd_mcu_island {
  uint32_t from;
  uint32_t until;
  uint16_t delay;  // of the running step at `until`
} bushd_mcu_island;

// A run that waits or is made.
typedef struct bushd_mcu_made {
  uint32_t until;  // the end of a table run, or where ticks replace it
  bushd_run run;   // stands at the first tick that is not prepared
} bushd_mcu_made;

// The last start taken, while it is still to come. A small MCU has no room for whole tick numbers;
// such as are not far (near_tick) are told by their low bits.
typedef struct bushd_mcu_start {
  uint16_t rest_from;  // at rest from here to `tick`
  uint16_t tick;
} bushd_mcu_start;

typedef struct bushd_mcu_motor {
  int32_t position_steps;  // until the start of the present tick
  int16_t remainder;       // exact position minus steps made, 1/256 step
  int8_t table;            // table slot, -1: none
  uint8_t mode : 3;        // bushd_mcu_mode
  bool exact : 1;          // `run` is emitted exact to a slot, not by displacements
  bool has_island : 1;     // only in a stream
  uint16_t delay;          // of the running step when the queued ticks end; 0: at rest there
  uint16_t displacement;   // the last one that was not 0, unsigned; in the fine format only
  uint8_t still_ticks;     // made since; saturates
  union {
    bushd_mcu_start start;  // of those in bushd_mcu.starting
    uint32_t spare_ns;      // of armed ones (bushd_mcu_make_run)
  };
  uint32_t known_until;  // first tick for which nothing is decided; always > tick + 1 once prepared
  // Memory is short: there is no island while a run waits or is made.
  union {
    bushd_mcu_island island;
    bushd_mcu_made made;
  };
} bushd_mcu_motor;

typedef struct bushd_mcu_table {
  uint32_t revision;
  union {
    uint32_t crc;       // of those in bushd_mcu.valid_tables
    uint16_t received;  // of others: codes of both sides that have come
  };
  bushd_table table;  // as announced; no codes: none
} bushd_mcu_table;

// The tick counter against the bus's (sync.c). All adjustments are as the port takes them: > 0 is a
// longer tick.
typedef struct bushd_mcu_clock {
  uint8_t settling;    // ticks until the tick timer has another length; marks are void till then
  bool heard;          // a SYNC frame; the last one's mark is:
  uint16_t master;     // whose it is
  uint32_t mark;       // its name
  uint32_t mark_tick;  // when it was, if BUSHD_FLAG_MARK
  uint32_t mark_ns;
  int32_t behind_ns;     // the bus, not yet given to the port
  int32_t slew_now_ns;   // of the present tick
  int32_t slew_next_ns;  // of the next one, given
  int32_t rate_now_ns;   // the rate's share in the same
  int32_t rate_next_ns;
  bool rate_known;        // estimated since the clock was adopted
  int32_t rate_ppb;       // faster than the crystal
  int32_t rate_step;      // ns a tick, x 4096
  int32_t rate_fraction;  // of it, not yet given
  bool corrected;         // the clock was right at this time of the bus
  uint32_t corrected_tick;
  uint32_t corrected_ns;
  // Masters that come by turns.
  uint16_t other_master;   // the last one that was not `master`
  uint32_t master_uptime;  // when they were heard last
  uint32_t other_uptime;
  bool other_heard;
  uint16_t two_masters_ticks;  // until the flag falls
} bushd_mcu_clock;

// How long the supply current needs after a step (settle.c).
typedef struct bushd_mcu_settle {
  bool done;
  bool away;
  uint8_t ticks;  // since it began; 0: not under way
  uint8_t motor;  // that makes the step
  union {
    struct {
      uint32_t sum;
      uint16_t samples;
      uint16_t lowest;
      uint16_t highest;
    } quiet;  // before the step
    struct {
      uint32_t back_ns;  // 0: not known
      uint16_t mean;     // without a step
      uint16_t fluctuation;
      uint16_t peak;  // farthest from the mean
    } step;           // from then on
  } of;
} bushd_mcu_settle;

// Of up to four motors driven by phases.
typedef struct bushd_mcu_windings {
  uint8_t phase[BUSHD_MOTORS_PER_MCU / BUSHD_PHASE_OUTPUTS];
  uint8_t on_ticks[BUSHD_MOTORS_PER_MCU / BUSHD_PHASE_OUTPUTS];  // they stay on, after a move
} bushd_mcu_windings;

// How steps get to the pins (emission.c).
typedef struct bushd_mcu_emission {
  bushd_emission settings;
  bushd_emission_grid grid;
  union {
    bushd_mcu_settle settle;      // of staggered
    bushd_mcu_windings windings;  // of phases
  } of;
} bushd_mcu_emission;

typedef struct bushd_mcu_homing {
  uint8_t stage;  // bushd_homing
  uint8_t motor;
  int8_t direction;     // towards the switch
  uint8_t readings;     // of it in a row, as they are waited for
  uint32_t most_steps;  // of the fast stage
  uint32_t slow_steps;  // of each slow one, at most
  int32_t home_steps;   // the position to be set
  int32_t seen_steps;   // where the motor stood at the first of the readings
  bushd_table slow;     // of a single code: its cruise delay
} bushd_mcu_homing;

typedef struct bushd_mcu_local {
  uint16_t motors;   // a setting
  uint16_t held;     // of them, those that the button has moved or will move, until it is released
  int8_t wish;       // +1, -1; 0: none, or both
  uint8_t readings;  // since it changed
} bushd_mcu_local;

// What the queue holds for all motors at once, so that no tick need look at each. To be made anew
// when a frame has come, or something was cut.
typedef struct bushd_mcu_outlook {
  bool stale;
  uint16_t rests;         // these are at rest, and will be until something is asked of them
  uint16_t plain;         // of these nothing but the queue decides, until:
  uint32_t plain_until;   // that tick
  uint16_t moves;         // these are to move on when their ticks end, the first of them at:
  uint32_t moving_until;  // that tick
  uint16_t following;     // those that are plain and move on at plain_until, without an island
} bushd_mcu_outlook;

// Rows of a frame that are still to be put into the queue. It was taken, and lies in the receiver.
typedef struct bushd_mcu_rows {
  uint8_t next;  // as many as ticks.count: none
  bushd_ticks ticks;
} bushd_mcu_rows;

// An answer that is to be sent. In the reply buffer the CRC's register stands behind it, until it
// is through.
typedef struct bushd_mcu_answer {
  uint8_t size;     // of the frame before its CRC; 0: none
  uint8_t checked;  // by the CRC
  uint32_t delay_ns;
} bushd_mcu_answer;

// Runs that wait for the trigger, and what became of the last ones (trigger.c). The runs are in
// their motors.
typedef struct bushd_mcu_trigger_input {
  uint16_t armed;  // motors
  uint8_t number;
  uint8_t state;      // bushd_trigger_state
  uint32_t delay_us;  // the edge's
  uint32_t start_tick;
  uint32_t start_ns;
} bushd_mcu_trigger_input;

// A time in whole ticks and slots.
typedef struct bushd_mcu_slots {
  uint16_t ticks;
  uint16_t slots;
} bushd_mcu_slots;

// The reference output (reference.c).
typedef struct bushd_mcu_reference {
  uint8_t motor;
  uint8_t arrivals;  // BUSHD_ARRIVES_*
  uint8_t pulse;     // 0: none, or what comes next of it
  int32_t position_steps;
  bushd_mcu_slots delay;
  bushd_mcu_slots width;
  bushd_mcu_slots next;  // until then, from the beginning of the tick to be prepared
} bushd_mcu_reference;

// Read-only for ports and tests; everything in here is the core's.
typedef struct bushd_mcu {
  bushd_port port;
  bushd_mcu_config config;
  uint32_t tick;  // the tick being emitted
  uint32_t tick_ns;
  uint8_t state;  // bushd_state
  uint8_t faults;
  uint8_t flags;
  uint8_t epoch;
  bushd_format format;
  uint8_t front;           // plane[front] is being emitted
  uint32_t uptime;         // ticks since boot, whatever their numbers
  uint16_t silence_ticks;  // after as many without a good frame, table runs are run down
  uint16_t silent_ticks;   // since the last good frame; saturates
  bool frames_heard;
  uint8_t newest_tag;      // of the master's frames, whomever they were for
  uint32_t newest_uptime;  // when it was heard
  uint16_t run_downs;
  uint16_t low_water_ticks;
  uint16_t bad_frames;
  uint16_t rejected_frames;
  uint8_t last_rejection;
  uint16_t direction;  // DIR levels of the plane prepared last
  uint16_t begun;      // motors that move, as far as is known
  uint16_t starting;   // motors whose `start` is not over
  bushd_mcu_outlook outlook;
  bushd_mcu_rows rows;
  uint16_t codes_used;
  uint8_t valid_tables;     // slots whose table has come whole, and is good
  uint8_t failed_tests;     // BUSHD_TEST_*
  bushd_set_inputs inputs;  // settings
  uint16_t active_limits;   // of motors, as debounced
  uint16_t unsettled;       // inputs that differ from that
  uint16_t bounces[4];      // for how many ticks: bit by bit
  uint16_t hit_positive;    // motors that a limit has stopped, until they have left it
  uint16_t hit_negative;
  uint16_t autonomous;  // motors that move by homing or local inputs
  uint16_t homed;
  bushd_mcu_homing homing;
  bushd_mcu_local local;
  bushd_run_tick run_tick;  // for the runs' latest time unit
  bushd_mcu_clock clock;
  bushd_mcu_emission emission;
  bushd_mcu_trigger_input trigger;
  bushd_mcu_reference reference;
  bushd_plane plane[2];
  bushd_mcu_motor motor[BUSHD_MOTORS_PER_MCU];
  bushd_mcu_table table[BUSHD_TABLE_SLOTS];
  bushd_receiver receiver;
  bushd_mcu_answer answer;
} bushd_mcu;

// Who may use the receiver's buffer. Nobody else writes to it until the owner is another one: rows
// of a frame that was taken are read from it, and an answer may be made at its end
// (bushd_mcu_config.reply). What a port does with an answer that it was handed is its own.
typedef enum bushd_mcu_buffer_owner {
  BUSHD_MCU_BUFFER_RECEIVER = 0,
  BUSHD_MCU_BUFFER_ROWS = 1,
  BUSHD_MCU_BUFFER_ANSWER = 2
} bushd_mcu_buffer_owner;
static inline bushd_mcu_buffer_owner bushd_mcu_owner_of_buffer(const bushd_mcu* mcu) {
  if (mcu->rows.next < mcu->rows.ticks.count) return BUSHD_MCU_BUFFER_ROWS;
  return mcu->answer.size != 0 ? BUSHD_MCU_BUFFER_ANSWER : BUSHD_MCU_BUFFER_RECEIVER;
}

// Starts in state BUSY with EN low, unless it is to be high at boot; a control message raises it.
void bushd_mcu_boot(bushd_mcu* mcu, const bushd_port* port, const bushd_mcu_config* config);

// What a port may keep over resets: pieces of memory, from index 0 on until one is empty. Later
// ones may be as long as earlier ones say. They hold addresses: only the same program may get them
// back, between bushd_mcu_boot and the first tick, the earlier ones first, and then
// bushd_mcu_restored.
typedef struct bushd_mcu_piece {
  void* at;
  uint16_t size;
} bushd_mcu_piece;
bushd_mcu_piece bushd_mcu_kept(bushd_mcu* mcu, uint8_t index);
// Bytes of all pieces together, with this much table memory and all motors.
#define BUSHD_MCU_MOST_KEPT(code_count)                                                          \
  (sizeof(uint32_t) + sizeof(bushd_format) + sizeof(bushd_set_inputs) + sizeof(bushd_emission) + \
   sizeof(uint16_t) + BUSHD_TABLE_SLOTS * sizeof(bushd_mcu_table) + sizeof(uint8_t) +            \
   sizeof(uint16_t) + (code_count) * sizeof(uint16_t) + BUSHD_MOTORS_PER_MCU * sizeof(int8_t))
void bushd_mcu_restored(bushd_mcu* mcu);

// For a port that goes through all pieces a little at a time, again and again.
typedef struct bushd_mcu_pass {
  uint8_t index;  // of the piece
  uint16_t offset;
  uint16_t size;         // of all bytes so far
  uint32_t crc;          // register after them
  uint32_t crc_before;   // of the pass before
  uint16_t same_uptime;  // since when it is the same
} bushd_mcu_pass;
void bushd_mcu_begin_pass(bushd_mcu_pass* pass);
// The next bytes, up to `most` (>= 1); empty at the end. Pieces may change between two calls: of
// one that has become shorter than the pass has come, nothing is left. Never more bytes in all than
// BUSHD_MCU_MOST_KEPT.
bushd_mcu_piece bushd_mcu_next_kept(bushd_mcu* mcu, bushd_mcu_pass* pass, uint16_t most);
// At the end of a pass: whether what is kept has stayed the same for so long that it may be
// written. A master that begins changes one thing after the other.
bool bushd_mcu_kept_is_quiet(const bushd_mcu* mcu, bushd_mcu_pass* pass);

// One byte from the line. `time_in_tick_ns` is when its stop bit ended, counted from the start of
// the present tick (negative: in one before); only used at delimiters. O(1), O(frame) at a
// delimiter.
void bushd_mcu_receive(bushd_mcu* mcu, uint8_t byte, int32_t time_in_tick_ns);

// What a frame of many ticks asks for is done in pieces if the port wants it so, and so are answers
// (bushd_mcu_config.in_pieces): while this returns true, something was left to do, and no byte is
// to be given to the receiver. The other functions do first what they need. O(motors), or O(bytes
// of an answer).
bool bushd_mcu_work(bushd_mcu* mcu);

// Tick boundary: counts the steps of the tick that ended, returns the plane of the one that begins.
// O(motors).
const bushd_plane* bushd_mcu_swap(bushd_mcu* mcu);

// The edge that was asked for (bushd_port.set_trigger) came at this time, counted from the start of
// the present tick: negative if that was before it. To be called between swaps as all others, at
// the latest in the tick after the edge: noticed later, what was armed is given up. O(motors).
void bushd_mcu_trigger(bushd_mcu* mcu, int32_t time_in_tick_ns);

// Computes the plane of the next tick. O(slots + steps).
void bushd_mcu_prepare(bushd_mcu* mcu);

// Whether samples of the supply current are wanted in the present tick, as many as the port can
// take.
bool bushd_mcu_wants_samples(const bushd_mcu* mcu);
// One that was taken so long after the tick's beginning. In order of time. O(1).
void bushd_mcu_sample(bushd_mcu* mcu, uint32_t time_in_tick_ns, uint16_t current);

#ifdef __cplusplus
}
#endif
#endif
