// Shared by the files of the core only.
#ifndef BUSHD_FIRMWARE_CORE_INTERNAL_H
#define BUSHD_FIRMWARE_CORE_INTERNAL_H

#include "firmware/core/mcu.h"

// The first tick that can still be changed: the next one is already prepared.
#define FIRST_OPEN(mcu) ((mcu)->tick + 2u)

// Tick numbers wrap (at 2.56 ms after 127 days); differences do not, as long as they are below
// 2^31.
static inline int32_t ticks_after(uint32_t tick, uint32_t reference) {
  return (int32_t)(tick - reference);
}

// The tick of which these are the low bits, less than 2^15 before or after the other one.
static inline uint32_t near_tick(uint16_t low, uint32_t other) {
  const int32_t after = (int16_t)(low - (uint16_t)other);
  return other + (uint32_t)after;
}

// An 8-bit CPU shifts bit by bit: it looks the bit up.
extern const uint16_t bushd_mcu_motor_bit[BUSHD_MOTORS_PER_MCU];
static inline uint16_t motor_bit(uint8_t motor) {
  return bushd_mcu_motor_bit[motor];
}

// All that it has.
static inline uint16_t own_motors(const bushd_mcu* mcu) {
  return (uint16_t)(motor_bit((uint8_t)(mcu->config.motors - 1u)) * 2u - 1u);
}

static inline uint16_t saturating_increment(uint16_t value) {
  return value < UINT16_MAX ? (uint16_t)(value + 1u) : value;
}

static inline void bushd_mcu_reject(bushd_mcu* mcu, bushd_status status) {
  mcu->rejected_frames = saturating_increment(mcu->rejected_frames);
  mcu->last_rejection = (uint8_t)status;
}

static inline int16_t* queue_at(bushd_mcu* mcu, uint32_t tick, uint8_t motor) {
  const uint16_t row = (uint16_t)tick & (uint16_t)(mcu->config.queue_ticks - 1u);
  return &mcu->config.queue[(size_t)row * mcu->config.motors + motor];
}

// mcu.c
uint16_t bushd_mcu_moving(const bushd_mcu* mcu);
// These, and motors that wait for the trigger: what a resting motor may be asked must wait too.
static inline uint16_t bushd_mcu_engaged(const bushd_mcu* mcu) {
  return (uint16_t)(bushd_mcu_moving(mcu) | mcu->trigger.armed);
}
void bushd_mcu_update_state(bushd_mcu* mcu);

// requests.c: frames for this MCU, and their answers.
void bushd_mcu_handle_frame(bushd_mcu* mcu, const bushd_frame* frame, int32_t time_in_tick_ns);

// stream.c: frames of ticks into the queue.
typedef struct bushd_mcu_stretch {
  uint8_t epoch;
  uint8_t flags;
  uint32_t first_tick;
  uint16_t count;
  uint16_t mask;
} bushd_mcu_stretch;
// What all frames that move motors must keep to. BUSHD_E_LATE: good, and holds nothing new.
bushd_status bushd_mcu_check_stretch(bushd_mcu* mcu, const bushd_mcu_stretch* stretch);
bushd_status bushd_mcu_take_ticks(bushd_mcu* mcu, const bushd_ticks* ticks);
bushd_status bushd_mcu_take_table_ticks(bushd_mcu* mcu, const bushd_table_ticks* ticks);
// The motor, at rest at its known_until, starts at that tick.
void bushd_mcu_note_start(bushd_mcu* mcu, uint8_t m, uint32_t tick);
// Nothing is known of this motor from `tick` on.
void bushd_mcu_cut_queue(bushd_mcu* mcu, uint8_t motor, uint32_t tick);
// What is left of a frame that was taken, at once; up to a tick.
void bushd_mcu_finish_rows(bushd_mcu* mcu);
void bushd_mcu_finish_row(bushd_mcu* mcu, uint32_t tick);
void bushd_mcu_drop_island(bushd_mcu* mcu, uint8_t motor);
void bushd_mcu_clear_streams(bushd_mcu* mcu);

