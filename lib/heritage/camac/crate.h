// A CAMAC crate: 23 stations for modules and a crate controller with the addresses of types A-1 and
// A-2, so that everything in a crate is done by cycles:
//
//     N28 A8 F26  initialise (Z)             N30 A10 F26, F24, F27  demand: enable, disable, test
//     N28 A9 F26  clear (C)                  N30 A11 F27            Q: a module raises L
//     N30 A9 F26, F24, F27  inhibit (I):     N30 A0..A7 F0          the graded request: bit n is
//                 set, clear, test                                  the L line of station n
//
// Stations are graded one to one: request n is that of station n. Other addresses and empty
// stations answer X = 0, Q = 0 and data 0.
#pragma once

#include <array>
#include <cstdint>

#include "heritage/camac/module.h"

namespace bushd::camac {

class Crate {
 public:
  // The module outlives the crate. Precondition: 1 <= station <= kStations, nothing stands there.
  void insert(int station, Module& module);
  // Null: nothing stands there.
  const Module* at(int station) const;

  // Any station, subaddress and function; more than 24 bits of data are ignored.
  Response cycle(int station, const Command& command);

  void initialise();
  void clear();
  void set_inhibit(bool inhibited);
  bool inhibited() const { return inhibited_; }

  // Bit n - 1: station n raises L.
  std::uint32_t requests() const;
  // Whether these are to be told. At first they are not.
  bool demand_enabled() const { return demand_enabled_; }

 private:
  Response controller_cycle(int station, const Command& command);

  std::array<Module*, kStations> modules_{};
  bool inhibited_ = false;
  bool demand_enabled_ = false;
};

}  // namespace bushd::camac
