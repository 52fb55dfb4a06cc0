// Programs of MCUs (docs/programs.md): who may have which, and the one result of each run.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/idle_drivers.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class Programs final : public Service {
 public:
  void request(const api::Asker& asker, const api::PutProgram& request);
  void request(const api::Asker& asker, const api::EraseProgram& request);
  void request(const api::Asker& asker, const api::RunPrograms& request);
  void request(const api::Asker& asker, const api::ListPrograms& request);
};

}  // namespace bushd::daemon
