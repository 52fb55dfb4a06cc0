// A daemon that pages see: of this PC (daemon_link.h), or as another bushd-web shows it (remote.h).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "mirror.h"

namespace bushweb {

class Source {
 public:
  virtual ~Source() = default;
  virtual Mirror& mirror() = 0;
  // Connects when it is time to.
  virtual void tick(std::int64_t now_us) = 0;
  // The path of its control socket; "": it can only be looked at.
  virtual std::string socket() const { return ""; }
  // Processor time of the daemon since its start; nothing where this PC does not tell.
  virtual std::optional<double> cpu_s() const { return std::nullopt; }
};

}  // namespace bushweb
