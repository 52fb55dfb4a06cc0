// CAMAC crates of the configuration: cycles of clients go to the modules, and what the modules want
// of motors goes through the requests of everybody (camac_motors.h, camac_shutter.h).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/model/installation.h"
#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/camac_asker.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/lines.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/programs.h"
#include "daemon/services/tables_in_service.h"
#include "daemon/services/travels.h"
#include "heritage/camac/crate.h"

namespace bushd::daemon {

class Camac final : public Service {
 public:
  // `ask` is called from step() only.
  Camac(Installation& installation, const Interlocks& interlocks, const OpenMoves& open_moves,
        TablesInService& tables, Lines& lines, Travels& travels, const Programs& programs,
        KeptPositions& kept, Outputs& outputs, const AskCore& ask);
  ~Camac() override;

  void request(const api::Asker& asker, const api::Camac& request);
  // The store is in use: memories are as they were kept, and motions that go on without the daemon
  // are found.
  void take_kept();

  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;

 private:
  // A module with the motors behind it.
  class Station;
  class Bushd1Station;
  class Bushd2Station;
  struct Crate {
    int number;
    camac::Crate crate{};
    std::vector<std::unique_ptr<Station>> stations{};
    std::uint32_t told = 0;  // of its requests
  };

  void tell_lam(Crate& crate);
  void keep_memories(Crate& crate);

  const Installation& installation_;
  KeptPositions& kept_;
  Outputs& outputs_;
  CamacTurn turn_;
  std::vector<Crate> crates_;
};

}  // namespace bushd::daemon
