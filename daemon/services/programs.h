// Programs of MCUs (docs/programs.md): who may have which, and the one result of each run.
//
// An MCU has one program. What it is the daemon knows of those that it has put, also before it was
// started if there is a state store, by their checksum: another one is shown, and can be stopped. A
// program goes by what held when it was put; a run checks all of it again, from where the motors
// stand.
#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/idle_drivers.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/program_check.h"

namespace bushd::daemon {

class Programs final : public Service {
 public:
  Programs(Installation& installation, Interlocks& interlocks, OpenMoves& open_moves,
           KeptPositions& kept, IdleDrivers& idle_drivers, Outputs& outputs);

  void request(const api::Asker& asker, const api::PutProgram& request);
  void request(const api::Asker& asker, const api::EraseProgram& request);
  void request(const api::Asker& asker, const api::RunPrograms& request);
  void request(const api::Asker& asker, const api::ListPrograms& request);

  // What is done to the program that has this motor; if none has, nothing happens. A stop ends it,
  // also where its MCU is out of reach: then when it comes back.
  void stop(MotorId motor);
  void pause(MotorId motor);
  void resume(MotorId motor);
  Result<void> may_resume(MotorId motor) const;  // precondition: is_paused
  bool is_paused(MotorId motor) const;           // all its motors stand
  // The program of this name that was put by this daemon: the checksum of its bytes.
  std::optional<std::uint32_t> checksum_of(const std::string& name) const;
  // What has become of a program with these bytes that was run before this daemon was started.
  // Unknown: its MCU is not heard, or not yet configured.
  enum class Found { kUnknown, kRuns, kEnded, kNotThere };
  Found found(McuId mcu, std::uint32_t checksum) const;
  api::Completed ending(McuId mcu) const;  // precondition: kEnded
  // The state store has been read.
  void take_kept();
  // The daemon ends: those that go on without a host are left to themselves.
  void leave();
  // What an MCU has under way, and where: "scan runs, frame 3, after 2 repeats, without host"; "":
  // nothing.
  std::string text(McuId mcu) const;
  // No MCU that answers has one under way.
  bool at_rest() const;

  void goes_online(Mcu& mcu) override;
  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) override;
  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;
  std::int64_t next_wake_us() const;

 private:
  // The share of the time to a common start in which all have to take it.
  static constexpr std::int64_t kConfirmedIn = 1;
  static constexpr std::int64_t kConfirmedOf = 2;
  // An MCU writes what it keeps when it has stayed the same for 512 ticks and no motor moves.
  static constexpr std::int64_t kStoredWithinUs = 10'000'000;

  struct Upload {
    CheckedProgram program;
    api::PutProgram source;
    api::Asker asker;
    bool began = false;  // its bytes are being sent; else its line table
    bool kept = false;   // it is to outlive power cuts, or the one before was
    std::optional<std::int64_t> stored_by_us{};  // the MCU has it
  };
  struct Erase {
    api::Asker asker;
    bool kept = false;  // it was to outlive power cuts
    std::optional<std::int64_t> stored_by_us{};
  };
  // Motors whose limit switch inhibits a direction.
  struct Forbidden {
    std::uint16_t positive = 0;
    std::uint16_t negative = 0;
  };
  // Its motors are in the program until it ends.
  struct Run {
    std::vector<MotorId> motors{};
    std::uint8_t number = 0;  // as the MCU has it
    bool asked = false;       // of the MCU
    bool known = true;        // it was begun here
    bool without_host = false;
    bool taken = false;        // the MCU has it
    bool stop_wanted = false;  // somebody has stopped it
    bool stop_asked = false;   // and its MCU has been told
    bool pause_asked = false;
    bool table_asked = false;               // that of its lines, once more
    Forbidden forbidden_before{};           // by limit switches, at its start
    std::optional<std::string> ended_by{};  // why, if nobody has stopped it
  };
  struct OfMcu {
    std::optional<CheckedProgram> program{};  // that was put; it may be another one by now
    std::optional<api::PutProgram> kept{};    // by a daemon before, and not yet looked at
    std::optional<Upload> upload{};
    std::optional<Run> run{};
    std::optional<Erase> erase{};  // until the MCU has done it
    std::uint8_t last_number = 0;
  };
  // Runs that begin together, until all have been taken.
  struct Start {
    api::Asker asker;
    std::vector<McuId> mcus{};
    // Once their MCUs have been asked: until then all must be known to have taken it. What is left
    // to the start is time enough to take it back.
    std::optional<std::int64_t> confirmed_by_us{};
  };

  const link::ProgramView& view(McuId mcu) const;
  bool is_loaded(McuId mcu) const;  // with what was put
  std::optional<McuId> find(const std::string& name) const;
  std::optional<McuId> find_by_checksum(const std::string& checksum) const;
  const std::string& stopped_by(McuId mcu) const;
  bool has_or_gets(McuId mcu, const std::string& name) const;
  Result<void> may_be_put(const CheckedProgram& program) const;
  Result<void> may_run(McuId mcu) const;
  Result<std::vector<McuId>> mcus_of(const api::RunPrograms& request) const;
  api::ProgramEntry entry(McuId mcu) const;
  void follow_upload(std::int64_t now_us, McuId mcu);
  void keep(McuId mcu, const api::PutProgram* source);
  void know_again(McuId mcu);
  void end_upload(McuId mcu, const Result<void>& how);
  bool has_line_table(McuId mcu) const;
  enum class Ready { kNow, kNotYet, kNever };
  Ready make_ready(std::int64_t now_us, const Start& start);
  void begin(std::int64_t now_us, Start& start);
  bool follow(std::int64_t now_us, Start& start);
  void adopt(McuId mcu);
  void warn_of_power_on(const Mcu& mcu);
  Forbidden forbidden(McuId mcu) const;
  void follow(McuId mcu);
  void follow_end(McuId mcu);
  void follow_erase(std::int64_t now_us, McuId mcu);
  bool is_kept(McuId mcu) const;  // the program that it has now
  bool waits_until_stored(std::int64_t now_us, McuId mcu, std::optional<std::int64_t>& by_us) const;
  void give_up(const Start& start, api::Outcome outcome, const std::string& reason);
  void give_up_start_of(McuId mcu, api::Outcome outcome, const std::string& reason);
  void end(McuId mcu, api::Outcome outcome, const std::string& reason);
  std::string where(McuId mcu) const;

  Installation& installation_;
  const Interlocks& interlocks_;
  OpenMoves& open_;
  KeptPositions& kept_;
  IdleDrivers& idle_drivers_;
  Outputs& outputs_;
  ById<McuId, OfMcu> mcus_;
  std::list<Start> starts_;
};

}  // namespace bushd::daemon
