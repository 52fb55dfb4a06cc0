// A motion of a CAMAC module that its MCU carries out by itself: the text of a program (programs.h)
// is put into the MCU and run, as by any client.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "daemon/model/installation.h"
#include "daemon/services/camac_asker.h"
#include "heritage/camac/motors.h"
#include "heritage/camac/shutter.h"

namespace bushd::daemon {

// As long as no codes rise on the way to the middle of the motion, it is one by a table.
bool falls_to_the_middle(const camac::Program& program);
// How long a unit of its codes takes.
std::uint32_t code_unit_ns(int f_start_hz);

// Whether the MCU can have the motion of this module as a program.
Result<void> may_have_program(const Mcu& mcu, bool as_written);

// What the program does. `as_written`: by its codes as they stand; otherwise by the motor's table.
std::string text_of(const camac::Program& program, const std::string& motor, bool without_host,
                    bool as_written, int f_start_hz);
std::string text_of(const camac::Travel& travel, const std::string& motor, bool without_host,
                    bool as_written);

// What people are told of codes as they are written: how the motor stops in them.
std::string as_written_note(const Installation& installation, MotorId motor,
                            std::int64_t fastest_ns);

// Put and run, one after the other.
class CamacProgram {
 public:
  CamacProgram(std::string name, std::shared_ptr<CamacSession> session, AskCore ask)
      : name_(std::move(name)), session_(std::move(session)), ask_(std::move(ask)) {}

  void begin(std::int64_t now_us, std::string text, std::uint64_t after_stops);
  // The result of the run; or why there is none, once that is known.
  std::optional<api::Reply> follow(std::int64_t now_us);
  bool runs() const { return stage_ == Stage::kRuns; }

 private:
  enum class Stage { kGetsPut, kRuns };
  api::Asker asker() const {
    return {.session = session_, .number = session_->next_number(), .after_stops = after_stops_};
  }

  const std::string name_;
  const std::shared_ptr<CamacSession> session_;
  const AskCore ask_;
  Stage stage_ = Stage::kGetsPut;
  std::uint64_t after_stops_ = 0;
};

}  // namespace bushd::daemon