// A tick's row leaves the queue: of all motors, in 1/256 step or, if all are whole, in steps. A
// small MCU may link the second of its own (BUSHD_OWN_COARSE_ROWS).
typedef struct bushd_mcu_row {
  uint16_t moves;  // motors with other than 0
  uint16_t back;   // with less than 0
} bushd_mcu_row;
void bushd_mcu_take_fine_row(int16_t* queued, int16_t* displacement, uint8_t motors,
                             bushd_mcu_row* row);
void bushd_mcu_take_coarse_row(int16_t* queued, int16_t* steps, uint8_t motors, bushd_mcu_row* row);
// Into it, of the motors in the mask; likewise.
void bushd_mcu_put_coarse_row(int16_t* queued, uint16_t mask, const uint8_t* counts);

// Adds its steps to the counter of each motor; the counters lie `stride` bytes apart. A small MCU
// may link one of its own (BUSHD_OWN_ADD_STEPS).
void bushd_mcu_add_steps(int32_t* counter, size_t stride, const int16_t* steps, uint8_t motors);

// requests.c: goes on with an answer; false if there is none.
bool bushd_mcu_go_on_answering(bushd_mcu* mcu);

// motor.c: what motors do in the tick that is prepared.
// Makes the outlook from this tick on, the first that is not prepared.
void bushd_mcu_look_out(bushd_mcu* mcu, uint32_t tick);
void bushd_mcu_emit(bushd_mcu* mcu, bushd_plane* plane);

static inline const bushd_table* bushd_mcu_table_of(const bushd_mcu* mcu,
                                                    const bushd_mcu_motor* motor) {
  return &mcu->table[motor->table].table;
}

// table_run.c: runs of a motor's own table.
bushd_status bushd_mcu_take_table_run(bushd_mcu* mcu, const bushd_table_run* message);
// Into the motor's own run, which nothing reads as long as it is in a stream or at rest; nor its
// end: it holds how many ticks the run takes. `spare_ns`: by how much it may begin late and still
// be over then; less than a tick. False if its end is farther than tick numbers reach.
bool bushd_mcu_make_run(bushd_mcu* mcu, const bushd_table_run_entry* entry, uint32_t* spare_ns);
// The motor's run, just started, begins in this tick and takes as many.
void bushd_mcu_begin_run(bushd_mcu* mcu, uint8_t m, uint32_t first_tick, uint32_t ticks);
// A motor at rest begins a run of its table that nothing but its own end, a stop or the caller
// ends: it is `autonomous` until it rests.
void bushd_mcu_begin_by_itself(bushd_mcu* mcu, uint8_t m, uint32_t steps, int direction);
// Of a motor in a run: by the shortest way that its table allows. One that was stopped otherwise
// since stays so.
void bushd_mcu_ramp_down_run(bushd_mcu* mcu, uint8_t m);

// stop.c: how motors stop.
void bushd_mcu_watch_silence(bushd_mcu* mcu);  // before every tick is prepared
bushd_status bushd_mcu_emergency(bushd_mcu* mcu, const bushd_emergency* message);
// Of a motor in a stream; `delay` is that of the running step.
void bushd_mcu_ramp_down_stream(bushd_mcu* mcu, uint8_t m, uint16_t delay);
// Stops it from `next` on, the first tick that is not prepared.
void bushd_mcu_stop_motor(bushd_mcu* mcu, uint8_t m, bushd_how how, uint32_t next);
void bushd_mcu_stop_all(bushd_mcu* mcu, bushd_how how, uint32_t next);
// Where it goes in that tick: +1, -1; 0: at rest.
int8_t bushd_mcu_heading(const bushd_mcu* mcu, uint8_t m, uint32_t next);
int8_t bushd_mcu_last_direction(const bushd_mcu* mcu, uint8_t m);

