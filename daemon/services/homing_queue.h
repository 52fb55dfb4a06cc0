// Homing: the MCUs do it by themselves (docs/protocol.md, HOME). Here is who may be homed, in which
// order, and what came of it. An MCU homes one motor at a time, so those of one MCU wait in a row.
// A motor whose `home` has a `then` moves there once its switch was found, as a part of the same.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/idle_drivers.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class HomingQueue final : public Service {
 public:
  HomingQueue(Installation& installation, const Interlocks& interlocks, OpenMoves& open_moves,
              Moves& moves, KeptPositions& kept, IdleDrivers& idle_drivers, Outputs& outputs);

  void request(const api::Asker& asker, const api::Home& request);

  bool empty() const;
  // It ends: at once if its MCU has not been asked yet, else when the motor stands. A motor that is
  // not homed is left alone.
  void stop(MotorId motor);
  // Those whose MCUs have not been asked yet end.
  void end_waiting();

  void goes_online(Mcu& mcu) override;
  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void reports(std::int64_t now_us, Mcu& mcu) override;
  void refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) override;
  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;

 private:
  enum class Phase {
    kWaiting,  // for its turn, or for the disk
    kHoming,   // the MCU has been asked
    kFound,    // is to move on to `then`
    kMovingOn
  };
  struct Task {
    MotorId motor;
    bushd_delay shortest_delay;  // of the fast approach
    Phase phase = Phase::kWaiting;
    std::string ended_by{};  // it was asked to end, because of that; waiting: when it is its turn
    std::int64_t then_steps = 0;
    std::uint64_t after_stops = 0;  // as Asker::after_stops
  };
  // The tasks of one MCU: all but the first wait.
  using Queue = std::deque<Task>;
  // All motors with `home`: those of the lowest order are in their queues, the others not yet.
  struct Sequence {
    std::deque<Task> later{};  // by order
    std::vector<MotorId> now{};
  };

  Result<std::vector<MotorId>> motors_of(const api::Home& request) const;
  Result<std::vector<MotorId>> all_by_order() const;
  Result<void> may_home(MotorId motor) const;
  Result<void> may_begin(MotorId motor) const;
  Result<bushd_delay> shortest_delay_of(MotorId motor,
                                        const std::optional<api::Speed>& speed) const;
  Result<void> may_home_by(MotorId motor, bushd_delay shortest_delay) const;
  bushd_home message_for(const Task& task) const;  // precondition: its motor has a home
  void add(Task task);
  void begin(Mcu& mcu);
  void step(std::int64_t now_us, Mcu& mcu);
  void ask(std::int64_t now_us, Mcu& mcu);
  void found(Mcu& mcu);
  void move_on(std::int64_t now_us, Mcu& mcu);
  void follow_moving_on(Mcu& mcu);
  Task* task_of(MotorId motor);
  bool is_of_sequence(MotorId motor) const;
  bool end_if_waiting(MotorId motor, const std::string& because);
  void give_up(Task& task, const std::string& because);
  // The first of the queue.
  void end(Mcu& mcu, api::Outcome outcome, const std::string& reason);
  // Its MCU has it no more.
  void release(MotorId motor, bool found);
  // It is in no queue any more.
  void ended(MotorId motor, api::Outcome outcome, const std::string& reason);
  void follow_sequence(MotorId motor, bool good, const std::string& reason);
  void begin_next_of_sequence();

  Installation& installation_;
  const Interlocks& interlocks_;
  OpenMoves& open_;
  Moves& moves_;
  KeptPositions& kept_;
  IdleDrivers& idle_drivers_;
  Outputs& outputs_;
  ById<McuId, Queue> queues_;
  std::optional<Sequence> sequence_;
};

}  // namespace bushd::daemon
