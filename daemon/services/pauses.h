// Motors that are paused on the way to their targets: what other systems call stop, pause, move,
// go.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/model/awaited.h"
#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/programs.h"

namespace bushd::daemon {

class Pauses final : public Service {
 public:
  Pauses(Installation& installation, const Interlocks& interlocks, Moves& moves, Programs& programs,
         OpenMoves& open_moves);

  void request(std::int64_t now_us, const api::Asker& asker, const api::Pause& request);
  void request(std::int64_t now_us, const api::Asker& asker, const api::Resume& request);

  void step(std::int64_t now_us) override;

 private:
  struct Pausing {
    api::Asker asker;
    std::map<MotorId, std::int64_t> motors{};            // that do not stand yet, and their targets
    std::set<MotorId> stopping{};                        // of these: for good
    std::size_t paused = 0;                              // how many stand paused
    std::map<std::string, std::vector<MotorId>> left{};  // the others, by what they do
    std::string problems{};
    api::Outcome outcome = api::Outcome::kDone;

    void not_done(api::Outcome how, const std::string& what);
  };
  std::string left_alone(MotorId motor) const;
  bool settles(MotorId motor) const;
  bool has_ended(Pausing& pausing, MotorId motor, std::int64_t target) const;
  std::string text_of_left(const Pausing& pausing) const;

  Installation& installation_;
  const Interlocks& interlocks_;
  Moves& moves_;
  Programs& programs_;
  OpenMoves& open_;
  Awaited<Pausing> open_pauses_;
};

}  // namespace bushd::daemon
