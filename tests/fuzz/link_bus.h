// A bus for the fuzzer of its master: the master, a source of ticks, and what sane MCUs would
// answer.
//
// It checks what is sent and what is seen of the MCUs (link_master.cpp has the promises).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "bus/rs485/master.h"
#include "engine/message_text.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {

using Bytes = std::span<const std::uint8_t>;

inline constexpr std::size_t kMcus = 2;
inline constexpr std::uint8_t kMotors = 3;
inline constexpr std::uint32_t kTickNs = 2'560'000;
inline constexpr std::uint16_t kBootNumber = 4660;
inline constexpr std::int64_t kMinPatienceUs = 10'000;  // docs/protocol.md, Wire

inline constexpr std::array<std::uint16_t, 4> kCodes = {250, 200, 150, 100};
inline const bushd_table kTable = {
    .accel =
        {.code = kCodes.data(), .count = 4, .sum = nullptr, .bucket = nullptr, .bucket_shift = 0},
    .decel =
        {.code = kCodes.data(), .count = 4, .sum = nullptr, .bucket = nullptr, .bucket_shift = 0},
    .cruise = 100,
    .time_unit_ns = 40000};

inline link::McuSetup mcu_setup(std::uint8_t address) {
  link::McuSetup setup{.address = {address}, .tables = {{&kTable, 3}}, .table_of_motor = {}};
  for (std::size_t m = 0; m < kMotors; ++m) setup.table_of_motor[m] = 0;
  if (address == 2) {
    setup.emission.settings = {.mode = BUSHD_EMISSION_BURST,
                               .sequence = 0,
                               .hold_current = false,
                               .step_us = 50,
                               .settle_us = 0,
                               .dir_setup_us = 0,
                               .pulse_us = 2};
    setup.inputs.limit_negative = 1;
    setup.local.motors = 2;
  }
  return setup;
}

// Every motor moves until a tick of its own.
class Source : public link::TickSource {
 public:
  std::uint16_t render(link::McuIndex index, std::uint8_t motor, link::Tick first, unsigned count,
                       std::int16_t* out, std::size_t stride) override {
    const std::size_t mcu = index.value;
    BUSHD_REQUIRE(mcu < kMcus && motor < kMotors && count >= 1 && stride >= 1);
    BUSHD_REQUIRE(first >= start[mcu][motor]);
    for (unsigned i = 0; i < count; ++i) out[i * stride] = 65;
    return first + count < end_tick(index, motor) ? 100 : 0;
  }

  // Odd motors run by their table, at its cruise delay.
  std::optional<RunSegment> run_at(link::McuIndex index, std::uint8_t motor, link::Tick first,
                                   unsigned max_ticks) override {
    const std::size_t mcu = index.value;
    BUSHD_REQUIRE(mcu < kMcus && motor < kMotors && max_ticks >= 1);
    BUSHD_REQUIRE(first >= start[mcu][motor]);
    if (motor % 2 == 0 || first >= end_tick(index, motor)) return std::nullopt;
    bushd_run_state state{};
    state.direction = 1;
    state.cruises = true;
    RunSegment segment{};
    BUSHD_REQUIRE(bushd_run_restore(&segment.run, &kTable, &state));
    const link::Tick left = end_tick(index, motor) - first;
    segment.ticks = static_cast<unsigned>(std::min<link::Tick>(left, max_ticks));
    return segment;
  }

  link::Tick end_tick(link::McuIndex index, std::uint8_t motor) override {
    return start[index.value][motor] + length[index.value][motor];
  }

  std::array<std::array<link::Tick, kMotors>, kMcus> start{};
  std::array<std::array<link::Tick, kMotors>, kMcus> length{};
};

// What an MCU answers that is as the master wants it.
struct SaneMcu {
  bool configured = false;
  bool synced = false;
  bool enabled = false;
  std::uint8_t stopped = 0;  // the faults of an emergency stop
  std::uint32_t sync_id = 0;
  bool marked = false;
  std::int64_t marked_at_us = 0;
};

