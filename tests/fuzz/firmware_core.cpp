// The whole MCU program on a port that only records, fed with whatever a line can carry.
//
// Input: a programme. Noise goes in as it is; frames are sent with a good checksum, since no fuzzer
// guesses one, and those that must fit the MCU's present tick, epoch, mark or table are made to.
//
// The pins move by themselves until the programme sets them.
//
// Promises checked: counters are the sum of the STEP pulses, whatever comes, and are set at rest
// only, or where homing ends; no pulse without EN; corrections of the clock within their bounds;
// every transmission is one good frame; after all of it the MCU still identifies itself and reports
// those counters. What it keeps over a reset comes back.
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "firmware/core/mcu.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kAddress = 7;
constexpr std::uint8_t kMotors = 4;
constexpr std::uint16_t kSlots = 128;
constexpr std::uint16_t kBootNumber = 4660;
constexpr std::uint16_t kQueueTicks = 16;
constexpr std::uint16_t kCodes = 24;

enum class Op : std::uint8_t {
  kNoise,       // count, bytes
  kTicksPass,   // count
  kTimeInTick,  // u16, share of the tick
  kFrame,       // flag: broadcast; type, how much later than the next tag, count, payload
  kTicks,       // TICKS whose first tick and epoch count from the MCU's
  kSync,        // SYNC that follows the last mark, this far off it
  kTableEnd,    // TABLE_END with the checksum of what is there
  kTableTicks,  // TABLE_TICKS in the same way as TICKS
  kTableRun,    // TABLE_RUN, too
  kPins,        // motors, system inputs, current
  kTrigger,     // an edge at that input, this long after the tick's beginning (or before)
  kSample,      // of the supply current
  kWork,        // pieces of what a frame asks for
  kReset,       // what is kept comes back
  kCount
};

class Mcu {
 public:
  Mcu() {
    boot();
    BUSHD_REQUIRE(mcu_.state == BUSHD_STATE_BUSY && !enabled_);
    pass();
  }

  void pass() {
    const bushd_plane* emitted = bushd_mcu_swap(&mcu_);
    begun_ = counted_;
    for (std::size_t m = 0; m < kMotors; ++m) BUSHD_REQUIRE(position(m) == begun_[m]);
    count_pulses(*emitted);
    const bool homed = mcu_.homing.stage == BUSHD_HOMING_DONE;
    bushd_mcu_prepare(&mcu_);
    if (!homed && mcu_.homing.stage == BUSHD_HOMING_DONE) take_home();
    check_state();
    BUSHD_REQUIRE((mcu_.state == BUSHD_STATE_FAULT) == (mcu_.faults != 0));
  }

  void feed(Bytes bytes) {
    for (const std::uint8_t byte : bytes) bushd_mcu_receive(&mcu_, byte, time_in_tick_ns());
    check_state();
    for (std::size_t m = 0; m < kMotors; ++m) {
      if (position(m) == begun_[m]) continue;
      BUSHD_REQUIRE(counted_[m] == begun_[m]);
      begun_[m] = counted_[m] = position(m);
    }
  }

  // The master counts its frames in their tags; `later` is how far this one is off.
  void frame(std::uint8_t address, std::uint8_t type, Bytes payload, std::uint8_t later = 0) {
    const auto tag = static_cast<std::uint8_t>(next_tag_ + later);
    next_tag_ = static_cast<std::uint8_t>(tag + 1);
    std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire;
    const std::size_t size =
        bushd_frame_encode(address, type, tag, payload.data(), payload.size(), wire.data());
    feed(Bytes(wire).first(size));
  }

  void set_pins(std::uint16_t motors, std::uint8_t system, std::uint16_t current) {
    pins_ = {{motors, static_cast<std::uint8_t>(system & BUSHD_SYSTEM_INPUTS)},
             static_cast<std::uint16_t>(current % (BUSHD_MAX_CURRENT + 1))};
  }

  // At most a tick after the edge; only if one is waited for.
  void trigger(std::int16_t share) {
    if (awaited_ == BUSHD_EDGE_NONE) return;
    awaited_ = BUSHD_EDGE_NONE;
    bushd_mcu_trigger(&mcu_, static_cast<std::int32_t>(std::int64_t{tick_ns_} * share / 32768));
  }

  void sample(std::uint16_t share, std::uint16_t current) {
    if (!bushd_mcu_wants_samples(&mcu_)) return;
    bushd_mcu_sample(&mcu_, static_cast<std::uint32_t>(std::uint64_t{tick_ns_} * share >> 16),
                     static_cast<std::uint16_t>(current % (BUSHD_MAX_CURRENT + 1)));
  }

