// One MCU program behind a port that only records: what it sends, what it does to EN, and every
// STEP pulse of the slot_buffers it hands out. Ticks pass when a test says so.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/payload.h"
#include "engine/reference.h"
#include "firmware/core/nvm.h"
#include "sim/requests.h"

namespace bushd::test {

using Bytes = std::vector<std::uint8_t>;

struct RigOptions {
  std::uint8_t address = 7;
  std::uint8_t motors = 4;
  std::uint16_t slots = 256;
  std::uint16_t queue_ticks = 128;
  std::uint16_t code_count = 400;
  std::uint32_t min_tick_ns = 0;
  std::uint8_t failing_tests = 0;
  bushd_reset_cause reset_cause = BUSHD_RESET_POWER_ON;
  bool enable_at_boot = false;
  bool in_pieces = false;                   // answers wait for work()
  std::uint32_t disabled_capabilities = 0;  // BUSHD_CAN_*: it has all others
  std::int32_t pulse_ns = 0;
  bool stores_address = true;
  std::uint8_t current_motors = 1;  // whose windings' currents the port controls; >= 1
  std::uint8_t velocity_motors = 2;
  std::uint16_t program_bytes = 1024;
  bool keeps_programs = false;
};

struct Answer {
  std::uint8_t type;  // without BUSHD_TYPE_REPLY
  std::uint8_t sequence;
  Bytes payload;
  std::uint32_t delay_ns;  // as the port was told
};

// A move as a master would send it, from the slow reference: displacements by tick and the delay
// that runs at each tick's end.
struct Plan {
  std::vector<std::int16_t> displacement;  // fine: 1/256 step; coarse: the byte
  std::vector<std::uint16_t> delay;
  std::vector<std::uint8_t> fraction;  // of the position at each tick's end, 1/256 step
  std::vector<std::int64_t> made;      // steps made until each tick's end, unsigned
  int direction;
  std::size_t ticks() const { return displacement.size(); }
};
Plan plan_move(const Law& law, std::int64_t steps, std::uint32_t tick_ns, bushd_format format);
// Steps in each tick of a reference that begins at a tick's beginning.
std::vector<int> steps_by_tick(const Reference& reference, std::uint32_t tick_ns);

// Codes as a checksum and a frame have them.
void append(Bytes& bytes, const std::vector<std::uint16_t>& codes);
// CRC-32/ISO-HDLC, bit by bit.
std::uint32_t crc32(const Bytes& bytes);

// bushd_set_inputs, all of it off.
struct InputSettings {
  std::uint16_t limit_positive = 0;
  std::uint16_t limit_negative = 0;
  std::uint16_t limit_immediate = 0;
  std::uint16_t inverted = 0;
  std::uint8_t debounce_ticks = 0;
  std::uint8_t system_inverted = 0;
  std::uint8_t emergency = BUSHD_EMERGENCY_INPUT_IGNORED;
  std::uint16_t overcurrent = 0;
  bool enable_after_watchdog = false;
};

class Rig {
 public:
  static constexpr std::uint32_t kTickNs = 2'560'000;

  explicit Rig(RigOptions options = {});
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  // A reset by a port that keeps what it may.
  void restart_with_nvm(bushd_reset_cause cause = BUSHD_RESET_POWER_ON);
  void feed(std::span<const std::uint8_t> bytes);
  // A frame on the bus, without looking at what comes back.
  void frame(std::uint8_t address, std::uint8_t type, const Bytes& payload);
  void frame(std::uint8_t type, const Bytes& payload) { frame(options_.address, type, payload); }
  // The only answer since the last call, if any.
  std::optional<Answer> answer();
  // Does what was left to do.
  void work() {
    while (bushd_mcu_work(&mcu_)) {
    }
  }
  const Bytes& last_sent() const { return last_sent_; }
  std::uint8_t last_sequence() const { return sequence_; }
  // Sends a request to this MCU and returns the status that it acknowledges with.
  bushd_status request(std::uint8_t type, const Bytes& payload);
  template <class Message>
  bushd_status request(const Message& message) {
    const Request request = request_of(message);
    return this->request(static_cast<std::uint8_t>(request.type), request.payload);
  }
  // What reports have told, this one included.
  bushd_report poll();
  // The answer to a POLL of its own kind; `before`: what is known already.
  std::optional<bushd_report> ask_report(std::uint8_t known, std::uint8_t room,
                                         const bushd_report& before);
  // What the MCU would tell one that knows nothing; as if it had not been asked.
  bushd_report all_of_report();
  bushd_identity identify();

