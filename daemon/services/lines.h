// Motors of one bus, or at ports that keep pace with each other, as one, along a straight line or a
// path of several. Each of them has a copy of the line's run (motion/axis.h), begun at the same
// tick and changed at the same ticks; who does that is Moves. Here is what is about all of them:
// the line's table, its runs one after the other, and what happens to the others when one does not
// go on.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/dry_run.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/path_points.h"
#include "motion/path.h"
#include "motion/way.h"

namespace bushd::daemon {

// How long a table of a line takes to be uploaded, where nothing is lost.
std::int64_t upload_us(const bushd_table& table, std::int64_t baud);
// A line for the trigger waits no longer for it: clients wait 3 s for an answer, and nobody may be
// gone who could disarm it.
inline constexpr std::int64_t kMostArmedUs = 2'500'000;

class Lines final : public Service {
 public:
  Lines(Installation& installation, const Interlocks& interlocks, Journal& journal, Moves& moves,
        OpenMoves& open_moves, DryRuns& dry_runs)
      : installation_(installation),
        interlocks_(interlocks),
        journal_(journal),
        moves_(moves),
        open_(open_moves),
        dry_runs_(dry_runs) {}

  void request(std::int64_t now_us, const api::Asker& asker, const api::MoveLine& request);
  void request(std::int64_t now_us, const api::Asker& asker, const api::MovePath& request);
  void request(const api::Asker& asker, const api::ArmLine& request);
  // As things stand: its ends can be reached. The line itself is not planned for that, and one that
  // leads on from another is not looked at.
  bool would_take(const api::MoveLine& request) const;

  // The table of the line that is asked for, if the line is to wait until it has been uploaded to
  // these MCUs: they rest, have room for it, and make the line's run then, as those do that have it
  // already. Milliseconds for long tables.
  struct WantedTable {
    std::shared_ptr<const tables::Envelope> table;
    std::vector<McuId> mcus;  // that get it
    std::vector<McuId> all;   // of the line
    std::int64_t upload_us;   // on a line that loses nothing
    std::int64_t most_us;     // the request waits no longer
  };
  std::optional<WantedTable> table_to_upload(const api::MoveLine& request) const;
  std::optional<WantedTable> table_to_upload(const api::ArmLine& request) const;

  // A path is being planned; one slice of that.
  bool plans() const;
  void work();

  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;

 private:
  // Where a way leads, and the shortest delay of each motor's steps on it.
  struct Point {
    std::vector<std::int64_t> steps;
    std::vector<bushd_delay> shortest_delays;
    std::vector<units::Steps> asked_for{};  // of the last point of a line
  };
  // By the trigger.
  struct Begin {
    MotorId motor;
    motion::Tick start;
    std::int64_t late_ns;
  };
  struct Line {
    std::vector<MotorId> motors;  // in the request's order, as all that is by motor
    std::vector<Point> points;    // the one that the way leads to, and those to come
    motion::Way way;
    std::uint32_t target = 0;  // step of the way at which its point is
    tables::TablePtr by{};     // what its one motor goes by, in place of its own table
    // Of a path, in place of the way: all of it, and what the run that is made, or comes, is of it.
    std::shared_ptr<motion::Path> path{};
    std::shared_ptr<motion::Path> rest{};
    std::shared_ptr<const motion::PathTrack> track{};  // of the whole rest
    std::vector<tables::TablePtr> tables{};            // that it points to
    // For the trigger: some of its motors, or all while none has begun.
    bool waits = false;
    bool begun = true;
    std::shared_ptr<link::LinePace> pace{};  // of the run under way, where ports make it
    std::vector<Begin> begins{};             // of those for which it has come

    std::uint32_t longest() const;
    std::int64_t position_at(std::size_t motor, std::uint32_t step) const;
    double most_steps_per_s(std::size_t motor) const;
    // A motor's share of a run between these steps.
    motion::LineShare share(std::size_t motor, std::uint32_t from, std::uint32_t to);
  };
  // A path whose points are coming.
  struct Incoming {
    Line line;
    // Of each motor's way: the points farthest up and down, 0 where it stands.
    struct End {
      std::int32_t point;
      std::int64_t steps;
    };
    std::vector<End> low;
    std::vector<End> high;
    std::vector<units::Scale> scales;  // of each motor at the first point; the same for all
    std::uint64_t after_stops = 0;     // as Asker::after_stops, of the part asked for first
    std::int32_t rows = 0;
    int direction = 0;  // of a motor with speeds
  };
  // A path that is not planned yet.
  struct Coming {
    api::Asker asker;
    bool dry_run;
    Incoming path;
  };

