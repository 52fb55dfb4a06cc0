// BUSHD-2: a motor performs a given number of steps by a program in the module's memory.
//
// Memory of 1024 bytes, a page of 256 for each of four groups of eight motors:
//
//     0, 1      number of steps, the low byte first
//     2..239    238 delay codes; a code lasts code / (250 F_start), so 250 is F_start, 10 is
//               25 F_start; 0 counts as 1
//     240..255  positions of the page's eight motors, two bytes each, the low one first: steps to
//               the right that the module has been told of, less those to the left, modulo 65536
//
// Control register: bits 1..5 number of the motor, bit 5 enables address overflow as well; 6
// enables the request from the motor, 7 that at the end of motion; 8 is the direction, 1: left.
// Request register: bits 1..8 the status that the motor has told last (1 right limit, 2 left limit,
// 3 supply missing, 4 not connected, 5 step done), 9 and 10 how many were received, modulo 4.
#pragma once

#include <cstdint>
#include <optional>

#include "heritage/camac/motion_module.h"
#include "heritage/camac/motors.h"

namespace bushd::camac {

class Bushd2 final : public MotionModule {
 public:
  static constexpr std::size_t kMemoryBytes = 1024;
  static constexpr std::size_t kPageBytes = 256;
  static constexpr std::size_t kCodes = 238;
  static constexpr std::size_t kFirstCode = 2;  // in its page
  static constexpr std::size_t kFirstPosition = 240;
  static constexpr int kMotors = 32;
  static constexpr int kMotorsPerPage = 8;
  static constexpr std::int64_t kCodesPerStartPeriod = 250;  // 250 of them last 1 / F_start

  // `motors` outlive the module.
  explicit Bushd2(Motors& motors) : MotionModule(kMemoryBytes), motors_(motors) {}

  bool lam() const override;

  // The motor that moves has told its status after each of so many more steps; 0: without a step.
  // What comes while none moves is ignored, here and below.
  void answer(std::uint32_t steps, const MotorStatus& status);
  // It stands although not all steps are made, because it was stopped or for what its status says.
  // `unanswered`: steps that it has made all the same, of which its position takes notice.
  void ends(const MotorStatus& status, std::uint32_t unanswered = 0);

  bool is_moving() const { return exchange_.has_value(); }
  // A motion of so many steps that was begun with this control register goes on: this module has
  // been told of the first `answered` ones, and lost its registers since. Precondition: none moves.
  void goes_on(std::uint8_t control, std::uint32_t steps, std::uint32_t answered);
  const Program& moving_program() const { return exchange_->program; }  // precondition: one moves

 private:
  // With the commutator, from F26A0 until the motor stands.
  struct Exchange {
    Program program;
    std::uint32_t answered = 0;
    bool stopping = false;
  };

  std::uint32_t request_register() const override;
  void clear_lam() override;
  void clear_requests() override;
  void address_overflows() override { overflow_ = true; }
  void start() override;
  void stop() override;

  Program program() const;
  void count_position(const Program& program, std::uint32_t steps);
  void receive(std::uint32_t messages, const MotorStatus& status, bool step_done);

  Motors& motors_;
  std::uint8_t status_ = 0;
  std::uint32_t received_ = 0;
  // Each raises L if it is enabled.
  bool overflow_ = false;
  bool fault_ = false;
  bool ended_ = false;
  std::optional<Exchange> exchange_;
};

// How many codes the motion uses: before the step in the middle stands the last one of them.
std::size_t codes_used(const Program& program);
// The code before step `step`, from 0, of `steps`. Precondition: step < steps.
std::uint8_t code_of_step(const Program& program, std::uint32_t step);

}  // namespace bushd::camac
