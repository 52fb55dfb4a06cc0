// Holds requests that would move motors until everything that they need is ready.
//
// A request waits until the disk knows that its motors are no longer at rest, until their positions
// are restored, and until their drivers are enabled. A line also waits until its MCUs have the
// table, what is armed until they have no ticks of its motors any more, and what is streamed may
// wait for room on the line. Most requests wait a millisecond or two, many not at all.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/idle_drivers.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/line_room.h"
#include "daemon/services/line_tables.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class WaitingRequests final : public Service {
 public:
  using CarryOut = std::function<void(std::int64_t now_us, const api::Asker&, const api::Request&)>;
  // `busy`: what was carried out before is still being begun; all that is held waits for it.
  // `would_take`: whether the request would be taken as things stand, as far as that is known.
  WaitingRequests(const Installation& installation, const Interlocks& interlocks,
                  const OpenMoves& open_moves, KeptPositions& kept, IdleDrivers& idle_drivers,
                  LineTables& line_tables, const LineRoom& line_room, CarryOut carry_out,
                  std::function<bool()> busy, std::function<bool(const api::Request&)> would_take)
      : installation_(installation),
        interlocks_(interlocks),
        open_moves_(open_moves),
        kept_(kept),
        idle_drivers_(idle_drivers),
        line_tables_(line_tables),
        line_room_(line_room),
        carry_out_(std::move(carry_out)),
        busy_(std::move(busy)),
        would_take_(std::move(would_take)) {}

  // Whether the request is kept here. It is carried out, or refused, in a later step.
  bool hold(std::int64_t now_us, const api::Asker& asker, const api::Request& request);
  bool empty() const { return held_.empty(); }
  bool holds(MotorId motor) const { return any_held({motor}); }

  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;

 private:
  static constexpr std::size_t kMostHeld = 256;

  struct Held {
    api::Asker asker;
    api::Request request;
    std::vector<MotorId> motors;
    std::int64_t since_us;
    LineTables::Wait table{};
  };
  // A jog whose client has gone, or has been silent for as long as it may be: it does not begin.
  static bool is_let_go(std::int64_t now_us, const Held& held);
  // Nothing: the request changes no position, or is refused anyway by who carries it out.
  std::optional<std::vector<MotorId>> motors_of(const api::Request& request) const;
  bool any_held(const std::vector<MotorId>& motors) const;
  // Whatever the disk says: its target is beyond a limit, or its speed beyond its table. Not while
  // something that comes before it may change that.
  bool is_refused_anyway(const api::Request& request, const std::vector<MotorId>& motors) const;
  bool has_ticks(MotorId motor) const;
  Result<bool> make_ready(std::int64_t now_us, Held& held);
  void waits_no_more(Held& held);
  void refuse(Held& held, const std::string& reason);

  const Installation& installation_;
  const Interlocks& interlocks_;
  const OpenMoves& open_moves_;
  KeptPositions& kept_;
  IdleDrivers& idle_drivers_;
  LineTables& line_tables_;
  const LineRoom& line_room_;
  CarryOut carry_out_;
  std::function<bool()> busy_;
  std::function<bool(const api::Request&)> would_take_;
  std::list<Held> held_;
};

}  // namespace bushd::daemon
