// The motor behind a BUSHD-1. A step without a sensor is a move like any other. With one, and in
// automatic travel, the MCU goes by itself (travels.h), by the codes as the table of the motor's
// group; by a program (camac_program.h) if the travel is to go on without the daemon, or its codes
// rise and fall again. The module is told of it as far as reports show it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "daemon/services/camac_client.h"
#include "daemon/services/travels.h"
#include "heritage/camac/bushd1.h"

namespace bushd::daemon {

// The table by which a run makes these codes. Precondition: they fall and rise once.
Result<tables::TablePtr> table_of_travel(const camac::Travel& travel, const std::string& module);

class CamacShutter final : public camac::Shutter, public CamacClient {
 public:
  CamacShutter(std::string name, const config::CamacModule& module, Travels& travels,
               const CamacParts& parts)
      : CamacClient(std::move(name), parts),
        motor_(module.motors.front()),
        without_computer_(module.without_computer),
        travels_(travels) {}

  void refuses(std::string_view why) override { refuse(std::string(why)); }
  bool step(const camac::SingleStep& step) override;
  bool travel(const camac::Travel& travel) override;
  void stop() override;

  // A motion that has been begun before a stop of the motor, and is not yet asked of it, does not
  // begin.
  void end_overtaken();

  // Does what is due, and tells the module what has become of it.
  void follow(std::int64_t now_us, camac::Bushd1& module);

  // A travel that goes on without the daemon, once its MCU has it; and one that a daemon before has
  // left so.
  std::optional<KeptMotion> to_keep(const camac::Bushd1& module) const;
  void find(const KeptMotion& kept, camac::Bushd1& module);

 private:
  struct Motion {
    enum class Kind { kStep, kSensedStep, kTravel };
    enum class Stage { kBegins, kGetsTable, kGoes };
    Kind kind;
    camac::SingleStep step{};
    camac::Travel travel{};
    tables::TablePtr table{};  // of its group; null: it goes by a program of the MCU
    bool alone = false;        // by that
    Stage stage = Stage::kBegins;
    bool to_stop = false;
    bool begins_no_more = false;    // by another's stop
    bool stopping = false;          // it was asked to
    std::uint64_t after_stops = 0;  // as Asker::after_stops
    // The travel as the module knows it.
    bool returns = false;
    std::int64_t from_steps = 0;  // of the run
    std::int64_t told = 0;        // steps of it
    struct Start {
      std::uint32_t tick;
      std::uint32_t ns;
      bool operator==(const Start&) const = default;
    };
    std::optional<Start> start{};  // of the run that was reported last

    // The direction of the run, or the step, that is made.
    bool left() const { return kind == Kind::kTravel ? travel.left != returns : step.left; }
  };

  bool refuse(const std::string& why);
  Result<void> may_begin(std::int64_t steps) const;
  bool takes(Motion motion, const Result<void>& may);
  void begin(std::int64_t now_us);
  void follow_table(std::int64_t now_us, camac::Bushd1& module);
  void ask_mcu(std::int64_t now_us);
  const bushd_report* progress() const;
  static std::int64_t travel_from(const Motion& motion);
  void follow_going(std::int64_t now_us, camac::Bushd1& module);
  void follow_travel(const bushd_report& report, camac::Bushd1& module);
  void tell_steps(camac::Bushd1& module, Motion& motion, bool all) const;
  void end_run(camac::Bushd1& module, Motion& motion);
  void tell_limits(camac::Bushd1& module);
  void end(camac::Bushd1& module, const api::Reply& reply);
  void end_travel(camac::Bushd1& module, Motion& motion, bool done);

  const MotorId motor_;
  const bool without_computer_;
  Travels& travels_;
  std::optional<Motion> motion_;
};

}  // namespace bushd::daemon
