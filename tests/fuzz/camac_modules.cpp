// A crate with BUSHD-2 and BUSHD-1, and motors that do what they are asked, or fail. Whatever
// programs write, the modules ask for motion only of a motor that rests, and know of each that
// moves.
//
// Input: operations of four bytes, what, which and a number of 16 bits.
#include "fuzz/fuzz.h"
#include "heritage/camac/bushd1.h"
#include "heritage/camac/bushd2.h"
#include "heritage/camac/crate.h"

namespace bushd::fuzz {
namespace {

using camac::Command;
using camac::MotorStatus;
using camac::Response;

constexpr int kStation2 = 5;
constexpr int kStation1 = 7;
constexpr int kController = 30;

MotorStatus status_of(unsigned bits) {
  return {.right_limit = (bits & 1) != 0,
          .left_limit = (bits & 2) != 0,
          .supply_missing = (bits & 4) != 0,
          .not_connected = (bits & 8) != 0};
}

class World final : public camac::Motors, public camac::Shutter {
 public:
  MotorStatus status(int motor) override {
    BUSHD_REQUIRE(motor >= 0 && motor < camac::Bushd2::kMotors);
    return now;
  }
  bool move(const camac::Program& program) override {
    BUSHD_REQUIRE(!moves && !now.bars(program.left));
    BUSHD_REQUIRE(program.steps >= 1 && program.steps <= 65535);
    BUSHD_REQUIRE(program.page == program.motor / 8 && program.codes.size() == 238);
    BUSHD_REQUIRE(std::ranges::find(program.codes, 0) == program.codes.end());
    left = program.left;
    steps = program.steps;
    return moves = accepts;
  }
  void stop(int) override { BUSHD_REQUIRE(moves); }
  bool step(const camac::SingleStep&) override {
    BUSHD_REQUIRE(!shutter_moves);
    return shutter_moves = accepts;
  }
  bool travel(const camac::Travel& travel) override {
    BUSHD_REQUIRE(!shutter_moves);
    BUSHD_REQUIRE(!travel.codes.empty() && travel.codes.size() <= 126);
    BUSHD_REQUIRE(std::ranges::min(travel.codes) >= 1 && std::ranges::max(travel.codes) <= 30'000);
    return shutter_moves = accepts;
  }
  void stop() override { BUSHD_REQUIRE(shutter_moves); }

  MotorStatus now;
  bool accepts = true;
  bool moves = false;
  bool left = false;
  std::uint32_t steps = 0;  // still to be made
  bool shutter_moves = false;
};

class Rig {
 public:
  Rig() {
    crate_.insert(kStation2, bushd2_);
    crate_.insert(kStation1, bushd1_);
  }

  void operate(unsigned what, unsigned which, std::uint16_t number) {
    switch (what % 8) {
      case 0:
        return answer(number % 300, status_of(which));
      case 1:
        return follow_shutter(which, number);
      case 2:
        return change(which, number);
      case 3:
        return cycle(kController, which & 15, number & 31, 0);
      case 4:
        return cycle(28, 8 + (which & 1), 26, 0);
      default:
        break;
    }
    static constexpr int kFunctions[]{0, 8, 10, 16, 16, 24, 26, 26};
    const int station = (what & 8) == 0 ? kStation2 : kStation1;
    const int f = (which & 128) != 0 ? static_cast<int>(which & 31) : kFunctions[which >> 4 & 7];
    cycle(station, static_cast<int>(which & 15), f, number);
  }
  void check() {
    BUSHD_REQUIRE(bushd2_.is_moving() == world_.moves);
    // The module may know the end of a single step, or a travel, first: it is its last event.
    world_.shutter_moves = world_.shutter_moves && bushd1_.is_moving();
    BUSHD_REQUIRE(bushd1_.is_moving() == world_.shutter_moves);
    const std::uint32_t requests = crate_.requests();
    BUSHD_REQUIRE((requests & ~(1U << (kStation2 - 1) | 1U << (kStation1 - 1))) == 0);
    BUSHD_REQUIRE(crate_.cycle(kController, {}).data == requests);
  }

 private:
  void cycle(int station, int a, int f, std::uint32_t data) {
    const bool lam = station <= camac::kStations && (crate_.requests() >> (station - 1) & 1) != 0;
    const Response response = crate_.cycle(station, {.subaddress = a, .function = f, .data = data});
    BUSHD_REQUIRE(response.x || (!response.q && response.data == 0));
    BUSHD_REQUIRE(response.data <= 1023 || station == kController);
    BUSHD_REQUIRE(camac::reads(f) || response.data == 0);
    if (station <= camac::kStations && f == 8 && a == 0) BUSHD_REQUIRE(response.q == lam);
    if (station <= camac::kStations && a == 0 && (f == 0 || f == 16)) {
      BUSHD_REQUIRE(response.q == !lam);
    }
  }
  void answer(std::uint32_t steps, const MotorStatus& status) {
    if (world_.moves) {
      world_.steps -= std::min(steps, world_.steps);
      world_.moves = world_.steps > 0 && !status.bars(world_.left);
    }
    bushd2_.answer(steps, status);
  }
  void follow_shutter(unsigned which, std::uint16_t number) {
    switch (which % 8) {
      case 0:
        return bushd1_.step_done();
      case 1:
        return bushd1_.step_not_done();
      case 2:
        return bushd1_.run_ends();
      case 3:
        return bushd1_.limits((number & 1) != 0, (number & 2) != 0);
      case 4:
        world_.shutter_moves = false;
        return bushd1_.stands();
      default:
        for (unsigned i = 0; i <= number % 128U; ++i) bushd1_.run_step_done();
    }
  }
  void change(unsigned which, std::uint16_t number) {
    switch (which % 4) {
      case 0:
        world_.now = status_of(number);
        break;
      case 1:
        world_.accepts = number % 4 != 0;
        break;
      case 2:
        world_.moves = false;
        bushd2_.ends(status_of(number));
        break;
      default:
        break;
    }
  }

  World world_;
  camac::Bushd2 bushd2_{world_};
  camac::Bushd1 bushd1_{world_};
  camac::Crate crate_;
};

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::Input input(data, size);
  bushd::fuzz::Rig rig;
  while (!input.empty()) {
    const unsigned what = input.u8();
    const unsigned which = input.u8();
    rig.operate(what, which, input.u16());
    rig.check();
  }
  return 0;
}
