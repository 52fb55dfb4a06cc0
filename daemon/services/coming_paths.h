// Paths on their way to Lines: their points come in several requests, and the whole is planned in
// slices, between which motors and all other requests have their turn.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/precedence.h"
#include "daemon/services/feed.h"
#include "daemon/services/line.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/path_points.h"

namespace bushd::daemon {

class ComingPaths {
 public:
  ComingPaths(const Installation& installation, const Interlocks& interlocks, const Moves& moves,
              OpenMoves& open_moves)
      : installation_(installation), interlocks_(interlocks), moves_(moves), open_(open_moves) {}

  // Answers it, unless the points are the last ones, and good: then the path is planned.
  void request(const api::Asker& asker, const api::MovePath& request);
  // Those that a stop has overtaken do not begin.
  void end_overtaken();

  bool idle() const { return coming_.empty(); }
  // Plans a slice.
  void work();
  struct Planned {
    api::Asker asker;
    bool dry_run;
    Line line;
  };
  // One that may begin now. One that may not is answered.
  std::optional<Planned> take_planned();

 private:
  // A path whose points are coming.
  struct Incoming {
    std::vector<MotorId> motors{};
    AlongPath along{};
    std::vector<bushd_delay> shortest_delays{};  // of each motor's steps
    // The points farthest up and down on each motor's way, 0 where it stands.
    struct End {
      std::int32_t point;
      std::int64_t steps;
    };
    std::vector<End> low{};
    std::vector<End> high{};
    std::vector<units::Scale> scales{};  // of each motor at the first point; the same for all
    std::uint64_t after_stops = 0;       // as Asker::after_stops, of the part asked for first
    std::int32_t rows = 0;
    int direction = 0;  // of a motor with speeds
    std::optional<Feed> feed{};
  };
  // A path that is not planned yet.
  struct Coming {
    api::Asker asker;
    bool dry_run;
    Incoming path;
  };

  std::optional<Precedence::Overtaken> overtaken(const Incoming& path) const;
  // Precondition: the installation has its motors.
  std::optional<Precedence::Overtaken> overtaken(const std::string& client, const api::Asker& asker,
                                                 const api::MovePath& part) const;
  Result<Incoming> begin_points(const api::Asker& asker, const api::MovePath& request) const;
  Result<void> same_scales(const Incoming& incoming) const;
  Result<void> add_points(Incoming& incoming, const api::MovePath& request) const;
  Result<bushd_delay> shortest_delay_to(Incoming& incoming, std::int64_t point, double speed) const;
  // Each motor's part of the feed on the way to the next point, unless it is to be slower. Error:
  // slower than any delay.
  Result<void> add_feed(const Incoming& incoming, std::span<const std::int64_t> point,
                        std::vector<bushd_delay>& shortest_delays) const;
  Result<void> may_follow(const Incoming& incoming) const;
  Result<void> may_begin(const Incoming& incoming) const;
  Result<void> is_short_enough(const Incoming& incoming) const;

  const Installation& installation_;
  const Interlocks& interlocks_;
  const Moves& moves_;
  OpenMoves& open_;
  PathPoints path_points_;
  std::map<std::string, Incoming> incoming_;  // by client
  // Paths of which a stop has ended all, and points are still to come; by client.
  std::map<std::string, Precedence::Overtaken> ended_;
  std::list<Coming> coming_;
};

}  // namespace bushd::daemon
