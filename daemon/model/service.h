// A capability of the daemon. It gets its requests by a function of its own (Core::request), and
// follows here what MCUs tell and the time; what it does not need it leaves out.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/model/installation.h"

namespace bushd::daemon {

class Service {
 public:
  virtual ~Service() = default;

  virtual void goes_online(Mcu&) {}
  virtual void goes_offline(Mcu&, const std::string& /*cause*/) {}
  // The motors have followed the report already.
  virtual void reports(std::int64_t /*now_us*/, Mcu&) {}
  // An online MCU has refused a request of this type.
  virtual void refuses(Mcu&, std::uint8_t /*type*/, std::uint8_t /*status*/) {}
  // A stop has arrived (precedence.h): of what waits here that ends which arrived before it and has
  // not begun.
  virtual void end_overtaken(std::int64_t /*now_us*/) {}
  // After every input, and at the latest when the core has asked to be woken.
  virtual void step(std::int64_t /*now_us*/) {}
};

}  // namespace bushd::daemon