class Bus {
 public:
  Bus()
      : master_({.baud = 500'000,
                 .tick_ns = kTickNs,
                 .format = BUSHD_FORMAT_FINE,
                 .mcus = {mcu_setup(1), mcu_setup(2)}},
                source_) {
    master_.port_opened(now_us_);
    step();
  }

  void wait(std::int64_t us) {
    now_us_ += us;
    step();
  }

  void receive(Bytes bytes) {
    for (const std::uint8_t byte : bytes) {
      bushd_frame frame;
      const bool complete = bushd_receive_byte(&answers_, byte, &frame) == BUSHD_RECEIVE_FRAME;
      if (complete && awaited_ && frame.sequence == awaited_->sequence) answered(frame.address);
    }
    master_.receive(now_us_, bytes);
    step();
  }

  void lose_port() {
    master_.port_lost(now_us_, "adapter gone");
    BUSHD_REQUIRE(master_.step(now_us_).empty());
    master_.port_opened(now_us_);
    awaited_.reset();
    answers_ = {};
    step();
  }

  // To the request that is awaited; nothing if none is.
  void answer(Bytes payload) {
    if (!awaited_) return;
    std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE + 1> wire;
    const auto type = static_cast<std::uint8_t>(awaited_->type | BUSHD_TYPE_REPLY);
    wire[0] = 0;  // ends whatever noise was before
    const std::size_t size =
        bushd_frame_encode(awaited_->addresses.front(), type, awaited_->sequence, payload.data(),
                           payload.size(), &wire[1]);
    receive(Bytes(wire).first(size + 1));
  }

  std::vector<std::uint8_t> fitting_answer() const {
    std::vector<std::uint8_t> payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(awaited_ ? fit(payload.data()) : 0);
    return payload;
  }

  link::Rs485Master& master() { return master_; }
  Source& source() { return source_; }
  std::int64_t now_us() const { return now_us_; }
  bool online(link::McuIndex mcu) const {
    return master_.view(mcu).phase == link::McuPhase::kOnline;
  }

  bool all_online() const { return online(link::McuIndex{0}) && online(link::McuIndex{1}); }

  void step() {
    const Bytes sent = master_.step(now_us_);
    if (!sent.empty() && awaited_ && now_us_ > awaited_->sent_us + kMinPatienceUs) awaited_.reset();
    for (const std::uint8_t byte : sent) {
      bushd_frame frame;
      const bushd_receive result = bushd_receive_byte(&receiver_, byte, &frame);
      BUSHD_REQUIRE(result == BUSHD_RECEIVE_MORE || result == BUSHD_RECEIVE_FRAME);
      if (result == BUSHD_RECEIVE_FRAME) heard(frame);
    }
    BUSHD_REQUIRE(receiver_.size == 0);
    for (const link::Event& event : master_.take_events()) {
      std::visit(
          [](const auto& what) {
            if constexpr (requires { what.mcu; }) BUSHD_REQUIRE(what.mcu.value < kMcus);
          },
          event);
      const auto* const missed = std::get_if<link::StartMissed>(&event);
      BUSHD_REQUIRE(missed == nullptr || missed->motor < BUSHD_MOTORS_PER_MCU);
    }
    for (std::size_t i = 0; i < kMcus; ++i) check(master_.view(link::McuIndex{i}));
  }

 private:
  struct Awaited {
    std::vector<std::uint8_t> addresses;  // who has not answered yet, by window
    std::uint8_t type;
    std::uint8_t sequence;
    std::int64_t sent_us;
  };

  // After the last one has answered nobody is waited for.
  void answered(std::uint8_t address) {
    if (address == awaited_->addresses.back()) {
      awaited_.reset();
    } else {
      std::erase(awaited_->addresses, address);
    }
  }

