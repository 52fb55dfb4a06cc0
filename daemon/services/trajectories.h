// Motors of one bus follow trajectories: positions over time (motion/trajectory.h). Rows are
// checked as they come, in slices: what motors can follow takes longer to find out than a request
// may.
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/journal.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"
#include "motion/trajectory_check.h"

namespace bushd::daemon {

class Trajectories final : public Service {
 public:
  // Trajectories that are loaded and do not run; the oldest one gives way to one more.
  static constexpr std::size_t kMostLoaded = 8;

  Trajectories(Installation& installation, const Interlocks& interlocks, Journal& journal,
               Moves& moves, OpenMoves& open_moves)
      : installation_(installation),
        interlocks_(interlocks),
        journal_(journal),
        moves_(moves),
        open_(open_moves) {}

  void request(std::int64_t now_us, const api::Asker& asker, const api::Follow& request);

  bool idle() const { return jobs_.empty(); }
  // One slice of the oldest check.
  void work();
  std::uint64_t units() const { return units_; }

  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;

 private:
  // What the check of a motor goes by: as it was when its trajectory was begun.
  struct Part {
    MotorId motor;
    tables::TablePtr table;
    units::Coordinates coordinates;
    motion::TrajectoryCheck::Motor bounds;
  };
  // A trajectory of a client, from its first rows on.
  struct Loaded {
    std::string client;
    std::int64_t number;
    std::vector<Part> parts;
    std::int64_t stretch_thousandths;
    double first_s = 0;  // time of its first row
    motion::Trajectory rows;
    std::unique_ptr<motion::TrajectoryCheck> check;
    bool waits = false;  // for a check
    bool spoilt = false;
    // As Asker::after_stops, of the part that was asked for first.
    std::uint64_t after_stops = api::Asker::kNotCounted;
    bool dropped = false;  // a stop has ended it, and its last rows were told that
    // From when it runs: the rows that have been checked.
    std::shared_ptr<motion::Trajectory> followed;
    Journal::LoggedTrajectory logged{};

    std::vector<MotorId> motors() const;
  };
  using Place = std::list<Loaded>::iterator;
  // Rows of a trajectory, to be checked, and then to be tried with longer times.
  struct Job {
    api::Asker asker;
    Place trajectory;
    std::unique_ptr<motion::Trajectory> longer;
    std::unique_ptr<motion::TrajectoryCheck> check_of_longer;
    std::int64_t thousandths = 1000;
    int tries = 0;
  };

  // A stop ends a trajectory that does not run yet, with all parts that are still to come. One that
  // runs is ended by what ends the motion of its motors.
  std::optional<Precedence::Overtaken> overtaken(const Loaded& loaded) const;
  std::optional<MotorId> no_more(const Loaded& loaded) const;
  std::optional<api::Reply> stopped(const api::Asker& asker, const Loaded& loaded) const;
  Place find(const api::Asker& asker, std::int64_t number);
  Result<Place> begin(const api::Asker& asker, const api::Follow& request);
  Result<void> may_go_on(const Loaded& loaded, const api::Follow& request) const;
  Result<void> has_time(std::int64_t now_us, const Loaded& loaded) const;
  Result<void> take(Loaded& loaded, const api::Follow& request) const;
  void take_rows(std::int64_t now_us, const api::Asker& asker, const api::Follow& request);
  std::vector<motion::TrajectoryCheck::Motor> bounds_of(const Loaded& loaded) const;
  std::uint32_t tick_ns_of(const Loaded& loaded) const;

  void end_job(std::int64_t now_us);
  bool try_longer(Job& job) const;
  void accept_rows(Loaded& loaded);
  std::string text_of(const Job& job) const;
  api::MovePlan plan_of(const Loaded& loaded) const;

  void run(std::int64_t now_us, const api::Asker& asker, const api::Follow& request);
  Result<void> may_run(const Loaded& loaded) const;
  bool follow(std::int64_t now_us, Loaded& loaded);
  bool follows(const Loaded& loaded, MotorId motor) const;

  Installation& installation_;
  const Interlocks& interlocks_;
  Journal& journal_;
  Moves& moves_;
  OpenMoves& open_;
  std::list<Loaded> trajectories_;  // the newest last
  std::deque<Job> jobs_;
  std::uint64_t units_ = 0;
  std::int64_t now_us_ = 0;
};

}  // namespace bushd::daemon
