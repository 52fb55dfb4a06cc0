// The motors behind a BUSHD-2. A program becomes the table of its motor's group if the MCUs of the
// group rest, and the motor is moved by it as by any table. Where they move other motors, it is
// moved by the program at once, along a line of its own (lines.h). The module is told as much of it
// as MCUs report.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/services/camac_client.h"
#include "daemon/services/lines.h"
#include "heritage/camac/bushd2.h"

namespace bushd::daemon {

// The table of a program: as many of its codes, from the first one on, as never rise.
Result<tables::TablePtr> table_of_program(const camac::Program& program, int f_start_hz,
                                          const std::string& module);

// What the limit switches of a motor say: right is in positive direction.
camac::MotorStatus limits_of(const Installation& installation, MotorId motor);

class CamacMotors final : public camac::Motors, public CamacClient {
 public:
  CamacMotors(std::string name, const config::CamacModule& module, Lines& lines,
              const CamacParts& parts)
      : CamacClient(std::move(name), parts), config_(module), lines_(lines) {}

  camac::MotorStatus status(int motor) override;
  bool move(const camac::Program& program) override;
  void stop(int motor) override;

  // A motion that has been begun before a stop of its motor, and is not yet asked of it, does not
  // begin.
  void end_overtaken();

  // Does what is due, and tells the module what has become of its motion.
  void step(std::int64_t now_us, camac::Bushd2& module);

  // A motion that goes on without the daemon, once its MCU has it; and one that a daemon before has
  // left so.
  std::optional<KeptMotion> to_keep(const camac::Bushd2& module) const;
  void find(const KeptMotion& kept, camac::Bushd2& module);

 private:
  struct Motion {
    enum class Stage { kBegins, kGetsTable, kMoves };
    MotorId motor;
    camac::Program program;
    tables::TablePtr table;  // of its group; null: it goes by a program of the MCU
    bool alone = false;      // by that
    Stage stage = Stage::kBegins;
    std::int64_t from_steps = 0;
    std::uint32_t told = 0;  // of its steps
    bool to_stop = false;
    bool stopping = false;          // it was asked to
    std::uint64_t after_stops = 0;  // as Asker::after_stops
  };

  void begin(std::int64_t now_us, camac::Bushd2& module);
  bool streams() const;
  void follow_table(std::int64_t now_us, camac::Bushd2& module);
  void move(std::int64_t now_us, camac::Bushd2& module, const tables::TablePtr& by);
  void follow_move(std::int64_t now_us, camac::Bushd2& module);
  std::int64_t moved(const Motion& motion) const;
  void tell_steps(camac::Bushd2& module);
  void end(camac::Bushd2& module, const api::Reply& reply);
  std::int64_t fastest_ns(const camac::Program& program) const;

  const config::CamacModule& config_;
  Lines& lines_;
  std::optional<Motion> motion_;
};

}  // namespace bushd::daemon