  void work(unsigned pieces) {
    for (; pieces > 0; --pieces) bushd_mcu_work(&mcu_);
  }

  void reset() {
    std::vector<std::vector<std::uint8_t>> kept;
    for (std::uint8_t i = 0; i < 255; ++i) {
      const bushd_mcu_piece piece = bushd_mcu_kept(&mcu_, i);
      if (piece.size == 0 && piece.at == nullptr) break;
      const auto* const from = static_cast<const std::uint8_t*>(piece.at);
      kept.emplace_back(from, from + piece.size);
    }
    ++boot_number_;
    boot();
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const bushd_mcu_piece piece = bushd_mcu_kept(&mcu_, static_cast<std::uint8_t>(i));
      BUSHD_REQUIRE(piece.size == kept[i].size());
      std::copy(kept[i].begin(), kept[i].end(), static_cast<std::uint8_t*>(piece.at));
    }
    bushd_mcu_restored(&mcu_);
    begun_ = counted_ = {};
    pass();
  }

  void set_time(std::uint16_t share) { share_ = share; }
  const bushd_mcu& core() const { return mcu_; }

  // From here on exactly one answer is due; returns it.
  bushd_frame ask(std::uint8_t address, std::uint8_t type, Bytes payload) {
    const std::uint8_t delimiter = 0;
    feed({&delimiter, 1});
    answers_ = 0;
    const std::uint8_t tag = next_tag_;
    frame(address, type, payload);
    BUSHD_REQUIRE(answers_ == 1 && answer_.tag == tag);
    BUSHD_REQUIRE(answer_.type == (type | BUSHD_TYPE_REPLY));
    return answer_;
  }

  void check_answers() {
    const std::array<std::uint8_t, 5> at_once = {0, 0, 1, 0, 0};
    const bushd_frame identity_frame = ask(address_, BUSHD_MSG_IDENTIFY, at_once);
    bushd_identity identity;
    BUSHD_REQUIRE(bushd_decode_identity(identity_frame.payload, identity_frame.payload_size,
                                        &identity) == BUSHD_OK);
    BUSHD_REQUIRE(identity.motors == kMotors && identity.boot_number == boot_number_);
    const std::array<std::uint8_t, 4> me = {1, address_, 0, 0};
    const bushd_frame report_frame = ask(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, me);
    bushd_report report;
    BUSHD_REQUIRE(bushd_decode_report(report_frame.payload, report_frame.payload_size, &report) ==
                  BUSHD_OK);
    BUSHD_REQUIRE(report.tick == mcu_.tick && report.motor_count == kMotors);
    for (std::size_t m = 0; m < kMotors; ++m) {
      BUSHD_REQUIRE(static_cast<std::uint32_t>(report.motor[m].position_steps) == begun_[m]);
    }
  }

 private:
  void boot() {
    const bushd_port port = {
        .context = this,
        .transmit =
            [](void* self, const std::uint8_t* wire, std::size_t size, std::uint32_t) {
              static_cast<Mcu*>(self)->transmitted({wire, size});
            },
        .store_address =
            [](void* self, std::uint8_t address) {
              static_cast<Mcu*>(self)->address_ = address;
              return true;
            },
        .set_enable = [](void* self, bool on) { static_cast<Mcu*>(self)->enabled_ = on; },
        .set_tick = [](void* self,
                       std::uint32_t tick_ns) { static_cast<Mcu*>(self)->tick_ns_ = tick_ns; },
        .adjust_tick = [](void* self, std::int32_t ns) { static_cast<Mcu*>(self)->adjusted(ns); },
        .time_in_tick_ns = [](void* self) { return static_cast<Mcu*>(self)->time_in_tick_ns(); },
        .read_inputs = [](void* self) { return static_cast<Mcu*>(self)->pins(); },
        .read_current = [](void* self) { return static_cast<Mcu*>(self)->current(); },
        .self_test = [](void*) -> std::uint8_t { return 0; },
        .keep_enable = [](void* self, bool on) { static_cast<Mcu*>(self)->enable_at_boot_ = on; },
        .set_trigger = [](void* self,
                          bushd_edge edge) { static_cast<Mcu*>(self)->awaited_ = edge; }};
    const bushd_mcu_config config = {.address = address_,
                                     .motors = kMotors,
                                     .slots = kSlots,
                                     .boot_number = boot_number_,
                                     .reset_cause = BUSHD_RESET_WATCHDOG,
                                     .enable_at_boot = enable_at_boot_,
                                     .in_pieces = false,
                                     .queue = queue_.data(),
                                     .queue_ticks = kQueueTicks,
                                     .min_tick_ns = BUSHD_MIN_TICK_NS,
                                     .pulse_ns = 0,
                                     .lacks = 0,
                                     .codes = codes_.data(),
                                     .code_count = kCodes,
                                     .reply = reply_.data(),
                                     .unique_id = {'f', 'u', 'z', 'z'}};
    bushd_mcu_boot(&mcu_, &port, &config);
  }

  // Counters may be set to anything and then wrap.
  std::uint32_t position(std::size_t m) const {
    return static_cast<std::uint32_t>(mcu_.motor[m].position_steps);
  }

  struct Pins {
    bushd_inputs inputs;
    std::uint16_t current;
  };

  std::uint16_t current() const { return pins_ ? pins_->current : pins().motors; }

  // Switches and current come and go, every few ticks.
  bushd_inputs pins() const {
    if (pins_) return pins_->inputs;
    const std::uint32_t mixed = mcu_.uptime / 4 * 2654435761u;
    return {static_cast<std::uint16_t>(mixed >> 22), static_cast<std::uint8_t>(mixed >> 9 & 1)};
  }

  // The motor is where it was; the position has another name.
  void take_home() {
    const std::size_t m = mcu_.homing.motor;
    counted_[m] += position(m) - begun_[m];
    begun_[m] = position(m);
  }

  std::uint32_t time_in_tick_ns() const {
    return static_cast<std::uint32_t>(std::uint64_t{tick_ns_} * share_ >> 16);
  }

  void transmitted(Bytes wire) {
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

  void adjusted(std::int32_t ns) {
    const auto tick_ns = static_cast<std::int32_t>(tick_ns_);
    BUSHD_REQUIRE(ns >= -tick_ns / 64 && ns < tick_ns);
  }

  void count_pulses(const bushd_plane& plane) {
    std::array<std::uint32_t, kMotors> pulses{};
    unsigned all = 0;
    if (plane.outputs == BUSHD_OUTPUTS_LEVELS) {
      for (std::size_t m = 0; m < kMotors; ++m) counted_[m] += std::uint32_t(plane.steps[m]);
      return;
    }
    for (std::size_t slot = 0; slot < kSlots; ++slot) {
      if (plane.step[slot] == 0) continue;
      all |= plane.step[slot];
      const bool common = plane.outputs == BUSHD_OUTPUTS_COMMON_DIR;
      const unsigned right = !common ? plane.direction : slot % 2 != 0 ? 0xFFFF : 0;
      for (std::size_t m = 0; m < kMotors; ++m) {
        if ((plane.step[slot] >> m & 1) == 0) continue;
        ++pulses[m];
        counted_[m] += (right >> m & 1) != 0 ? 1u : 0u - 1u;
      }
    }
    BUSHD_REQUIRE(all >> kMotors == 0);
    BUSHD_REQUIRE(all == 0 || enabled_);
    for (std::size_t m = 0; m < kMotors; ++m) BUSHD_REQUIRE(pulses[m] <= BUSHD_MAX_STEPS_PER_TICK);
  }

  void check_state() const {
    BUSHD_REQUIRE(mcu_.state <= BUSHD_STATE_FAULT);
    BUSHD_REQUIRE(enabled_ == ((mcu_.flags & BUSHD_FLAG_ENABLED) != 0));
    BUSHD_REQUIRE(mcu_.config.address == address_);
    BUSHD_REQUIRE(mcu_.codes_used <= kCodes && mcu_.tick_ns == tick_ns_);
    for (std::size_t m = 0; m < kMotors; ++m) {
      const bushd_mcu_motor& motor = mcu_.motor[m];
      BUSHD_REQUIRE(motor.remainder > -256 && motor.remainder < 256);
      BUSHD_REQUIRE(motor.table < static_cast<int>(BUSHD_TABLE_SLOTS));
      // The table that it must be able to run down.
      if (motor.delay != 0 || motor.mode != BUSHD_MCU_STREAM) {
        BUSHD_REQUIRE(motor.table >= 0 && (mcu_.valid_tables >> motor.table & 1) != 0);
      }
      if (motor.mode != BUSHD_MCU_RUN_WAITS && motor.mode != BUSHD_MCU_TABLE_RUN) {
        BUSHD_REQUIRE(static_cast<std::int32_t>(motor.known_until - mcu_.tick) <= kQueueTicks + 1);
      }
      // Only a motor that moves on has an island, beyond a gap and within the queue.
      if (motor.has_island) {
        const std::uint32_t gap = motor.island.from - motor.known_until;
        const std::uint32_t end = motor.island.until - mcu_.tick;
        BUSHD_REQUIRE(motor.delay != 0 && gap - 1 < kQueueTicks && end <= kQueueTicks + 1u);
      }
    }
    for (std::size_t m = kMotors; m < BUSHD_MOTORS_PER_MCU; ++m) {
      BUSHD_REQUIRE(mcu_.motor[m].position_steps == 0 && mcu_.motor[m].known_until == 0);
    }
  }

  // On the heap, each by itself: there a sanitizer sees what lies beside them.
  std::vector<std::int16_t> queue_ = std::vector<std::int16_t>(kQueueTicks * kMotors);
  std::vector<std::uint16_t> codes_ = std::vector<std::uint16_t>(kCodes);
  std::vector<std::uint8_t> reply_ = std::vector<std::uint8_t>(BUSHD_MCU_MAX_REPLY);
  bushd_mcu mcu_{};
  bushd_receiver listener_{};
  bushd_frame answer_{};
  int answers_ = 0;
  std::uint16_t boot_number_ = kBootNumber;
  std::uint8_t next_tag_ = 0;
  bool enable_at_boot_ = false;
  bushd_edge awaited_ = BUSHD_EDGE_NONE;
  std::optional<Pins> pins_;
  std::uint8_t address_ = kAddress;
  bool enabled_ = true;
  std::uint32_t tick_ns_ = 0;
  std::uint16_t share_ = 0;
  std::array<std::uint32_t, kMotors> begun_{};    // at the beginning of the present tick
  std::array<std::uint32_t, kMotors> counted_{};  // at its end
};

