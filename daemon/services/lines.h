// Motors of one bus, or at ports that keep pace with each other, as one, along a straight line or a
// path of several. Each of them has a copy of the line's run (motion/axis.h), begun at the same
// tick and changed at the same ticks; who does that is Moves. Here is what is about all of them:
// the line's table, its runs one after the other, and what happens to the others when one does not
// go on.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/coming_paths.h"
#include "daemon/services/dry_run.h"
#include "daemon/services/line.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"

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
        dry_runs_(dry_runs),
        paths_(installation, interlocks, moves, open_moves) {}

  void request(std::int64_t now_us, const api::Asker& asker, const api::MoveLine& request);
  // The line of one motor that is asked for next, by this client and with this number, goes by this
  // table in place of the motor's own. Its MCU need not have it, and ramps the motor down by its
  // own one when the link is lost; so no delay of the line may be shorter than any of that.
  void lend(const api::Asker& asker, tables::TablePtr table);
  void request(const api::Asker& asker, const api::MovePath& request) {
    paths_.request(asker, request);
  }
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

  void end_overtaken(std::int64_t) override { paths_.end_overtaken(); }
  void step(std::int64_t now_us) override;

 private:
  struct Lent {
    api::Asker asker;
    tables::TablePtr table;
  };
  tables::TablePtr take_lent(const api::Asker& asker);  // null: none

  Result<Line> line_of(const api::MoveLine& request, const tables::TablePtr& by = {}) const;
  Result<std::vector<Straight::Point>> points_of(const std::vector<MotorId>& motors,
                                                 const api::MoveLine& request,
                                                 const tables::TablePtr& by = {}) const;
  // What a motor goes by: `by`, or where there is none its own table.
  tables::TablePtr table_of(MotorId motor, const tables::TablePtr& by) const;
  bushd_delay shortest_delay_by(const tables::TablePtr& by, MotorId motor,
                                bushd_delay shortest_delay) const;
  // As the line goes: by its law, with its feed.
  motion::Way lay(const std::vector<MotorId>& motors, const Straight& straight,
                  const std::vector<std::int64_t>& from, const Straight::Point& to) const;
  Result<void> may_be_laid(const std::vector<MotorId>& motors, const Straight& straight,
                           const std::vector<std::int64_t>& from) const;
  static Result<void> is_possible(const motion::Way& way, const std::optional<Feed>& feed);
  Result<void> fits_duration(const Line& line, motion::Way& way,
                             std::optional<double> duration_s) const;

  void plan_only(std::int64_t now_us, const api::Asker& asker, const Line& line,
                 const Straight& way);
  void plan_only(std::int64_t now_us, const api::Asker& asker, Line& line, AlongPath& along);
  void start(std::int64_t now_us, const api::Asker& asker, Line line);
  void log(Line& line);
  void open(const api::Asker& asker, std::uint64_t number, const Line& line);
  static bool has_all_of(const Line& line, const Mcu& mcu);  // its motors
  bool in_mcus(std::uint64_t number, const Line& line) const;
  // Each bus has a tick of its own: there is one bus, or one a motor.
  std::map<BusId, motion::Tick> starts_of(std::int64_t now_us, const Line& line,
                                          const std::vector<MotorId>& motors, bool by_mcus);
  // Where a motor's run has led, or if it begins anew was to begin; in steps of the line.
  std::uint32_t place_of(MotorId motor, bool anew) const;
  // Those that have missed their start when others have begun.
  void end_split_start(std::uint64_t number, const Line& line);
  bool begins_anew(std::uint64_t number, const Line& line) const;  // a motor has missed its start
  bool only_waits(MotorId motor) const;
  bool makes_another(const Mcu& mcu, std::uint64_t number) const;  // line than this one
  std::optional<WantedTable> table_to_upload(const api::MoveLine& request, bool armed) const;
  std::optional<WantedTable> table_to_upload(const Line& line, bool armed) const;
  bool may_get_tables(const std::vector<MotorId>& motors, bool armed) const;
  std::uint32_t from_of(std::uint64_t number, const Line& line, std::size_t i, bool anew) const;
  bool may_be_in_mcus(std::uint64_t number, const Line& line,
                      const std::vector<std::size_t>& indices, bool anew) const;
  // Begins the run of these of its motors, by place, from where their runs have led to this step.
  void begin_run(std::int64_t now_us, std::uint64_t number, Line& line,
                 const std::vector<std::size_t>& indices, std::uint32_t to);

  // lines_trigger.cpp
  static api::MoveLine as_move(const api::ArmLine& request);
  Result<void> check_table(const motion::Way& way, const Mcu& mcu) const;
  Result<Line> line_to_arm(const api::ArmLine& request) const;
  Result<void> may_wait(const Line& line) const;
  void arm(const api::ArmLine& request, std::uint64_t number, Line& line);
  bool waits(MotorId motor, std::uint64_t number) const;
  void note_begin(MotorId motor, std::uint64_t number, Triggered& trigger) const;
  // Returns whether all of its motors that are left have begun.
  bool follow_trigger(std::int64_t now_us, std::uint64_t number, const Line& line,
                      Triggered& trigger);
  std::optional<std::string> cause_to_wait_no_more(const Line& line, const Triggered& trigger,
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
  static std::string apart(const Straight& line);
  const std::string& limiting(const Line& line, const motion::Way& way) const;

  Installation& installation_;
  const Interlocks& interlocks_;
  Journal& journal_;
  Moves& moves_;
  OpenMoves& open_;
  DryRuns& dry_runs_;
  std::map<std::uint64_t, Line> lines_;
  ComingPaths paths_;
  std::vector<Lent> lent_;  // at most one to a client
  std::uint64_t last_number_ = 0;
};

}  // namespace bushd::daemon