  static void check(const link::McuView& view) {
    if (view.phase != link::McuPhase::kOffline) BUSHD_REQUIRE(view.identified);
    if (view.phase != link::McuPhase::kOnline) {
      BUSHD_REQUIRE(!view.detail.empty());
      return;
    }
    BUSHD_REQUIRE(view.reported && view.report.motor_count <= BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(view.report.boot_number == view.identity.boot_number);
    for (std::size_t m = 0; m < view.report.motor_count; ++m) {
      BUSHD_REQUIRE(view.known_until[m] >= view.tick);
    }
  }

  // A frame of the master, as an MCU sees it.
  void heard(const bushd_frame& frame) {
    // An emergency does not wait for the last answer.
    BUSHD_REQUIRE(!awaited_ || frame.type == BUSHD_MSG_EMERGENCY);
    BUSHD_REQUIRE((frame.type & BUSHD_TYPE_REPLY) == 0 && frame.address <= kMcus);
    const bool to_all = frame.type == BUSHD_MSG_SYNC || frame.type == BUSHD_MSG_POLL;
    const bool to_any = frame.type == BUSHD_MSG_EMERGENCY;
    BUSHD_REQUIRE(to_any || (frame.address == BUSHD_ADDRESS_BROADCAST) == to_all);
    BUSHD_REQUIRE(acceptable(frame));
    switch (frame.type) {
      case BUSHD_MSG_SYNC:
        return sync(frame);
      case BUSHD_MSG_TICKS:
      case BUSHD_MSG_TABLE_TICKS:
      case BUSHD_MSG_TABLE_RUN:
      case BUSHD_MSG_LINE_RUN:
        return;
      case BUSHD_MSG_EMERGENCY:
        for (std::uint8_t address = 1; address <= kMcus; ++address) {
          const bool to_it = frame.address == BUSHD_ADDRESS_BROADCAST || frame.address == address;
          if (to_it) stop(frame, &mcus_[address - 1u]);
        }
        return;
      case BUSHD_MSG_POLL:
        awaited_ = Awaited{polled(frame), frame.type, frame.sequence, now_us_};
        return;
      default:
        awaited_ = Awaited{{frame.address}, frame.type, frame.sequence, now_us_};
        obey(frame, &mcus_[frame.address - 1u]);
    }
  }

  static std::vector<std::uint8_t> polled(const bushd_frame& frame) {
    bushd_poll poll;
    bushd_decode_poll(frame.payload, frame.payload_size, &poll);
    std::map<std::uint16_t, std::uint8_t> by_begin;
    for (std::uint8_t address = 1; address <= kMcus; ++address) {
      bushd_poll_entry entry;
      if (bushd_poll_find(&poll, address, &entry)) by_begin[entry.begin_units] = address;
    }
    BUSHD_REQUIRE(by_begin.size() == poll.count);
    std::vector<std::uint8_t> addresses;
    for (const auto& window : by_begin) addresses.push_back(window.second);
    return addresses;
  }

  // A request; travels are not asked for here, and addresses are given by people.
  static bool acceptable(const bushd_frame& frame) {
    return (frame.type & BUSHD_TYPE_REPLY) == 0 && frame.type != BUSHD_MSG_TRAVEL &&
           frame.type != BUSHD_MSG_SET_ADDRESS && test::is_message(frame);
  }

  void sync(const bushd_frame& frame) {
    bushd_sync message;
    bushd_decode_sync(frame.payload, frame.payload_size, &message);
    for (SaneMcu& mcu : mcus_) {
      if (!mcu.configured) continue;
      if (mcu.marked && message.follows && message.follow_up_id == mcu.sync_id) mcu.synced = true;
      mcu.marked = true;
      mcu.sync_id = message.sync_id;
      mcu.marked_at_us = now_us_;
    }
  }

  // By a stop that disables it is disabled, whatever its identity was: an answer may have said so.
  static void stop(const bushd_frame& frame, SaneMcu* mcu) {
    mcu->stopped |= BUSHD_FAULT_EMERGENCY;
    if (frame.payload[0] != BUSHD_STOP_DISABLE) return;
    mcu->stopped |= BUSHD_FAULT_DISABLED;
    mcu->enabled = false;
  }

  static void obey(const bushd_frame& frame, SaneMcu* mcu) {
    if (frame.type == BUSHD_MSG_CONFIGURE) mcu->configured = true;
    if (frame.type == BUSHD_MSG_CONTROL && (frame.payload[0] & BUSHD_CONTROL_ENABLE) != 0) {
      mcu->enabled = true;
    }
    if (frame.type == BUSHD_MSG_CONTROL && (frame.payload[0] & BUSHD_CONTROL_CLEAR_FAULTS) != 0) {
      const bool named = frame.payload_size > 1;
      if (!named || (frame.payload[1] & BUSHD_FAULT_EMERGENCY) != 0) mcu->stopped = 0;
    }
  }

  std::size_t fit(std::uint8_t* payload) const {
    if (awaited_->type == BUSHD_MSG_IDENTIFY) {
      const bushd_identity identity = {.protocol_version = BUSHD_PROTOCOL_VERSION,
                                       .motors = kMotors,
                                       .firmware_version = 1,
                                       .boot_number = kBootNumber,
                                       .slots = 128,
                                       .queue_ticks = 64,
                                       .table_codes = 100,
                                       .capabilities = UINT16_MAX | BUSHD_CAN_CLEAR_NAMED |
                                                       BUSHD_CAN_PROGRAM | BUSHD_CAN_ELEMENTARY,
                                       .unique_id = {awaited_->addresses.front()}};
      return bushd_encode_identity(&identity, payload);
    }
    if (awaited_->type == BUSHD_MSG_POLL) {
      const bushd_report report = sane_report(mcus_[awaited_->addresses.front() - 1u]);
      return bushd_encode_report(&report, payload);
    }
    if (awaited_->type == BUSHD_MSG_TABLES) {
      const bushd_tables none{};
      return bushd_encode_tables(&none, payload);
    }
    if (awaited_->type == BUSHD_MSG_PROGRAM_STATE) {
      bushd_program_state none{};
      none.memory = 8192;
      return bushd_encode_program_state(&none, payload);
    }
    const bushd_acknowledgement done = {BUSHD_OK};
    return bushd_encode_acknowledgement(&done, payload);
  }

  bushd_report sane_report(const SaneMcu& mcu) const {
    const auto tick_us = static_cast<std::int64_t>(kTickNs / 1000);
    bushd_report report{};
    const bool ready = mcu.configured && mcu.synced && mcu.enabled;
    report.state = mcu.stopped != 0 ? BUSHD_STATE_FAULT
                   : ready          ? BUSHD_STATE_READY
                                    : BUSHD_STATE_BUSY;
    report.faults = mcu.stopped;
    report.flags = static_cast<std::uint8_t>(
        (mcu.configured ? BUSHD_FLAG_CONFIGURED : 0) | (mcu.synced ? BUSHD_FLAG_SYNCED : 0) |
        (mcu.enabled ? BUSHD_FLAG_ENABLED : 0) | (mcu.marked ? BUSHD_FLAG_SYNC_HEARD : 0));
    report.boot_number = kBootNumber;
    // All of it, as an MCU may.
    report.number = static_cast<std::uint8_t>(1 + now_us_ / 1000 % 255);
    report.sections = BUSHD_TELLS_ALL;
    report.motors = (1u << kMotors) - 1u;
    report.tick = static_cast<std::uint32_t>(now_us_ / tick_us);
    report.tick_ns = static_cast<std::uint32_t>(now_us_ % tick_us * 1000);
    report.sync_id = mcu.sync_id;
    report.sync_tick = static_cast<std::uint32_t>(mcu.marked_at_us / tick_us);
    report.sync_ns = static_cast<std::uint32_t>(mcu.marked_at_us % tick_us * 1000);
    report.motor_count = kMotors;
    for (std::size_t m = 0; m < kMotors; ++m) {
      report.motor[m].known_until = static_cast<std::uint16_t>(report.tick + 2);
    }
    return report;
  }

  Source source_;
  link::Rs485Master master_;
  std::array<SaneMcu, kMcus> mcus_;
  bushd_receiver receiver_{};  // of what the master sends
  bushd_receiver answers_{};   // of what it hears
  std::optional<Awaited> awaited_;
  std::int64_t now_us_ = 1'000'000;
};

}  // namespace bushd::fuzz