// A frame's payload, as far as the input provides it; zeros after.
struct Payload {
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> bytes{};
  std::size_t size = 0;

  void take(Input& input, std::size_t count) {
    count = std::min(count, bytes.size() - size);
    const Bytes taken = input.bytes(count);
    std::copy(taken.begin(), taken.end(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    size += count;
  }
  Bytes view() const { return Bytes(bytes).first(size); }
};

void send_frame(Mcu& mcu, Input& input) {
  const std::uint8_t address = (input.u8() & 1) != 0 ? BUSHD_ADDRESS_BROADCAST : kAddress;
  const std::uint8_t type = input.u8();
  const std::uint8_t later = input.u8();
  Payload payload;
  payload.take(input, input.u8());
  mcu.frame(address == kAddress ? mcu.core().config.address : address, type, payload.view(), later);
}

void send_ticks(Mcu& mcu, Input& input) {
  const std::uint8_t epoch = static_cast<std::uint8_t>(mcu.core().epoch + input.u8());
  const std::uint8_t flags = input.u8();
  const std::uint32_t first =
      mcu.core().tick + static_cast<std::uint32_t>(static_cast<std::int8_t>(input.u8()));
  const std::uint8_t count = input.u8();
  const std::uint8_t mask = input.u8();
  Payload payload;
  const std::array<std::uint16_t, 8> delays{};
  std::size_t motors = 0;
  payload.size = BUSHD_TICKS_HEADER;
  bushd_encode_ticks_head(epoch, flags, first, count, mask, delays.data(), payload.bytes.data());
  for (unsigned m = 0; m < 8; ++m) motors += mask >> m & 1;
  const std::size_t width = (flags & BUSHD_TICKS_FINE) != 0 ? 2 : 1;
  payload.take(input, 2 * motors);
  payload.take(input, width * motors * count);
  mcu.frame(mcu.core().config.address, BUSHD_MSG_TICKS, payload.view());
}

void send_table_ticks(Mcu& mcu, Input& input) {
  const std::uint8_t epoch = static_cast<std::uint8_t>(mcu.core().epoch + input.u8());
  const std::uint8_t flags = input.u8();
  const std::uint32_t first =
      mcu.core().tick + static_cast<std::uint32_t>(static_cast<std::int8_t>(input.u8()));
  const std::uint16_t count = input.u8();
  Payload payload;
  payload.size =
      bushd_encode_table_ticks(epoch, flags, first, count, nullptr, 0, payload.bytes.data());
  payload.take(input, input.u8() % (2 * BUSHD_TABLE_TICKS_MAX_ENTRY));
  mcu.frame(mcu.core().config.address, BUSHD_MSG_TABLE_TICKS, payload.view());
}

void send_table_run(Mcu& mcu, Input& input) {
  const std::uint8_t epoch = static_cast<std::uint8_t>(mcu.core().epoch + input.u8() % 2u);
  const std::uint32_t first = mcu.core().tick + input.u8() % 24u;
  std::array<bushd_table_run_entry, kMotors> entries{};
  const auto count = static_cast<std::uint8_t>(1 + input.u8() % kMotors);
  for (std::uint8_t i = 0; i < count; ++i) {
    const std::uint8_t how = input.u8();
    entries[i] = {.motor = i,
                  .slot = static_cast<std::uint8_t>(how % BUSHD_TABLE_SLOTS),
                  .direction = static_cast<std::int8_t>((how & 0x80) != 0 ? 1 : -1),
                  .steps = (how & 0x40) != 0 ? 0xFFFFu * input.u16() : input.u8()};
  }
  Payload payload;
  payload.size = bushd_encode_table_run(epoch, first, entries.data(), count, payload.bytes.data());
  mcu.frame(mcu.core().config.address, BUSHD_MSG_TABLE_RUN, payload.view());
}

void send_sync(Mcu& mcu, Input& input) {
  const std::uint8_t mark = input.u8();
  const std::uint32_t tick_ns = mcu.core().tick_ns;
  const bushd_mcu_clock& clock = mcu.core().clock;
  const std::uint32_t later_ns =
      static_cast<std::uint32_t>(std::uint64_t{tick_ns} * input.u16() >> 16);
  const std::uint32_t later_ticks =
      static_cast<std::uint32_t>(static_cast<std::int8_t>(input.u8()));
  const bushd_sync sync = {.master = static_cast<std::uint16_t>(clock.master + mark % 4 / 3),
                           .mark = clock.mark + mark / 4u,
                           .follows = true,
                           .known_mark = clock.mark,
                           .mark_tick = clock.mark_tick + later_ticks,
                           .mark_ns = (clock.mark_ns + later_ns) % tick_ns};
  Payload payload;
  payload.size = bushd_encode_sync(&sync, payload.bytes.data());
  mcu.frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, payload.view());
}

void send_table_end(Mcu& mcu, Input& input) {
  bushd_table_end end = {.slot = static_cast<std::uint8_t>(input.u8() % BUSHD_TABLE_SLOTS),
                         .crc = 0};
  const bushd_mcu_table& table = mcu.core().table[end.slot];
  if (table.table.accel.count != 0) end.crc = bushd_table_crc32(&table.table);
  Payload payload;
  payload.size = bushd_encode_table_end(&end, payload.bytes.data());
  mcu.frame(mcu.core().config.address, BUSHD_MSG_TABLE_END, payload.view());
}

void run(Input input) {
  Mcu mcu;
  while (!input.empty()) {
    switch (static_cast<Op>(input.u8() % static_cast<unsigned>(Op::kCount))) {
      case Op::kNoise:
        mcu.feed(input.bytes(input.u8()));
        break;
      case Op::kTicksPass:
        for (unsigned i = input.u8() % 16u; i > 0; --i) mcu.pass();
        break;
      case Op::kTimeInTick:
        mcu.set_time(input.u16());
        break;
      case Op::kFrame:
        send_frame(mcu, input);
        break;
      case Op::kTicks:
        send_ticks(mcu, input);
        break;
      case Op::kSync:
        send_sync(mcu, input);
        break;
      case Op::kTableEnd:
        send_table_end(mcu, input);
        break;
      case Op::kTableTicks:
        send_table_ticks(mcu, input);
        break;
      case Op::kTableRun:
        send_table_run(mcu, input);
        break;
      case Op::kPins: {
        const std::uint16_t motors = input.u16();
        const std::uint8_t system = input.u8();
        mcu.set_pins(motors, system, input.u16());
        break;
      }
      case Op::kTrigger:
        mcu.trigger(static_cast<std::int16_t>(input.u16()));
        break;
      case Op::kSample: {
        const std::uint16_t share = input.u16();
        mcu.sample(share, input.u16());
        break;
      }
      case Op::kWork:
        mcu.work(input.u8() % 16u);
        break;
      case Op::kReset:
        mcu.reset();
        break;
      case Op::kCount:
        break;
    }
  }
  // The queue runs out, and motors begin to run down.
  for (unsigned i = 0; i < kQueueTicks + 2u; ++i) mcu.pass();
  mcu.check_answers();
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({data, size});
  return 0;
}
