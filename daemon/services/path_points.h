// Points of paths that come in several requests of a client, one after the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <string>

#include "api/request.h"
#include "base/result.h"

namespace bushd::daemon {

class PathPoints {
 public:
  // Clients whose points are kept at once; the one that has begun first is dropped for another one.
  static constexpr std::size_t kMost = 4;
  static constexpr std::size_t kMostValues = 1'000'000;  // of one path

  // Whether a request may come now; its points are then those behind the ones before. Returns
  // whether they are the last ones. Error: the path is dropped.
  Result<bool> take(const std::string& client, const api::MovePath& part);
  void drop(const std::string& client);
  // Its points, but not all of them, are here.
  bool has(const std::string& client) const;

 private:
  struct Begun {
    std::string client;
    api::MovePath first;  // without its points
    bool has_speeds;
    std::int32_t rows = 0;  // taken
  };
  std::list<Begun> begun_;
};

}  // namespace bushd::daemon
