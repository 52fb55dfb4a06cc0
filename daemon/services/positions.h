// Says where motors stand: sets their positions, which are known then, or the offsets of their user
// positions.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <vector>

#include "daemon/model/confirmation.h"
#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/journal.h"

namespace bushd::daemon {

class Positions final : public Service {
 public:
  Positions(Installation& installation, Interlocks& interlocks, Journal& journal, Outputs& outputs);

  void request(std::int64_t now_us, const api::Asker& asker, const api::SetPosition& request);

  // Told of each motor whose offset has changed: what its coordinates were before.
  using OffsetListener =
      std::function<void(MotorId, const units::Coordinates& before, const api::Asker& by)>;
  void set_offset_listener(OffsetListener listener) { offset_listener_ = std::move(listener); }
  // Told of each motor whose position was set, once its MCU has confirmed it.
  using Listener = std::function<void(MotorId, std::int64_t from_steps, const api::Asker& by)>;
  void set_listener(Listener listener) { listener_ = std::move(listener); }

  // Tells who has set offsets, once the disk has them.
  using Answerer = std::function<void(const api::Asker&, api::Completed)>;
  void set_answerer(Answerer answerer) { answerer_ = std::move(answerer); }

  // As things stand.
  bool would_take(const api::SetPosition& request) const { return plan_of(request).has_value(); }
  // What was asked for is not yet done.
  bool being_set(MotorId motor) const;
  // A position that was asked for is not yet set, and it is that of the MCU's counter.
  bool counter_being_set(MotorId motor) const;

  void reports(std::int64_t now_us, Mcu& mcu) override { follow(now_us, &mcu); }
  void step(std::int64_t now_us) override { follow(now_us, nullptr); }

 private:
  struct Part {
    MotorId motor;
    std::int32_t steps;
    std::int64_t from_steps;
  };
  struct Offset {
    MotorId motor;
    units::Coordinates coordinates;
  };
  // What is asked of all motors, checked.
  struct Plan {
    std::vector<Part> parts{};
    std::vector<Offset> offsets{};
  };
  struct Setting {
    Confirmation confirmation;
    std::vector<Part> parts;
    std::vector<Offset> offsets;  // once all of these are set
  };
  Result<Plan> plan_of(const api::SetPosition& request) const;
  Result<void> may_be_set(MotorId motor) const;
  Result<void> add(MotorId motor, const api::Amount& position, bool dial, Plan& plan) const;
  void follow(std::int64_t now_us, const Mcu* reported);
  void end(Setting& setting, const Result<void>& confirmed);
  bool is_set(const Setting& setting, const Part& part) const;
  Result<void> outcome(const Setting& setting, const Result<void>& confirmed) const;
  void put(Offset& offset, const api::Asker& by);
  void note(const Part& part, const api::Asker& by);

  Installation& installation_;
  OffsetListener offset_listener_;
  Listener listener_;
  Answerer answerer_;
  Journal& journal_;
  Outputs& outputs_;
  std::list<Setting> open_;
};

}  // namespace bushd::daemon
