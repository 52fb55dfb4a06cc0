// Programs of a laboratory of 1985: they load BUSHD-2, start and stop it, clear what it requests,
// read its registers, and initialise the crate in between. Each of their requests is one block.
#pragma once

#include <cstdint>
#include <vector>

#include "config/config.h"
#include "request.h"
#include "sim/random.h"
#include "words/camac.h"

namespace bushfaults {

// Gives the configuration a crate, if it has motors for one: those of the last of its groups.
void add_crate(bushd::config::Config& config);
// And a BUSHD-1, whose motor has a group of its own, and is the only one with switches at its
// inputs.
void add_shutter(bushd::config::Config& config);
// The input with the number of the motor's output is one of the shutter's.
bool is_of_shutter(const bushd::config::Config& config, std::size_t motor);
// By which no program is slower, of a group with this table.
bushd::tables::TablePtr slowest_program(const bushd::tables::Table& table);

class Programs {
 public:
  // `config` outlives it.
  Programs(const bushd::config::Config& config, std::uint64_t seed);

  // What one of them asks next. `position_steps`: of a motor of the module, as it is shown.
  Request next(std::int64_t position_steps, std::size_t motor);
  // The same of BUSHD-1, whose motor stands there, as the plant counts. `open`: a start may be
  // under way.
  Request next_of_shutter(std::int64_t stands, bool open);
  // Motors of the module.
  std::size_t any_motor();
  std::size_t motors() const;

 private:
  using Cycles = std::vector<bushd::camac::Naf>;
  void load(Cycles& cycles, std::size_t motor);
  void start(Cycles& cycles, std::int64_t position_steps, std::size_t motor);
  void look(Cycles& cycles);
  void control_crate(Cycles& cycles);
  void random_cycles(Cycles& cycles);
  void other_modes(Request& request);
  void load_shutter(Cycles& cycles, std::int64_t steps);
  void start_shutter(Cycles& cycles, std::int64_t stands);

  const bushd::config::Config& config_;
  bushd::sim::Random random_;
};

}  // namespace bushfaults
