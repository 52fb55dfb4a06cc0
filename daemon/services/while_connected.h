// Motors that wait for the trigger as long as the client lives that has armed them. Others wait
// without an end (docs/decisions/0065-armed-motors-outlive-their-client.md).
#pragma once

#include <cstdint>
#include <list>
#include <vector>

#include "daemon/model/service.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class WhileConnected final : public Service {
 public:
  WhileConnected(Installation& installation, Moves& moves, OpenMoves& open_moves)
      : installation_(installation), moves_(moves), open_moves_(open_moves) {}

  // Before the request is carried out. False: it is refused, and has been answered.
  bool take(const api::Asker& asker);

  void step(std::int64_t now_us) override;

 private:
  std::vector<MotorId> waiting(const api::Asker& asker) const;

  Installation& installation_;
  Moves& moves_;
  OpenMoves& open_moves_;
  std::list<api::Asker> askers_;  // of requests whose motors wait, perhaps
};

}  // namespace bushd::daemon
