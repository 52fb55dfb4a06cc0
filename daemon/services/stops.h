// Ramps motors down, whatever moves them; what it cannot stop it says.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/model/awaited.h"
#include "daemon/model/service.h"
#include "daemon/services/homing_queue.h"
#include "daemon/services/local_inputs.h"
#include "daemon/services/moves.h"
#include "daemon/services/programs.h"
#include "daemon/services/travels.h"

namespace bushd::daemon {

class Stops final : public Service {
 public:
  Stops(Installation& installation, Moves& moves, HomingQueue& homing, Travels& travels,
        Programs& programs, LocalInputs& local_inputs, OpenMoves& open_moves)
      : installation_(installation),
        moves_(moves),
        homing_(homing),
        travels_(travels),
        programs_(programs),
        local_inputs_(local_inputs),
        open_moves_(open_moves) {}

  void request(std::int64_t now_us, const api::Asker& asker, const api::Stop& request);
  void stop(std::int64_t now_us, const std::vector<MotorId>& motors);

  void reports(std::int64_t, Mcu&) override { follow(); }
  void step(std::int64_t) override { follow(); }

 private:
  struct Stopping {
    api::Asker asker;
    std::vector<MotorId> motors{};  // that do not stand yet
    std::string done = "done";      // the reason, when all stand
    api::Outcome outcome = api::Outcome::kDone;
    std::vector<MotorId> local{};  // people move them at their MCUs
    std::string not_done{};        // why some are not stopped
  };
  void stop_local(Stopping& stopping, const std::vector<MotorId>& motors);
  void follow_local(Stopping& stopping);
  bool can_be_stopped(MotorId motor) const;
  bool may_run_on(const std::vector<MotorId>& motors, bool named) const;
  std::string not_online_text(const std::vector<MotorId>& motors) const;
  api::Completed result_in_part(const std::vector<MotorId>& motors, const std::string& unknown,
                                bool any_moves) const;
  void follow();

  Installation& installation_;
  Moves& moves_;
  HomingQueue& homing_;
  Travels& travels_;
  Programs& programs_;
  LocalInputs& local_inputs_;
  OpenMoves& open_moves_;
  Awaited<Stopping> open_;
};

}  // namespace bushd::daemon