  Result<Line> line_of(const api::MoveLine& request) const;
  Result<void> may_be_one_line(const std::vector<MotorId>& motors) const;
  Result<void> on_one_bus(const std::vector<MotorId>& motors) const;
  Result<std::vector<Point>> points_of(const Line& line, const api::MoveLine& request) const;
  tables::TablePtr table_of(const Line& line, std::size_t motor) const;
  bushd_delay shortest_delay_on(const Line& line, std::size_t motor,
                                bushd_delay shortest_delay) const;
  motion::Way lay(const Line& line, const std::vector<std::int64_t>& from, const Point& to) const;
  Result<void> fits_duration(Line& line, std::optional<double> duration_s) const;

  void plan_only(std::int64_t now_us, const api::Asker& asker, const Line& line);
  void start(std::int64_t now_us, const api::Asker& asker, Line line);
  void log(Line& line);
  void open(const api::Asker& asker, std::uint64_t number, const Line& line);
  static bool has_all_of(const Line& line, const Mcu& mcu);  // its motors
  bool in_mcus(std::uint64_t number, const Line& line) const;
  std::map<BusId, motion::Tick> starts_of(std::int64_t now_us,
                                          const std::vector<MotorId>& motors) const;
  bool makes_another(const Mcu& mcu, std::uint64_t number) const;  // line than this one
  std::optional<WantedTable> table_to_upload(const api::MoveLine& request, bool armed) const;
  std::optional<WantedTable> table_to_upload(const Line& line, bool armed) const;
  bool may_get_tables(const std::vector<MotorId>& motors, bool armed) const;
  // Of these of its motors, by place: the part of the way between these steps of it.
  void begin_run(std::int64_t now_us, std::uint64_t number, Line& line,
                 const std::vector<std::size_t>& indices, std::uint32_t to);

  std::optional<Precedence::Overtaken> overtaken(const Incoming& path) const;
  // Precondition: the installation has its motors.
  std::optional<Precedence::Overtaken> overtaken(const std::string& client, const api::Asker& asker,
                                                 const api::MovePath& part) const;
  Result<Incoming> begin_points(const api::Asker& asker, const api::MovePath& request) const;
  Result<void> same_scales(const Incoming& incoming) const;
  Result<void> add_points(Incoming& incoming, const api::MovePath& request) const;
  Result<bushd_delay> shortest_delay_to(Incoming& incoming, std::int64_t point, double speed) const;
  Result<void> may_follow(const Incoming& incoming) const;
  Result<void> may_begin(const Line& line) const;
  void begin_path(std::int64_t now_us, Coming coming);

  // lines_trigger.cpp
  static api::MoveLine as_move(const api::ArmLine& request);
  Result<void> check_table(const Line& line, const Mcu& mcu) const;
  Result<Line> line_to_arm(const api::ArmLine& request) const;
  Result<void> may_wait(const Line& line) const;
  void arm(const api::ArmLine& request, std::uint64_t number, Line& line);
  bool waits(MotorId motor, std::uint64_t number) const;
  void note_begin(MotorId motor, std::uint64_t number, Line& line) const;
  // Returns whether all of its motors that are left have begun.
  bool follow_trigger(std::int64_t now_us, std::uint64_t number, Line& line);
  std::optional<std::string> cause_to_wait_no_more(const Line& line,
                                                   const std::vector<MotorId>& waiting) const;
  void keep_together(std::int64_t now_us, const std::vector<MotorId>& begun);

  // A request for motors that move.
  Result<std::uint64_t> number_of(const std::vector<MotorId>& motors) const;
  void redirect(std::int64_t now_us, const api::Asker& asker, const std::vector<MotorId>& motors,
                const api::MoveLine& request);
  // `targets`: of the line's motors, in their order.
  Result<std::uint32_t> step_of(const Line& line, const std::vector<MotorId>& motors,
                                const api::MoveLine& request,
                                std::vector<units::Steps>& targets) const;
  void ask_for_end(const Line& line);

  const motion::OnLine* on_line(MotorId motor, std::uint64_t number) const;
  // Returns false when none of its motors is on it any more.
  bool follow(std::int64_t now_us, std::uint64_t number, Line& line);
  std::optional<std::string> cause_to_end(std::int64_t now_us, std::uint64_t number,
                                          const Line& line) const;
  void end(std::int64_t now_us, std::uint64_t number, const Line& line, const std::string& cause);
  void go_on(std::int64_t now_us, std::uint64_t number, Line& line);
  std::string conclusion(std::uint64_t number) const;
  std::string deviation(const Line& line) const;
  // How far its ports were apart.
  static std::string apart(const Line& line);
  const std::string& limiting(const Line& line) const;

  Installation& installation_;
  const Interlocks& interlocks_;
  Journal& journal_;
  Moves& moves_;
  OpenMoves& open_;
  DryRuns& dry_runs_;
  std::map<std::uint64_t, Line> lines_;
  PathPoints path_points_;
  std::map<std::string, Incoming> incoming_;  // by client
  // Paths of which a stop has ended all, and points are still to come; by client.
  std::map<std::string, Precedence::Overtaken> ended_;
  std::list<Coming> coming_;
  std::uint64_t last_number_ = 0;
};

}  // namespace bushd::daemon
