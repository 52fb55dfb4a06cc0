// Clients that hold a jog key pressed: they renew what they have begun, change speed and direction,
// and let go in the end, or die.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "request.h"
#include "sim/random.h"
#include "sim/wire.h"

namespace bushfaults {

class Joggers {
 public:
  explicit Joggers(std::uint64_t seed);

  // Another one begins. What it asks first.
  Request begin(const std::string& motor);
  // What the others ask now.
  std::vector<Request> due(bushd::sim::TimeNs now_ns);
  // All die.
  void die() { pressed_.clear(); }

 private:
  struct Pressed {
    std::string client;
    std::string motor;
    std::int64_t keepalive_ms;
    bushd::sim::TimeNs due_ns = 0;  // 0: it has only just begun
    bushd::sim::TimeNs until_ns = 0;
    bool dies;
    bool over = false;
  };
  Request change(const Pressed& pressed);
  Request let_go(const Pressed& pressed);
  Request next(const Pressed& pressed);
  bushd::sim::TimeNs pause_ns(const Pressed& pressed);

  bushd::sim::Random random_;
  std::vector<Pressed> pressed_;
};

}  // namespace bushfaults
