// A CAMAC crate as its programs may rely on it, whatever happens: what they have written is there,
// Q tells L, and each start of a BUSHD-2 ends in exactly one LAM, unless somebody has stopped it.
// Motion is the witness's: it asks here which one a start has led to.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/reply.h"
#include "api/snapshot.h"
#include "config/config.h"
#include "heritage/camac/bushd2.h"
#include "module_registers.h"
#include "request.h"
#include "sim/wire.h"

namespace bushfaults {

// Where the modules stand, in the one crate.
inline constexpr int kCrate = 1;
inline constexpr int kBushd2Station = 5;

// One motion of BUSHD-2: so many steps, at the times of its codes.
struct ProgramMotion {
  std::size_t motor = 0;   // of the module
  std::int64_t steps = 0;  // left: below 0
  std::int64_t unit_ns = 0;
  std::vector<std::int64_t> delays_ns{};  // between its steps
  bushd::camac::Program program{};
};

class Crates {
 public:
  // As the daemon names the module.
  static constexpr const char* kBushd2Client = "camac-1-5";

  // `config` outlives it.
  explicit Crates(const bushd::config::Config& config) : config_(config) {}

  // All registers begin anew. `kept`: what the memory holds was written to a disk.
  void daemon_started(TimeNs now_ns, bool kept);
  // The cycles of a block and their answers. Of modes other than single those of BUSHD-2 only.
  Wrong completed(TimeNs now_ns, const Request& request, const bushd::api::CamacResult& result);
  Wrong raised(TimeNs now_ns, const bushd::api::CamacLam& lam);

  // The daemon has accepted a move that the module asks for. Nothing: two starts may have led to
  // it, and which one did is not known.
  struct Accepted {
    Wrong wrong{};
    std::optional<ProgramMotion> motion{};
  };
  Accepted accepted(const std::string& motor);
  // It has ended.
  void motion_ended(bool reached);
  // Its motor moves for somebody else.
  void motor_taken(TimeNs now_ns);
  // It is paused, and may take longer.
  void wait_since(TimeNs now_ns);

  // A start that has neither ended nor been stopped.
  bool any_open() const { return start_ && start_->sure && !start_->stopped; }
  Wrong check_deadline(TimeNs now_ns) const;

  std::uint64_t starts() const { return starts_; }
  std::uint64_t ended_by_lam() const { return ended_by_lam_; }
  std::uint64_t ended_all_steps() const { return ended_all_steps_; }

 private:
  struct Start {
    TimeNs since_ns = 0;
    // False: it may have had no effect, since the motion before it had perhaps not ended.
    bool sure = true;
    bool stopped = false;
    bool moves = false;
    bool over = false;     // its motion has ended
    bool reached = false;  // by all of its steps
    bool cleared = false;  // statuses of it
    TimeNs taken_ns = -1;  // when its motor was taken from it
    std::vector<ProgramMotion> candidates{};
  };

  Wrong in_single_mode(TimeNs now_ns, const Request& request,
                       const std::vector<Response>& responses);
  Wrong of_one_address(TimeNs now_ns, const Request& request,
                       const std::vector<Response>& responses);
  Wrong scanned(TimeNs now_ns, const Request& request, const std::vector<Response>& responses);
  Wrong cycle(TimeNs now_ns, const Naf& naf, const Response& response);
  Wrong module_cycle(TimeNs now_ns, const Naf& naf, const Response& response);
  Wrong read_register(const Naf& naf, const Response& response);
  Wrong read_requests(const Response& response) const;
  Wrong observe(bool lam);
  bool is_enabled() const { return (registers_.control() & kEnables) == kEnables; }
  ProgramMotion program() const;
  void start(TimeNs now_ns);
  void stop() {
    if (start_) start_->stopped = true;
  }
  void clear();
  void end_start();

  static constexpr std::uint32_t kEnables = 0x60;  // fault and end of motion

  const bushd::config::Config& config_;
  ModuleRegisters registers_{bushd::camac::Bushd2::kMemoryBytes};
  bool inhibited_ = false;
  // Fault or end of motion; nothing: a start may have ended at once, and nobody has looked yet.
  std::optional<bool> flag_ = false;
  bool published_ = false;
  std::optional<Start> start_;
  // Steps of the motion that has ended last by all of its steps, until its statuses are cleared.
  std::optional<std::int64_t> steps_told_;
  std::uint64_t starts_ = 0;
  std::uint64_t ended_by_lam_ = 0;
  std::uint64_t ended_all_steps_ = 0;
};

}  // namespace bushfaults