  bushd_status configure(bushd_format format, std::uint32_t tick_ns = kTickNs,
                         std::uint16_t comm_timeout_ticks = 65535);
  // Two SYNC frames: afterwards the MCU is in step and the tick being emitted is `tick`.
  void sync_to(std::uint32_t tick);
  void sync(const bushd_sync& message);
  bushd_status begin(std::uint8_t bank, const Law& law, bool symmetric = false,
                     std::uint32_t revision = 0);
  bushd_status data(std::uint8_t bank, std::uint16_t offset,
                    const std::vector<std::uint16_t>& codes);
  bushd_status end(std::uint8_t bank, const std::vector<std::uint16_t>& codes);
  bushd_status upload(std::uint8_t bank, const Law& law);
  bushd_status assign(std::uint8_t motor, std::uint8_t bank) {
    return request(BUSHD_MSG_ASSIGN, {motor, bank});
  }
  bushd_status control(std::uint8_t actions) { return request(BUSHD_MSG_CONTROL, {actions}); }
  bushd_status clear(std::uint8_t faults) {
    return request(BUSHD_MSG_CONTROL, {BUSHD_CONTROL_CLEAR_FAULTS, faults});
  }
  bushd_status set_position(std::uint8_t motor, std::int32_t position_steps) {
    return request(bushd_set_position{motor, position_steps});
  }
  bushd_status emission(const bushd_emission& message) { return request(message); }
  bushd_tables tables();
  bushd_status set_inputs(const InputSettings& settings);
  bushd_status motor_inputs(const bushd_motor_inputs& message) { return request(message); }
  bushd_status outputs(const bushd_set_outputs& message) { return request(message); }
  bushd_status currents(const bushd_currents& message) { return request(message); }
  bushd_status velocity(const bushd_set_velocity& message) { return request(message); }
  // What the port was told, in order of time.
  struct Winding {
    std::uint8_t motor;
    std::uint16_t ma;
    bool fast_decay;
  };
  const std::vector<Winding>& windings() const { return windings_; }
  bushd_status home(const bushd_home& message) { return request(message); }
  bushd_status local(std::uint16_t motors, std::uint16_t keypad = 0,
                     std::uint16_t keypad_ticks = 0) {
    return request(bushd_local{motors, keypad, keypad_ticks});
  }
  void keypad(std::uint8_t byte) { bushd_mcu_keypad_byte(&mcu_, byte); }
  void keypad_break() { bushd_mcu_keypad_break(&mcu_); }
  // What is due for its display now.
  std::string keypad_display();
  // The pins, from the next tick that is prepared on.
  void pins(bushd_inputs inputs) { pins_ = inputs; }
  // If set, the pins are what this says whenever they are read.
  std::function<bushd_inputs()> sense;
  void current(std::uint16_t reading) { current_ = reading; }
  bushd_status arm(std::uint8_t number, bushd_edge edge, std::uint32_t delay_us,
                   const std::vector<bushd_table_run_entry>& entries);
  bushd_status disarm() { return arm(0, BUSHD_EDGE_NONE, 0, {}); }
  bushd_status position_compare(const bushd_position_compare& message) { return request(message); }
  // What the port was told to wait for, and the edge noticed in the present tick.
  bushd_edge awaited_edge() const { return awaited_edge_; }
  void trigger(std::int32_t time_in_tick_ns) { bushd_mcu_trigger(&mcu_, time_in_tick_ns); }
  // Without an answer.
  void emergency(bushd_stop_mode mode, std::uint8_t address = BUSHD_ADDRESS_BROADCAST);
  // Everything up to READY, with this table for all motors.
  void make_ready(const Law& law, bushd_format format, std::uint32_t tick = 1000);

  // BUSHD_TICKS_FINE is added as needed.
  Bytes encode(Ticks ticks) const;
  // What the MCU made of it, as its reports tell.
  bushd_status take(const Ticks& ticks) { return take(BUSHD_MSG_TICKS, encode(ticks)); }
  bushd_status take(std::uint8_t type, const Bytes& payload);
  // Ticks [from, from + count) of a plan that starts at `start`, with the delay at their end.
  Ticks part(const Plan& plan, std::uint32_t start, std::size_t from, std::size_t count,
             std::uint8_t motor = 0) const;
  // A move of no more than 100 ticks, in one frame from the first open tick on.
  bushd_status start(const Law& law, std::int64_t steps, std::uint8_t motor = 0) {
    return take(part(plan_move(law, steps, kTickNs, format_), first_open(), 0, 100, motor));
  }
  // The first `ticks` ticks of a plan, in frames of `part`.
  void take_plan(const Plan& plan, std::uint32_t start, std::size_t ticks, std::size_t part_ticks,
                 std::uint8_t motor = 0) {
    for (std::size_t from = 0; from < std::min(ticks, plan.ticks()); from += part_ticks) {
      ASSERT_EQ(take(part(plan, start, from, part_ticks, motor)), BUSHD_OK);
    }
  }
  // Keeps the queue filled with a plan and lets time pass until the motor is at rest.
  void run_plan(const Plan& plan, std::uint8_t motor);

