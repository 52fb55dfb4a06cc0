// Motors that are held: no motion of theirs begins until they are released. Holds are kept in the
// state store, with who has set them and when.
#pragma once

#include <cstdint>
#include <list>
#include <string>
#include <vector>

#include "daemon/model/awaited.h"
#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/local_inputs.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class Holds final : public Service {
 public:
  // It adds a check to the interlocks.
  Holds(Installation& installation, Interlocks& interlocks, Moves& moves, LocalInputs& local_inputs,
        OpenMoves& open_moves, KeptPositions& kept, Outputs& outputs);

  void request(std::int64_t now_us, const api::Asker& asker, const api::Hold& request);
  void request(const api::Asker& asker, const api::Release& request);

  // The store is in use: what was held is held, before any MCU is connected.
  void take_kept();

  void step(std::int64_t) override { answer_open(); }

 private:
  // Until their MCUs know of it: people may move them there.
  struct Holding {
    api::Asker asker;
    std::vector<MotorId> motors;
    std::string unknown;  // which names are, if any
  };
  void hold(MotorId motor, const api::Asker& by);
  void release(MotorId motor, const api::Asker& by);
  void keep(MotorId motor);
  void note(MotorId motor, const char* what, const api::Asker& by);
  void answer_open();

  Installation& installation_;
  Moves& moves_;
  LocalInputs& local_inputs_;
  OpenMoves& open_moves_;
  KeptPositions& kept_;
  Outputs& outputs_;
  std::list<Holding> open_;
};

}  // namespace bushd::daemon
