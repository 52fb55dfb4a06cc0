#include "fuzz/core_rig.h"

#include "engine/told.h"
#include "sim/disabled_capabilities.h"

namespace bushd::fuzz {
namespace {

constexpr std::uint16_t kSlots = 128;

}  // namespace

CoreRig::CoreRig(const CoreConfiguration& configuration)
    : configuration_(configuration),
      queue_(std::size_t{configuration.queue_ticks} * configuration.motors),
      codes_(configuration.codes) {}

Sight CoreRig::sight() {
  const bushd_mcu_clock& clock = mcu_.clock;
  return {mcu_.config.address, motors(),      mcu_.stream.epoch, mcu_.tick,    mcu_.tick_ns,
          clock.master,        clock.sync_id, clock.sync_tick,   clock.sync_ns};
}

std::uint32_t CoreRig::table_crc(std::uint8_t bank) {
  const bushd_table& table =
      bank == BUSHD_SCRATCH_BANK ? scratch_.front().entry.table : mcu_.tables.bank[bank].table;
  return table.accel.count != 0 ? bushd_table_crc32(&table) : 0;
}

void CoreRig::boot() {
  static constexpr auto self = [](void* context) { return static_cast<CoreRig*>(context); };
  const bushd_port port = {
      .context = this,
      .transmit = [](void* context, const std::uint8_t* wire, std::size_t size,
                     std::uint32_t delay_ns) { self(context)->transmit({wire, size}, delay_ns); },
      .store_address =
          [](void* context, std::uint8_t address) {
            self(context)->address_ = address;
            return true;
          },
      .set_enable = [](void* context, bool on, const bushd_set_outputs*,
                       bushd_edge) { self(context)->enabled_ = on; },
      .set_tick = [](void* context, std::uint32_t tick_ns) { self(context)->tick_ns_ = tick_ns; },
      .adjust_tick = [](void* context, std::int32_t ns) { self(context)->adjusted(ns); },
      .time_in_tick_ns = [](void* context) { return self(context)->time_in_tick_ns(); },
      .read_inputs = [](void* context) { return self(context)->pins(); },
      .read_current = [](void* context) { return self(context)->current(); },
      .self_test = [](void*) -> std::uint8_t { return 0; },
      .keep_enable = [](void* context, bool on) { self(context)->enable_at_boot_ = on; },
      .set_trigger = [](void* context, bushd_edge edge) { self(context)->awaited_ = edge; },
      .set_current =
          [](void*, std::uint8_t motor, std::uint16_t ma, bool) {
            BUSHD_REQUIRE(motor < BUSHD_MAX_CURRENT_MOTORS && ma <= BUSHD_MAX_CURRENT_MA);
          }};
  program_.bytes = program_bytes_.data();
  program_.memory = static_cast<std::uint16_t>(program_bytes_.size());
  currents_ = {};
  velocity_ = {};
  bushd_mcu_config config = {.address = address_,
                             .motors = configuration_.motors,
                             .slots = kSlots,
                             .boot_number = boot_number_++,
                             .reset_cause = BUSHD_RESET_WATCHDOG,
                             .enable_at_boot = enable_at_boot_,
                             .in_pieces = configuration_.in_pieces,
                             .keypad = true,
                             .keeps_programs = true,
                             .no_slow_runs = false,   // below
                             .no_elementary = false,  // below
                             .queue = queue_.data(),
                             .queue_ticks = configuration_.queue_ticks,
                             .min_tick_ns = configuration_.min_tick_ns,
                             .pulse_ns = configuration_.pulse_ns,
                             .disabled_capabilities = 0,  // below
                             .currents = currents_.data(),
                             .current_motors = static_cast<std::uint8_t>(currents_.size()),
                             .velocity = velocity_.data(),
                             .velocity_motors = static_cast<std::uint8_t>(velocity_.size()),
                             .scratch = scratch_.data(),
                             .program = &program_,
                             .codes = codes_.data(),
                             .code_count = configuration_.codes,
                             .reply = reply(),
                             .unique_id = {},
                             .outputs = {}};
  sim::disable_capabilities(configuration_.disabled_capabilities, &config);
  std::copy(kUniqueId.begin(), kUniqueId.end(), config.unique_id);
  bushd_mcu_boot(&mcu_, &port, &config);
}

void CoreRig::begin() {
  boot();
  BUSHD_REQUIRE(mcu_.state == BUSHD_STATE_BUSY && !enabled_);
  CoreRig::pass();
}

void CoreRig::boot_is_over() {
  begun_ = counted_ = {};
  CoreRig::pass();
}

void CoreRig::pass() {
  const bushd_slot_buffer* emitted = bushd_mcu_swap(&mcu_);
  begun_ = counted_;
  for (std::size_t m = 0; m < motors(); ++m) BUSHD_REQUIRE(position(m) == begun_[m]);
  count_pulses(*emitted);
  const bool homed = mcu_.homing.stage == BUSHD_HOMING_DONE;
  bushd_mcu_prepare(&mcu_);
  prepared_enabled_ = enabled_;
  if (!homed && mcu_.homing.stage == BUSHD_HOMING_DONE) take_home();
  check_state();
  BUSHD_REQUIRE((mcu_.state == BUSHD_STATE_FAULT) == (mcu_.faults != 0));
  const int shown = bushd_mcu_keypad_display(&mcu_);
  BUSHD_REQUIRE(shown == -1 || shown == '\n' || shown == '-' || (shown >= '0' && shown <= '9'));
}

void CoreRig::feed(Bytes bytes) {
  for (const std::uint8_t byte : bytes) {
    bushd_mcu_receive(&mcu_, byte, static_cast<std::int32_t>(time_in_tick_ns()));
  }
  check_after_frames();
}

void CoreRig::work(unsigned pieces) {
  for (; pieces > 0; --pieces) bushd_mcu_work(&mcu_);
}

void CoreRig::transmit(Bytes wire, std::uint32_t) {
  check_transmission(wire);
}

void CoreRig::check_after_frames() {
  check_state();
  for (std::size_t m = 0; m < motors(); ++m) {
    if (position(m) == begun_[m]) continue;
    BUSHD_REQUIRE(counted_[m] == begun_[m]);
    begun_[m] = counted_[m] = position(m);
  }
}

void CoreRig::frame(std::uint8_t address, std::uint8_t type, Bytes payload, std::uint8_t later) {
  const auto sequence = static_cast<std::uint8_t>(next_sequence_ + later);
  next_sequence_ = static_cast<std::uint8_t>(sequence + 1);
  std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire;
  const std::size_t size =
      bushd_frame_encode(address, type, sequence, payload.data(), payload.size(), wire.data());
  feed(Bytes(wire).first(size));
}

void CoreRig::set_pins(std::uint16_t motors, std::uint8_t system, std::uint16_t current) {
  pins_ = {{motors, static_cast<std::uint8_t>(system & BUSHD_SYSTEM_INPUTS)},
           static_cast<std::uint16_t>(current % (BUSHD_MAX_CURRENT + 1))};
  // What is no input: bytes of the keypad, most of them with a meaning.
  constexpr unsigned kBroken = 6;
  const unsigned key = system >> 4;
  if (key == kBroken) bushd_mcu_keypad_break(&mcu_);
  if (key != 0 && key < kBroken) {
    bushd_mcu_keypad_byte(&mcu_, static_cast<std::uint8_t>(0xFC + key));
  }
}

void CoreRig::trigger(std::int16_t share) {
  if (awaited_ == BUSHD_EDGE_NONE) return;
  awaited_ = BUSHD_EDGE_NONE;
  bushd_mcu_trigger(&mcu_, static_cast<std::int32_t>(std::int64_t{tick_ns_} * share / 32768));
}

void CoreRig::sample(std::uint16_t share, std::uint16_t current) {
  if (!bushd_mcu_wants_samples(&mcu_)) return;
  bushd_mcu_sample(&mcu_, static_cast<std::uint32_t>(std::uint64_t{tick_ns_} * share >> 16),
                   static_cast<std::uint16_t>(current % (BUSHD_MAX_CURRENT + 1)));
}

bushd_frame CoreRig::ask(std::uint8_t address, std::uint8_t type, Bytes payload) {
  const std::uint8_t delimiter = 0;
  feed({&delimiter, 1});
  finish();
  answers_ = 0;
  const std::uint8_t sequence = next_sequence_;
  frame(address, type, payload);
  finish();
  BUSHD_REQUIRE(answers_ == 1 && answer_.sequence == sequence);
  BUSHD_REQUIRE(answer_.type == (type | BUSHD_TYPE_REPLY));
  return answer_;
}

const bushd_report& CoreRig::next_report() {
  const std::array<std::uint8_t, 6> me = {1, address_, 0, 0, report_.number, 255};
  const bushd_frame frame = ask(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, me);
  BUSHD_REQUIRE(bushd_decode_report(frame.payload, frame.payload_size, &report_) == BUSHD_OK);
  return report_;
}

void CoreRig::check_answers() {
  next_report();
  for (unsigned i = 0; i < configuration_.queue_ticks + 2u; ++i) pass();
  const std::array<std::uint8_t, 5> at_once = {0, 0, 1, 0, 0};
  const bushd_frame identity_frame = ask(address_, BUSHD_MSG_IDENTIFY, at_once);
  bushd_identity identity;
  BUSHD_REQUIRE(bushd_decode_identity(identity_frame.payload, identity_frame.payload_size,
                                      &identity) == BUSHD_OK);
  BUSHD_REQUIRE(identity.motors == motors());
  BUSHD_REQUIRE(identity.boot_number == mcu_.config.boot_number);
  // What is new since the report before leads to the same as all at once.
  const bushd_report by_news = next_report();
  report_.number = 0;
  const bushd_report report = next_report();
  BUSHD_REQUIRE(bushd_report_is_whole(&report));
  BUSHD_REQUIRE(test::told(by_news) == test::told(report));
  BUSHD_REQUIRE(report.tick == mcu_.tick && report.motor_count == motors());
  for (std::size_t m = 0; m < motors(); ++m) {
    BUSHD_REQUIRE(static_cast<std::uint32_t>(report.motor[m].position_steps) == begun_[m]);
  }
}

bushd_inputs CoreRig::pins() const {
  return pins_ ? pins_->inputs : moving_pins(mcu_.uptime);
}

// The motor is where it was; the position has another name.
void CoreRig::take_home() {
  const std::size_t m = mcu_.homing.motor;
  counted_[m] += position(m) - begun_[m];
  begun_[m] = position(m);
}

void CoreRig::check_transmission(Bytes wire) {
  BUSHD_REQUIRE(wire.size() >= 2 && wire.size() <= BUSHD_FRAME_MAX_WIRE + 1);
  BUSHD_REQUIRE(wire.front() == 0 && wire.back() == 0);
  for (std::size_t i = 0; i < wire.size(); ++i) {
    const bool last = i + 1 == wire.size();
    BUSHD_REQUIRE(bushd_receive_byte(&listener_, wire[i], &answer_) ==
                  (last ? BUSHD_RECEIVE_FRAME : BUSHD_RECEIVE_MORE));
  }
  BUSHD_REQUIRE(answer_.address == mcu_.config.address && (answer_.type & BUSHD_TYPE_REPLY) != 0);
  ++answers_;
}

void CoreRig::check_walk(const bushd_mcu_nvm_scan& walk) {
  BUSHD_REQUIRE(walk.offset <= bushd_mcu_nvm_region_at(&mcu_, walk.index).size);
}

void CoreRig::check_restored(std::size_t size, std::uint32_t crc) {
  bushd_mcu_nvm_scan walk;
  bushd_mcu_nvm_begin_scan(&walk);
  while (bushd_mcu_nvm_scan_next(&mcu_, &walk, UINT16_MAX).at != nullptr) {
  }
  BUSHD_REQUIRE(walk.size == size && walk.crc == crc);
}

void CoreRig::adjusted(std::int32_t ns) const {
  const auto tick_ns = static_cast<std::int32_t>(tick_ns_);
  BUSHD_REQUIRE(ns >= -tick_ns / 64 && ns < tick_ns);
}

void CoreRig::count_pulses(const bushd_slot_buffer& slot_buffer) {
  std::array<std::uint32_t, BUSHD_MOTORS_PER_MCU> pulses{};
  unsigned all = 0;
  if (slot_buffer.outputs == BUSHD_OUTPUTS_LEVELS) {
    for (std::size_t m = 0; m < motors(); ++m) counted_[m] += std::uint32_t(slot_buffer.steps[m]);
    return;
  }
  for (std::size_t slot = 0; slot < kSlots; ++slot) {
    if (slot_buffer.step[slot] == 0) continue;
    all |= slot_buffer.step[slot];
    const bool common = slot_buffer.outputs == BUSHD_OUTPUTS_COMMON_DIR;
    const unsigned right = !common ? slot_buffer.direction : slot % 2 != 0 ? 0xFFFF : 0;
    for (std::size_t m = 0; m < motors(); ++m) {
      if ((slot_buffer.step[slot] >> m & 1) == 0) continue;
      ++pulses[m];
      counted_[m] += (right >> m & 1) != 0 ? 1u : 0u - 1u;
    }
  }
  BUSHD_REQUIRE(all >> motors() == 0);
  // An emergency may disable drivers before what had been prepared is made.
  const bool cut = prepared_enabled_ && (mcu_.faults & BUSHD_FAULT_DISABLED) != 0;
  BUSHD_REQUIRE(all == 0 || enabled_ || cut);
  for (const std::uint32_t made : pulses) BUSHD_REQUIRE(made <= BUSHD_MAX_STEPS_PER_TICK);
}

void CoreRig::check_motor(const bushd_mcu_motor& motor) const {
  const std::uint32_t queue_ticks = configuration_.queue_ticks;
  BUSHD_REQUIRE(motor.remainder > -256 && motor.remainder < 256);
  BUSHD_REQUIRE(motor.table < static_cast<int>(BUSHD_TABLE_BANKS));
  // The table that it must be able to run down.
  if (motor.delay != 0 || motor.mode != BUSHD_MCU_STREAM) {
    BUSHD_REQUIRE(motor.table >= 0 && (mcu_.tables.valid >> motor.table & 1) != 0);
  }
  if (motor.mode != BUSHD_MCU_RUN_WAITS && motor.mode != BUSHD_MCU_TABLE_RUN) {
    const auto known = static_cast<std::int32_t>(motor.known_until - mcu_.tick);
    BUSHD_REQUIRE(known <= static_cast<std::int32_t>(queue_ticks) + 1);
  }
  // Only a motor that moves on has an out-of-order range, beyond a gap and within the queue.
  if (motor.has_out_of_order) {
    const std::uint32_t gap = motor.out_of_order.from - motor.known_until;
    const std::uint32_t end = motor.out_of_order.until - mcu_.tick;
    BUSHD_REQUIRE(motor.delay != 0 && gap - 1 < queue_ticks && end <= queue_ticks + 1);
  }
}

void CoreRig::check_state() const {
  BUSHD_REQUIRE(mcu_.state <= BUSHD_STATE_FAULT);
  BUSHD_REQUIRE(enabled_ == ((mcu_.flags & BUSHD_FLAG_ENABLED) != 0));
  BUSHD_REQUIRE(mcu_.config.address == address_);
  BUSHD_REQUIRE(mcu_.tables.codes_used <= configuration_.codes && mcu_.tick_ns == tick_ns_);
  for (std::size_t m = 0; m < motors(); ++m) check_motor(mcu_.motor[m]);
  for (std::size_t m = motors(); m < BUSHD_MOTORS_PER_MCU; ++m) {
    BUSHD_REQUIRE(mcu_.motor[m].position_steps == 0 && mcu_.motor[m].known_until == 0);
  }
}

}  // namespace bushd::fuzz
