// The log of moves (docs/design.md): which motor began what, at which tick, and what became of it,
// one JSON object a line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/by_id.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "motion/way.h"

namespace bushd::daemon {

class Journal final : public Service {
 public:
  Journal(const Installation& installation, Outputs& outputs);

  void started(MotorId motor, std::int64_t steps, motion::Tick start, std::uint32_t late_ns,
               bool by_table);
  // Before the runs of its motors. Returns its number.
  struct OnWay {
    MotorId motor;
    std::uint32_t increment;
    bushd_delay shortest_delay;
    tables::TablePtr table;
  };
  std::uint64_t line_laid(const motion::Way& way, const std::vector<OnWay>& motors);
  std::uint64_t path_laid(const std::vector<MotorId>& motors, const motion::Path& path);
  // A trajectory in the log, and how many of its rows are there.
  struct LoggedTrajectory {
    std::uint64_t number = 0;
    std::size_t rows = 0;
  };
  // Before its motors follow it.
  LoggedTrajectory trajectory_begun() { return {.number = ++last_id_}; }
  // Rows that it has now and that have not been logged, and whether one follows.
  void trajectory_rows(LoggedTrajectory& logged, const motion::Trajectory& trajectory,
                       const std::vector<MotorId>& motors);
  void changed(MotorId motor, const motion::Change& change);
  void ended(MotorId motor, std::string_view result);
  void position_set(MotorId motor, std::int64_t from_steps, const api::Asker& by);
  // Its MCU, out of reach meanwhile, has moved it on.
  void position_corrected(MotorId motor, std::int64_t from_steps);
  void offset_set(MotorId motor, const api::Asker& by);
  void configured(MotorId motor, std::string_view key, std::string_view value,
                  const api::Asker& by);

  // Motion that MCUs make by themselves, homing and local inputs: no move has led to where these
  // motors stand. To be called before and after motors follow a report; `being_set`: positions that
  // change because somebody sets them.
  void before_report(MotorId motor, bool being_set);
  void after_report(const Mcu& mcu);

  void goes_online(Mcu& mcu) override;
  // Its MCU has restarted.
  void position_lost(MotorId motor, std::int64_t from_steps);

 private:
  // A motor that moves by itself.
  struct Autonomous {
    std::optional<motion::Tick> since;  // of the last report before, if there is one
    std::int64_t from_steps;
    std::string_view what;  // word of the log
    bool set = false;       // the MCU's counter does not go on from there
  };
  void end_autonomous(MotorId motor, const Mcu& mcu);
  void tell_table(MotorId motor, const tables::Table& table);
  void tell_levels(const Mcu& mcu);

  const Installation& installation_;
  Outputs& outputs_;
  std::uint64_t last_id_;
  ById<MotorId, std::uint64_t> id_;  // of its present move in the log
  ById<MotorId, std::optional<Autonomous>> autonomous_;
  ById<MotorId, std::string> table_told_;  // of those that are no files, the last one: its hash
  ById<McuId, std::optional<motion::Tick>> told_;  // the tick of the last report
};

}  // namespace bushd::daemon
