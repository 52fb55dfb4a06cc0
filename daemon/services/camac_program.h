// A motion of a CAMAC module that its MCU carries out by itself: the text of a program (programs.h)
// is put into the MCU and run, as by any client.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "daemon/model/installation.h"
#include "daemon/services/camac_asker.h"
#include "daemon/services/programs.h"
#include "heritage/camac/motors.h"
#include "heritage/camac/shutter.h"

namespace bushd::daemon {

// As long as no codes rise on the way to the middle of the motion, it is one by a table.
bool falls_to_the_middle(const camac::Program& program);
// How long a unit of its codes takes.
std::uint32_t code_unit_ns(int f_start_hz);

// Whether the MCU can have the motion of this module as a program.
Result<void> may_have_program(const Mcu& mcu, bool as_written);

// What the program does: by the module's codes, which are not the table of the motor's group. So
// that is what the next daemon expects it to be.
std::string text_of(const camac::Program& program, const std::string& motor, bool without_host,
                    int f_start_hz);
std::string text_of(const camac::Travel& travel, const std::string& motor, bool without_host);

// What people are told of codes as they are written: how the motor stops in them.
std::string as_written_note(const Installation& installation, MotorId motor,
                            std::int64_t fastest_ns);

// What a store keeps of a motion that goes on without the daemon, and the next daemon finds it by.
struct KeptMotion {
  std::uint8_t control = 0;  // register of the module
  std::int64_t from_steps = 0;
  std::uint32_t steps = 0;
  std::uint32_t told = 0;      // of them, to the module
  std::uint32_t checksum = 0;  // of its program
};
std::string to_text(const KeptMotion& motion);
// Nothing for a text that to_text() cannot have made.
std::optional<KeptMotion> kept_motion_of(const std::string& text);

// Put and run, one after the other; or found, as a daemon before has left it.
class CamacProgram {
 public:
  CamacProgram(std::string name, const Programs& programs, std::shared_ptr<CamacSession> session,
               AskCore ask)
      : name_(std::move(name)),
        programs_(programs),
        session_(std::move(session)),
        ask_(std::move(ask)) {}

  void begin(std::int64_t now_us, const Mcu& mcu, std::string text, std::uint64_t after_stops);
  // One with these bytes was run by a daemon before.
  void find(McuId mcu, std::uint32_t checksum);
  // The result of the run; or why there is none, once that is known.
  std::optional<api::Reply> follow(std::int64_t now_us);
  bool runs() const { return stage_ != Stage::kGetsPut; }
  // One that is found can be stopped once its MCU is heard.
  bool is_found() const { return stage_ == Stage::kFound; }
  // Those of the program that runs.
  std::optional<std::uint32_t> checksum() const;

 private:
  enum class Stage { kGetsPut, kRuns, kFound };
  api::Asker asker() const {
    return {.session = session_, .number = session_->next_number(), .after_stops = after_stops_};
  }

  const std::string name_;  // of the module
  std::string program_{};   // of that and the MCU: an MCU has one program
  const Programs& programs_;
  const std::shared_ptr<CamacSession> session_;
  const AskCore ask_;
  Stage stage_ = Stage::kGetsPut;
  std::uint64_t after_stops_ = 0;
  McuId mcu_{};                 // of one that is found
  std::uint32_t checksum_ = 0;  // of its bytes
};

}  // namespace bushd::daemon
