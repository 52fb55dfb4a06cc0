// The program of a commutator board, whatever bytes and inputs come at whatever times: it does what
// the board of lib/sim does, which shares no code with it.
//
// Input: F_start, then operations of four bytes, what, which and a time of 16 bits.
#include "sim/commutator_board.h"

#include "firmware/commutator/commutator.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

using sim::TimeNs;

constexpr std::uint32_t kCountsPerS = 2'000'000;
constexpr TimeNs kCountNs = 500;
constexpr TimeNs kLatestNs = 2 * kCountNs;  // tests/firmware/commutator says why

// Rotors follow at once, as in the model.
class Program {
 public:
  explicit Program(std::uint32_t start_hz) { bushd_commutator_begin(&core, start_hz, kCountsPerS); }

  // Until then; true: it has made a step, or could not.
  bool advance(TimeNs now_ns, const sim::BoardMotors& around) {
    if (!bushd_commutator_is_due(&core, counts(now_ns))) return false;
    const unsigned motor = core.motor;
    const std::uint8_t before = bushd_commutator_windings(&core, core.motor);
    const bool done = bushd_commutator_step(&core, inputs(motor, around));
    const std::uint8_t after = bushd_commutator_windings(&core, static_cast<std::uint8_t>(motor));
    BUSHD_REQUIRE(done == (before != after));
    if (done) motors.switch_windings(now_ns, motor, after);
    answer = bushd_commutator_status(done, inputs(motor, around));
    return true;
  }
  static std::uint32_t counts(TimeNs ns) { return static_cast<std::uint32_t>(ns / kCountNs); }

  bushd_commutator core{};
  sim::BoardMotors motors;
  std::uint8_t answer = 0;

 private:
  std::uint8_t inputs(unsigned motor, const sim::BoardMotors& around) const {
    unsigned bits = 0;
    if (motors.position(motor) >= around.motor(motor).right_limit_at) bits |= 1;
    if (motors.position(motor) <= around.motor(motor).left_limit_at) bits |= 2;
    if (!around.supply) bits |= 4;
    if (!around.motor(motor).connected) bits |= 8;
    return static_cast<std::uint8_t>(bits);
  }
};

void change(sim::BoardMotors& motors, std::uint8_t which) {
  const unsigned motor = which % 8u;
  const std::int64_t near = which / 64 - 1;
  switch (which / 8 % 4) {
    case 0:
      motors.supply = !motors.supply;
      break;
    case 1:
      motors.motor(motor).connected = !motors.motor(motor).connected;
      break;
    case 2:
      motors.motor(motor).right_limit_at = near + 2;
      break;
    default:
      motors.motor(motor).left_limit_at = near - 2;
  }
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bushd::fuzz;
  Input input(data, size);
  const std::uint32_t start_hz = 1u + input.u8() % 100u;
  const TimeNs code_ns = 4'000'000 / start_hz;
  Program program(start_hz);
  bushd::sim::CommutatorBoard model(start_hz);
  model.keeps_steps = program.motors.keeps_steps = false;
  TimeNs now_ns = 0;
  while (!input.empty()) {
    const unsigned what = input.u8() % 8u;
    const std::uint8_t which = input.u8();
    now_ns += input.u16() * code_ns / 256 / kCountNs * kCountNs;
    // Which of the two is first, a step or what comes with it, is no matter.
    const TimeNs due_ns = model.next_event_ns();
    if (now_ns + kCountNs >= due_ns && now_ns <= due_ns + kLatestNs) now_ns += 4 * kCountNs;
    const bool stepped = program.advance(now_ns, model);
    model.advance(now_ns);
    const auto answers = model.take_answers();
    BUSHD_REQUIRE(answers.size() == (stepped ? 1u : 0u));
    BUSHD_REQUIRE(!stepped || answers[0] == program.answer);
    if (what == 0) {
      change(model, which);
    } else if (what == 1) {
      bushd_commutator_receive_damaged(&program.core);
      model.receive(now_ns, 0);
    } else {
      const auto byte = static_cast<std::uint8_t>(what == 2   ? 0
                                                  : what == 3 ? 0x80 | which % 16
                                                              : which);
      bushd_commutator_receive(&program.core, Program::counts(now_ns), byte);
      model.receive(now_ns, byte);
    }
    for (unsigned motor = 0; motor < bushd::sim::BoardMotors::kMotors; ++motor) {
      BUSHD_REQUIRE(program.motors.position(motor) == model.position(motor));
    }
  }
  return 0;
}