// inputs.c: limit switches, the emergency input, the supply current, and EN.
void bushd_mcu_watch_inputs(bushd_mcu* mcu);  // before every tick is prepared
// Motors that may not move in this direction (+1, -1).
uint16_t bushd_mcu_forbidden(const bushd_mcu* mcu, int8_t direction);
// These ticks are starts, and all their first steps are in such directions. Of other starts those
// that are barred are given up where they begin.
bool bushd_mcu_starts_into_limit(const bushd_mcu* mcu, const bushd_ticks* ticks);
bushd_status bushd_mcu_set_inputs(bushd_mcu* mcu, const bushd_set_inputs* message);
void bushd_mcu_report_inputs(const bushd_mcu* mcu, bushd_report* report);
void bushd_mcu_clear_faults(bushd_mcu* mcu);  // whose cause is gone
void bushd_mcu_set_enable(bushd_mcu* mcu, bool on);
// emission.c: how steps get to the pins.
bushd_status bushd_mcu_take_emission(bushd_mcu* mcu, const bushd_emission* message);
void bushd_mcu_default_emission(bushd_mcu* mcu);
void bushd_mcu_restore_emission(bushd_mcu* mcu);
bool bushd_mcu_has_output(const bushd_mcu* mcu, uint8_t motor);
// Whether each step keeps the slot of its own time; if not, `shape` makes the masks from the
// counts.
static inline bool bushd_mcu_steps_keep_slots(const bushd_mcu* mcu) {
  return mcu->emission.grid.mode == BUSHD_EMISSION_EVEN ||
         mcu->emission.grid.mode == BUSHD_EMISSION_PHASES;
}
// The plane is complete but for what the emission makes of it.
void bushd_mcu_shape(bushd_mcu* mcu, bushd_plane* plane);

// A motor that homes has come to its switch: if that is a limit, it bars the way on. It has left
// it.
void bushd_mcu_stands_at_switch(bushd_mcu* mcu, uint8_t m, int8_t direction);
void bushd_mcu_has_left_switch(bushd_mcu* mcu, uint8_t m, int8_t direction);

// homing.c
bushd_status bushd_mcu_home(bushd_mcu* mcu, const bushd_home* message);
void bushd_mcu_go_home(bushd_mcu* mcu, uint16_t active_inputs);  // before every tick is prepared
uint16_t bushd_mcu_homing_motor(const bushd_mcu* mcu);           // as a mask

// local.c
bushd_status bushd_mcu_set_local(bushd_mcu* mcu, const bushd_local* message);
void bushd_mcu_move_locally(bushd_mcu* mcu, uint8_t system_inputs);  // before every tick
// What is active now counts only after it was released. No motor may be moved by it.
void bushd_mcu_forget_presses(bushd_mcu* mcu, uint8_t system_inputs);
// settle.c: how long the supply current needs after a step.
bool bushd_mcu_settle_pending(const bushd_mcu* mcu);
// In every tick that is prepared: the step that is to be made for it, of which motor; 0: none.
int8_t bushd_mcu_settle_step(bushd_mcu* mcu, uint8_t* motor);
uint16_t bushd_mcu_settle_slot(const bushd_mcu* mcu);  // where it is made

// trigger.c: runs that an edge at the trigger input starts.
bushd_status bushd_mcu_arm(bushd_mcu* mcu, const bushd_trigger* message);
void bushd_mcu_disarm(bushd_mcu* mcu, bushd_trigger_state why);

// reference.c: a pulse when a motor arrives at a position.
bushd_status bushd_mcu_take_reference(bushd_mcu* mcu, const bushd_reference* message);
// Precondition: a pulse may begin or is under way. `plane` has its steps.
void bushd_mcu_emit_reference(bushd_mcu* mcu, bushd_plane* plane);
static inline bool bushd_mcu_reference_on(const bushd_mcu* mcu) {
  return (mcu->reference.arrivals | mcu->reference.pulse) != 0;
}

// tables.c: table memory.
bushd_status bushd_mcu_table_begin(bushd_mcu* mcu, const bushd_table_begin* message);
bushd_status bushd_mcu_table_data(bushd_mcu* mcu, const bushd_table_data* message);
bushd_status bushd_mcu_table_end(bushd_mcu* mcu, const bushd_table_end* message);
bushd_status bushd_mcu_assign(bushd_mcu* mcu, const bushd_assign* message);
bushd_tables bushd_mcu_tables(const bushd_mcu* mcu);
void bushd_mcu_forget_tables(bushd_mcu* mcu);

// sync.c: the tick counter against the bus's.
void bushd_mcu_sync(bushd_mcu* mcu, const bushd_sync* sync, int32_t time_in_tick_ns);
void bushd_mcu_slew(bushd_mcu* mcu);             // at every tick boundary
void bushd_mcu_new_tick_length(bushd_mcu* mcu);  // mcu->tick_ns is another one

#endif