  // One tick boundary: the slot_buffer in force is counted, the next one emitted, the one after
  // prepared.
  void pass();
  void pass(int ticks) {
    for (int i = 0; i < ticks; ++i) pass();
  }
  void pass_until_rest(int limit = 100000);

  std::uint32_t tick() const { return mcu_.tick; }
  std::uint32_t first_open() const { return mcu_.tick + 2; }
  // Steps of the slot_buffers that have ended, counted from STEP and DIR levels alone (but for
  // phases).
  std::int64_t pulses(std::uint8_t motor) const { return pulses_[motor]; }
  // Signed steps of a motor in each tick since boot; entry i is the i-th slot_buffer emitted.
  const std::vector<int>& history(std::uint8_t motor) const { return history_[motor]; }
  void forget_history();
  bool enabled() const { return enabled_; }
  // The levels of STEP, DIR and EN, as the port was told last.
  const bushd_set_outputs& levels() const { return levels_; }
  int enable_calls() const { return enable_calls_; }
  // The edge that the port was told of comes, if it was, and goes back: too short for any tick.
  void press_shortly() {
    if (off_at_ == BUSHD_EDGE_NONE) return;
    switched_off_ = true;
    enabled_ = enable_kept_ = false;
  }
  bool enable_kept() const { return enable_kept_; }
  bushd_edge off_at() const { return off_at_; }  // as in bushd_port.set_enable
  int stored_address() const { return stored_address_; }
  static std::array<std::uint8_t, BUSHD_UNIQUE_ID_SIZE> unique_id() {
    return {'b', 'u', 's', 'h', 0, 1, 2, 3};
  }
  // Steps in the first slot of a tick in which DIR changed: no set-up time for the driver.
  int steps_with_dir() const { return steps_with_dir_; }
  int steps_while_disabled() const { return steps_while_disabled_; }
  std::uint32_t port_tick_ns() const { return port_tick_ns_; }
  const bushd_slot_buffer& slot_buffer() const { return *slot_buffer_; }
  const bushd_mcu& mcu() const { return mcu_; }
  bushd_mcu* mutable_mcu() { return &mcu_; }  // for functions of the core that ports call
  const RigOptions& options() const { return options_; }

 private:
  int steps_of_plane(std::uint8_t motor) const;

  RigOptions options_;
  std::vector<std::int16_t> queue_;
  std::vector<std::uint16_t> codes_;
  std::array<std::uint8_t, BUSHD_MCU_MAX_REPLY> reply_{};
  bushd_mcu mcu_{};
  bushd_report report_{};
  const bushd_slot_buffer* slot_buffer_ = nullptr;
  bushd_format format_ = BUSHD_FORMAT_COARSE;
  std::uint8_t sequence_ = 0;
  std::vector<std::pair<Bytes, std::uint32_t>> sent_;
  std::array<Bytes, 256> table_head_;  // what TABLE_BEGIN said, by bank, as a checksum has it
  Bytes last_sent_;
  bool enabled_ = true;
  bushd_set_outputs levels_{};
  bushd_edge awaited_edge_ = BUSHD_EDGE_NONE;
  int enable_calls_ = 0;
  bool enable_kept_ = false;
  bool switched_off_ = false;
  bushd_edge off_at_ = BUSHD_EDGE_NONE;
  int stored_address_ = -1;
  bushd_inputs pins_{};
  std::uint16_t current_ = 0;
  std::array<bushd_mcu_currents, BUSHD_MAX_CURRENT_MOTORS> currents_{};
  std::array<bushd_mcu_velocity, BUSHD_MAX_VELOCITY_MOTORS> velocity_{};
  std::vector<Winding> windings_;
  bushd_mcu_scratch scratch_{};
  std::vector<std::uint8_t> program_bytes_;
  bushd_mcu_program program_{};
  std::uint32_t sync_id_ = 0;
  std::uint32_t port_tick_ns_ = 0;
  std::uint16_t direction_ = 0;
  std::array<std::int64_t, BUSHD_MOTORS_PER_MCU> pulses_{};
  std::array<std::vector<int>, BUSHD_MOTORS_PER_MCU> history_;
  int steps_with_dir_ = 0;
  int steps_while_disabled_ = 0;
};

class ReadyRig : public Rig {
 public:
  ReadyRig(const Law& law, bushd_format format, const RigOptions& options = {},
           std::uint32_t tick = 1000)
      : Rig(options) {
    make_ready(law, format, tick);
  }
};

// A ramp of 24 codes with unequal sides: 40 us units, 10 ms down to 0.8 ms.
inline constexpr std::uint16_t kSlow = 1000;  // 10 ms, the slowest step of ramp_law
Law ramp_law();
std::vector<std::uint16_t> codes_of(const Law& law);

inline constexpr std::int64_t kTick = Rig::kTickNs;
inline constexpr std::int64_t kSlots = 256;

}  // namespace bushd::test
