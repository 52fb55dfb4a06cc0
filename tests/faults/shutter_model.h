// A BUSHD-1 and the shutter behind it, as programs may rely on them, whatever happens: memory and
// registers are as written, L is what the request register and the enables say, no request comes
// without a cause and none goes away by itself, each start ends in a request unless it is stopped.
// The motor is judged by its pulses alone: so many steps as the start asks for, at the times of its
// codes, and of a shutter that follows the reactor only after one of its edges.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "api/snapshot.h"
#include "config/config.h"
#include "module_registers.h"
#include "sim/edge.h"
#include "words/camac.h"

namespace bushfaults {

inline constexpr int kBushd1Station = 7;

// Where the plant has its switches: it closes at both ends, and at every second step a sensor sees
// it.
struct ShutterPlace {
  static constexpr std::int64_t kLeftSteps = 0;
  static constexpr std::int64_t kRightSteps = 40;
  static constexpr std::int64_t kSensorPeriod = 2;
  // Its motor, if the configuration has a BUSHD-1.
  static std::optional<bushd::MotorId> motor(const bushd::config::Config& config);
};

class ShutterModel {
 public:
  // As the daemon names the module.
  static constexpr const char* kClient = "camac-1-7";

  // `config` outlives it.
  explicit ShutterModel(const bushd::config::Config& config) : config_(config) {}

  void daemon_started(TimeNs now_ns, bool kept);
  void begin_block() { now_.reset(); }
  // A cycle of its station, or one that concerns the whole crate.
  Wrong cycle(TimeNs now_ns, const Naf& naf, const Response& response);
  // What its L is after the cycles of a block, and before those of the next one.
  Wrong observe(bool lam);
  Wrong raised(const bushd::api::CamacLam& lam);

  // Its motor has made a step, and stands there as the plant counts.
  Wrong stepped(TimeNs now_ns, bool right, std::int64_t stands);
  // At the trigger input of its MCU.
  void trigger(TimeNs now_ns, bool rising);
  // Somebody else may move it.
  void disturbed();
  // The daemon says what it does.
  void said(TimeNs now_ns, const bushd::api::MotorState& state);
  // Clients have stopped all, and all is well.
  void calm();
  Wrong check_deadline(TimeNs now_ns) const;
  // A start may be under way.
  bool any_open() const { return start_.has_value(); }

  std::uint64_t starts() const { return starts_; }
  std::uint64_t steps_done() const { return steps_done_; }
  std::uint64_t travels() const { return travels_; }    // from limit to limit and back
  std::uint64_t openings() const { return openings_; }  // after an edge

 private:
  enum class Mode { kStep, kSensedStep, kTravel, kSynchronous };
  // What may be under way. Of one that is not sure it is not known what it is.
  struct Start {
    TimeNs since_ns;
    bool sure;
    Mode mode = Mode::kStep;
    bool left = false;
    std::vector<TimeNs> delays_ns{};  // before its steps
    TimeNs wait_ns = 0;
    bool stopped = false;
    bool failed = false;     // its request has been seen
    bool begun = false;      // the daemon has said that it moves
    bool told = false;       // by a LAM
    bool disturbed = false;  // others may have moved it
    bool cleared = false;    // requests of it
    std::optional<TimeNs> rests_since_ns{};
    // The run that is made, or was made last.
    bool returns = false;
    std::size_t made = 0;
    TimeNs first_ns = 0;
    TimeNs last_ns = 0;
    TimeNs edge_ns = 0;
    int runs = 0;  // of all of their steps
    bool lasts() const { return mode == Mode::kTravel || mode == Mode::kSynchronous; }
  };

  bool is_here() const { return ShutterPlace::motor(config_).has_value(); }
  Wrong memory_cycle(TimeNs now_ns, const Naf& naf, const Response& response);
  Wrong read_requests(std::uint32_t data);
  bool lam_of(std::uint32_t requests) const;
  std::uint32_t possible() const;
  void start(TimeNs now_ns);
  void stop();
  void clear();
  void over();
  Wrong end_step(std::uint32_t fresh);
  Wrong end_travel(std::uint32_t all);
  Wrong begin_run(TimeNs now_ns, bool right);
  Wrong next_step(TimeNs now_ns, bool right);

  const bushd::config::Config& config_;
  ModuleRegisters registers_{256};
  bool inhibited_ = false;
  std::uint32_t seen_ = 0;            // requests that nobody has cleared
  std::uint32_t possible_ = 0;        // those that starts may have left, since they were cleared
  std::optional<std::uint32_t> now_;  // within a block, while nothing can change them
  std::deque<TimeNs> edges_ns_;       // rising ones
  std::optional<Start> start_;
  bool others_move_ = false;  // since then it has not rested for a while
  std::optional<TimeNs> rests_since_ns_;
  std::int64_t stands_ = 0;
  std::uint64_t starts_ = 0;
  std::uint64_t steps_done_ = 0;
  std::uint64_t travels_ = 0;
  std::uint64_t openings_ = 0;
};

}  // namespace bushfaults
