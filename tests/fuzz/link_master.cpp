// The master of a bus whose MCUs answer what they like, when they like, and whose daemon asks for
// whatever it may.
//
// Input: a programme. Noise goes in as it is. An answer is a frame to the request that is awaited,
// with a payload of the input's own, or with a fitting one of which a few bytes are overwritten:
// no fuzzer guesses a sequence and a checksum.
//
// Promises checked: what is sent are frames that an MCU's decoders accept, nothing is sent while an
// answer is awaited, ticks are asked for within the source's promise, and what is seen of an MCU is
// consistent. A sane bus comes online afterwards, whatever was before.
#include <algorithm>
#include <array>
#include <vector>

#include "fuzz/link_bus.h"

namespace bushd::fuzz {
namespace {

enum class Op : std::uint8_t {
  kNoise,     // count, bytes
  kWait,      // u16, microseconds x 8
  kSpeak,     // own answer: count, payload
  kAnswer,    // fitting answer: u8 spoilt bytes, each place and value
  kBegin,     // mcu, motor, ticks later
  kReplace,   // mcu, mask, ticks later
  kDrop,      // mcu, motor
  kPosition,  // mcu, motor, u16
  kControl,   // mcu, actions
  kPort,      // lost and opened again
  kReconfigure,
  kTableRun,   // mcu, motor, ticks later
  kEmergency,  // how
  kHome,       // mcu, motor, u16 steps
  kArm,        // mcu, mask, u16 us
  kDisarm,     // mcu
  kStarted,    // mcu, motor, ticks later: the trigger has come
  kRequest,    // mcu, motor, arrivals
  kProgram,    // mcu, what, u16
  kCount
};

void answer_spoilt(Bus& bus, Input& input) {
  std::vector<std::uint8_t> payload = bus.fitting_answer();
  for (unsigned i = input.u8() % 8u; i > 0; --i) {
    const std::uint8_t at = input.u8();
    const std::uint8_t value = input.u8();
    if (!payload.empty()) payload[at % payload.size()] = value;
  }
  bus.answer(payload);
}

void begin(Bus& bus, Input& input, bool whole) {
  const link::McuIndex mcu{input.u8() % kMcus};
  const auto motor = static_cast<std::uint8_t>(input.u8() % kMotors);
  const std::uint8_t later = input.u8();
  const std::uint8_t length = input.u8();
  if (!bus.online(mcu) || !bus.master().time_known()) return;
  const link::Tick start = bus.master().earliest_start(bus.now_us(), mcu, motor) + later;
  bus.source().start[mcu.value][motor] = start;
  bus.source().length[mcu.value][motor] = length;
  if (later % 2 != 0) bus.master().confirm_start(start);
  if (whole) {
    bus.master().begin_table_run(mcu, motor, start, {length - 128 == 0 ? 1 : length - 128});
  } else {
    bus.master().begin(mcu, motor, start);
  }
}

void replace(Bus& bus, Input& input) {
  const link::McuIndex mcu{input.u8() % kMcus};
  const auto mask = static_cast<std::uint16_t>(input.u8() % (1u << kMotors));
  const std::uint8_t later = input.u8();
  if (!bus.online(mcu) || !bus.master().time_known()) return;
  link::Tick first = bus.master().earliest_replace(bus.now_us(), {}) + later;
  for (const link::Tick start : bus.source().start[mcu.value]) first = std::max(first, start);
  bus.master().replace(mcu, mask, first);
}

void arm(Bus& bus, Input& input) {
  const link::McuIndex mcu{input.u8() % kMcus};
  const unsigned mask = 1u + input.u8() % ((1u << kMotors) - 1u);
  const std::uint32_t delay_us = BUSHD_TRIGGER_MIN_DELAY_US + input.u16();
  if (!bus.online(mcu) || !bus.master().can(mcu, BUSHD_CAN_TRIGGER)) return;
  if (bus.master().view(mcu).report.armed != 0) return;
  std::vector<link::Rs485Master::Armed> moves;
  for (std::uint8_t m = 0; m < kMotors; ++m) {
    if ((mask >> m & 1) != 0) moves.push_back({.motor = m, .run = {m % 2 == 0 ? 70 : -70, m}});
  }
  bus.master().arm(mcu, BUSHD_EDGE_RISING, delay_us, moves);
}

void started(Bus& bus, Input& input) {
  const link::McuIndex mcu{input.u8() % kMcus};
  const auto motor = static_cast<std::uint8_t>(input.u8() % kMotors);
  const std::uint8_t later = input.u8();
  if (!bus.online(mcu) || !bus.master().time_known()) return;
  const link::Tick start = bus.master().earliest_start(bus.now_us(), mcu, motor) + later;
  bus.source().start[mcu.value][motor] = start;
  bus.source().length[mcu.value][motor] = 90;
  bus.master().follow_run(mcu, motor, start, link::TableRun{70});
}

// Stands for all that an MCU only acknowledges.
void request(Bus& bus, Input& input) {
  const link::McuIndex mcu{input.u8() % kMcus};
  const auto motor = static_cast<std::uint8_t>(input.u8() % kMotors);
  const auto arrivals = static_cast<std::uint8_t>(input.u8() % 4u);
  if (!bus.online(mcu) || !bus.master().can(mcu, BUSHD_CAN_POSITION_COMPARE)) return;
  bus.master().ask(mcu, bushd_position_compare{.motor = motor,
                                               .arrivals = arrivals,
                                               .position_steps = 70,
                                               .delay_us = 100,
                                               .width_us = 40});
}

void home(Bus& bus, Input& input) {
  const link::McuIndex mcu{input.u8() % kMcus};
  const auto motor = static_cast<std::uint8_t>(input.u8() % kMotors);
  const std::uint16_t steps = input.u16();
  if (!bus.online(mcu)) return;
  bus.master().home(mcu, {.motor = motor,
                          .direction = -1,
                          .most_steps = steps,
                          .shortest_delay = 9,
                          .slow_steps = 100,
                          .slow_delay = 1000,
                          .position_steps = 7});
}

void program(Bus& bus, Input& input) {
  link::Rs485Master& master = bus.master();
  const link::McuIndex mcu{input.u8() % kMcus};
  const std::uint8_t what = input.u8() % 6u;
  const std::uint16_t value = input.u16();
  if (what == 0) {
    return master.stop_program(mcu, value % 2 == 0 ? BUSHD_STOP_RAMP : BUSHD_STOP_IMMEDIATE);
  }
  if (!bus.online(mcu) || !master.can(mcu, BUSHD_CAN_PROGRAM)) return;
  const link::ProgramView& view = master.program(mcu);
  BUSHD_REQUIRE(view.put <= view.total);
  if (what == 1) {
    master.put_program(mcu, std::vector<std::uint8_t>(1 + value % 9000u, std::uint8_t{7}));
  } else if (what == 2) {
    master.erase_program(mcu);
  } else if (what == 3) {
    master.pause_program(mcu);
  } else if (what == 4) {
    master.resume_program(mcu);
  } else if (master.time_known()) {
    const link::Tick start = master.earliest_program_start(bus.now_us(), {&mcu, 1});
    master.run_program(mcu, static_cast<std::uint8_t>(1 + value % 255u), start + value / 255);
  }
}

void run_op(Op op, Bus& bus, Input& input) {
  link::Rs485Master& master = bus.master();
  switch (op) {
    case Op::kNoise:
      return bus.receive(input.bytes(input.u8()));
    case Op::kWait:
      return bus.wait(std::int64_t{input.u16()} * 8);
    case Op::kSpeak:
      return bus.answer(input.bytes(std::min<std::size_t>(input.u8(), BUSHD_FRAME_MAX_PAYLOAD)));
    case Op::kAnswer:
      return answer_spoilt(bus, input);
    case Op::kBegin:
      return begin(bus, input, false);
    case Op::kReplace:
      return replace(bus, input);
    case Op::kDrop: {
      const link::McuIndex mcu{input.u8() % kMcus};
      return master.drop(mcu, static_cast<std::uint8_t>(input.u8() % kMotors));
    }
    case Op::kPosition: {
      const link::McuIndex mcu{input.u8() % kMcus};
      const auto motor = static_cast<std::uint8_t>(input.u8() % kMotors);
      return master.set_position(mcu, motor, input.u16() - 32768);
    }
    case Op::kControl: {
      constexpr std::array<std::uint8_t, 4> kActions = {1, 2, 4, 5};
      const link::McuIndex mcu{input.u8() % kMcus};
      return master.control(mcu, kActions[input.u8() % kActions.size()]);
    }
    case Op::kPort:
      return bus.lose_port();
    case Op::kReconfigure: {
      const link::McuIndex mcu{input.u8() % kMcus};
      return master.reconfigure(mcu, mcu_setup(static_cast<std::uint8_t>(mcu.value + 1)));
    }
    case Op::kTableRun:
      return begin(bus, input, true);
    case Op::kEmergency:
      return master.emergency_stop(static_cast<bushd_stop_mode>(input.u8() % 3));
    case Op::kHome:
      return home(bus, input);
    case Op::kArm:
      return arm(bus, input);
    case Op::kDisarm: {
      const link::McuIndex mcu{input.u8() % kMcus};
      if (bus.online(mcu)) master.disarm(mcu);
      return;
    }
    case Op::kStarted:
      return started(bus, input);
    case Op::kRequest:
      return request(bus, input);
    case Op::kProgram:
      return program(bus, input);
    case Op::kCount:
      return;
  }
}

// Answers everything at once, as it should be.
void recover(Bus& bus) {
  constexpr int kMaxAnswers = 3000;
  for (int i = 0; i < kMaxAnswers && !bus.all_online(); ++i) {
    bus.answer(bus.fitting_answer());
    bus.wait(10'000);
  }
  BUSHD_REQUIRE(bus.all_online());
}

void run(Input input) {
  Bus bus;
  while (!input.empty()) {
    const auto op = static_cast<Op>(input.u8() % static_cast<unsigned>(Op::kCount));
    run_op(op, bus, input);
    bus.step();
  }
  recover(bus);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({data, size});
  return 0;
}
