// The lab of a commutator board whose image runs in simavr, on virtual time.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "daemon/board_lab.h"
#include "sim/avr/avr_board.h"

namespace bushd::test {

class ImageLab : public BoardLab {
 public:
  static constexpr int kBaud = 500'000;
  ImageLab(const std::string& clock, std::unique_ptr<sim::AvrBoard> board)
      : ImageLab(clock, *board, board) {}
  sim::BoardMotors& motors() { return image.motors(); }

  sim::AvrBoard& image;

 private:
  ImageLab(const std::string& clock, sim::AvrBoard& its, std::unique_ptr<sim::AvrBoard>& board)
      : BoardLab(with_motors_of_board(kBaud, clock), std::move(board)), image(its) {}
};

// m0 makes 300 steps and m5 120. The intervals are those of the codes, and no longer than the line,
// this lab's look every 0.2 ms, and by what the image is late, make them.
inline void expect_moves_by_codes(ImageLab& lab, const std::vector<std::int64_t>& codes,
                                  const std::function<std::int64_t(std::int64_t)>& ns_of_code,
                                  std::int64_t late_ns) {
  EXPECT_EQ(lab.move("m0", 300).result, "reached");
  EXPECT_EQ(lab.move("m5", -120).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m0"), 300);
  EXPECT_EQ(lab.shaft_steps("m5"), -120);
  EXPECT_TRUE(lab.trusted("m0") && lab.trusted("m5"));
  const auto& steps = lab.motors().steps();
  ASSERT_EQ(steps.size(), 420u);
  for (std::size_t k = 1; k < 300; ++k) {
    const std::int64_t code_ns = ns_of_code(code_of_step(codes, k, 300));
    const auto apart_ns = steps[k].time_ns - steps[k - 1].time_ns;
    ASSERT_GE(apart_ns, code_ns) << k;
    ASSERT_LE(apart_ns, code_ns + 2 * 20'000 + 250'000 + late_ns) << k;
  }
}

using Upto = std::function<std::int64_t(unsigned)>;  // a random number below that

// Each trouble leaves one step unknown at the most, and only where the motor is uncertain then.
// `before` is called before each motion; one of the troubles is `trouble`, which `after` ends.
inline void expect_counts_right_or_uncertain(ImageLab& lab, unsigned seed,
                                             const std::function<void(const Upto&)>& before,
                                             const std::function<void()>& trouble,
                                             const std::function<void()>& after) {
  std::mt19937 random(seed);
  const Upto upto = [&random](unsigned n) { return static_cast<std::int64_t>(random() % n); };
  lab.motors().motor(0).right_limit_at = 500;
  for (int i = 0; i < 6; ++i) {
    before(upto);
    const auto move = lab.send(Ask::kMoveBy, {"m0"}, {upto(800) - 400});
    lab.run_for(static_cast<double>(upto(500)) * 1e-3);
    const std::int64_t kind = upto(6);
    if (kind == 0) lab.unplug(0);
    if (kind == 1) lab.motors().supply = false;
    if (kind == 2) lab.motors().motor(0).connected = false;
    if (kind == 3) trouble();
    if (kind == 4) lab.image.send_break(lab.now_us() * 1000);
    if (kind == 5) lab.image.node().hang();
    lab.run_for(static_cast<double>(upto(300)) * 1e-3);
    lab.motors().supply = lab.motors().motor(0).connected = true;
    after();
    if (kind == 0) lab.plug(0);
    ASSERT_TRUE(lab.run_until([&] { return lab.has_result(move); }, 60));
    lab.run_for(1.2);
    if (lab.trusted("m0")) {
      ASSERT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0")) << i;
    } else {
      lab.ask(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")});
    }
  }
}

}  // namespace bushd::test
