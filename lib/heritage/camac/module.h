// What stands at a station of a CAMAC crate: it answers cycles and requests attention.
//
// One cycle is command N A F with up to 24 bits of data. Its answer is X, the command was accepted,
// and Q, whose meaning depends on the function. What a cycle changes is not seen in its own answer:
// Q and data are those before it.
#pragma once

#include <cstdint>

#include "words/camac.h"

namespace bushd::camac {

// What a station sees of a cycle.
struct Command {
  int subaddress = 0;      // A, 0..15
  int function = 0;        // F, 0..31
  std::uint32_t data = 0;  // W; of functions that write
};

class Module {
 public:
  virtual ~Module() = default;

  // The module is addressed.
  virtual Response cycle(const Command& command) = 0;
  // The common controls of the dataway: Z, C, and the level I.
  virtual void initialise() = 0;
  virtual void clear() = 0;
  virtual void set_inhibit(bool inhibited) = 0;
  // The L line, as it is between cycles.
  virtual bool lam() const = 0;
};

}  // namespace bushd::camac
