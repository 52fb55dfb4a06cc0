// Points of paths that come in several requests of a client, one after the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "api/session.h"
#include "base/result.h"

namespace bushd::daemon {

class PathPoints {
 public:
  // Of so many clients at once; the one that has waited longest is dropped for another one.
  static constexpr std::size_t kMost = 4;
  static constexpr std::size_t kMostValues = 1'000'000;  // of one path

  // Takes a request's points. Returns the whole path if it is complete, with all its points.
  Result<std::optional<api::MovePath>> take(const api::Asker& asker, const api::MovePath& part);

 private:
  struct Begun {
    std::string client;
    api::MovePath path;
  };
  std::list<Begun> begun_;
};

}  // namespace bushd::daemon
