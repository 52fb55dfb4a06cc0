// What the daemon needs of any bus, whatever its MCUs, or what stands in for them, speak: a machine
// without I/O that takes time and received bytes, and gives bytes to send and events. The services
// know no more of a bus than this.
//
// Every bus reports its MCUs in the same words: McuView with phase, identity and the last report,
// and events when that changes. What an MCU reports of a tick is true of that tick: a motor's
// position is where its plan (the TickSource) leads at the beginning of McuView::tick, unless a
// limit, a fault, homing or a travel moves it otherwise. Ticks never run backwards. How fast they
// run is the bus's own affair; another bus's ticks say nothing about this one's.
//
// What only some buses can do each of them offers by an interface of its own (offers.h).
//
// Not thread-safe; all times are microseconds of one monotonic clock.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "bus/rs485/bus_setup.h"
#include "bus/rs485/common_start.h"
#include "bus/rs485/event.h"
#include "bus/rs485/health.h"
#include "bus/rs485/mcu_index.h"
#include "bus/rs485/mcu_record.h"
#include "bus/rs485/offers.h"
#include "bus/rs485/tick.h"
#include "engine/message.h"

namespace bushd::link {

class BusMaster {
 public:
  BusMaster() = default;
  virtual ~BusMaster() = default;
  BusMaster(const BusMaster&) = delete;
  BusMaster& operator=(const BusMaster&) = delete;

  // They do not change.
  virtual Offers offers() = 0;

  // --- Bytes and time

  virtual void port_opened(std::int64_t now_us) = 0;
  virtual void port_lost(std::int64_t now_us, const std::string& cause) = 0;
  virtual void receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) = 0;
  // Does what is due. The returned bytes are to be sent now; they stay valid until the next call.
  virtual std::span<const std::uint8_t> step(std::int64_t now_us) = 0;
  // step() has nothing to do before this time, unless bytes arrive or a call below is made.
  virtual std::int64_t next_wake_us() const = 0;
  // What is received before this time decides nothing: bytes may be left unread until then.
  virtual std::int64_t listen_from_us() const { return INT64_MIN; }
  // Events since the last call.
  virtual std::vector<Event> take_events() = 0;

  // --- What is known

  virtual const McuView& view(McuIndex mcu) const = 0;
  virtual bool time_known() const = 0;
  virtual Tick tick_at(std::int64_t now_us) const = 0;
  virtual const McuHealth& health(McuIndex mcu) const = 0;
  virtual const BusHealth& bus_health() const = 0;
  // Requests made by calls below are not yet answered, or not yet seen in a report.
  virtual bool busy(McuIndex mcu) const = 0;

  // --- Motion that the tick source plans

  // Earliest tick at which a move of this motor can start.
  virtual Tick earliest_start(std::int64_t now_us, McuIndex mcu, std::uint8_t motor) const = 0;
  // The same for motors that begin together. Where one frame is enough to begin all of them, that
  // frame comes just in time, and if it is late or lost, none of them begins, and StartMissed says
  // so. Where several are needed, there is time to ask whether they have come (confirm_start).
  virtual CommonStart earliest_common_start(std::int64_t now_us,
                                            std::span<const ToBegin> together) const {
    Tick earliest = 0;
    for (const ToBegin& begin : together) {
      for (std::uint8_t m = 0; begin.motors >> m != 0; ++m) {
        if ((begin.motors >> m & 1) == 0) continue;
        earliest = std::max(earliest, earliest_start(now_us, begin.mcu, m));
      }
    }
    return {.at = earliest};
  }
  // What begins at this tick begins together: if it is not known in time that all MCUs have what
  // they need for it, StartUnconfirmed says so while none has begun. To be called before begin().
  virtual void confirm_start(Tick /*at*/) {}
  // With these; 0: a bus on which nothing is streamed.
  virtual LineLoad line_load(std::span<const ToBegin> /*more*/) const { return {}; }
  // A motion has missed its start: what begins at once next gets more time.
  virtual void start_missed() {}
  // The start that the motor has missed was told in time, as far as is known, and that was lost.
  virtual bool start_was_lost(McuIndex /*mcu*/, std::uint8_t /*motor*/) const { return false; }
  // Time that a start by earliest_common_start leaves this program, beyond what the line and its
  // adapter take; 0: this bus has no such starts.
  virtual std::int64_t start_margin_us(std::int64_t /*now_us*/) const { return 0; }
  // Earliest tick from which replacements can take effect that are asked for together, one for each
  // MCU, in the order of MCUs: a stop of many motors takes the line longer than that of one.
  virtual Tick earliest_replace(std::int64_t now_us, std::span<const ToReplace> together) const = 0;
  // The same for another target of a motor whose run begins at tick `start`: as long as it has not
  // begun, it can begin otherwise only there.
  virtual Tick earliest_retarget(std::int64_t now_us, std::span<const ToReplace> together,
                                 Tick start) const = 0;
  // From `start` on, until dropped, the source has ticks for this motor. Preconditions: the MCU is
  // online, the motor has a table, start >= earliest_start, or earliest_common_start.
  virtual void begin(McuIndex mcu, std::uint8_t motor, Tick start) = 0;
  // The source's answer for these motors has changed from `first` on.
  virtual void replace(McuIndex mcu, std::uint16_t motors, Tick first) = 0;
  // Nothing more is sent for this motor.
  virtual void drop(McuIndex mcu, std::uint8_t motor) = 0;
  // Every motor of every MCU stops as soon as can be, and nothing more is sent for any. Said again
  // until all MCUs that are online have latched BUSHD_FAULT_EMERGENCY. It binds all of them
  // (McuView::bound_by_stop): one that comes later has it latched before it is set up. So does one
  // that an MCU tells of. Only CLEAR_FAULTS that the MCU has carried out frees it.
  virtual void emergency_stop(bushd_stop_mode mode) = 0;
  // Binds an MCU that is not online to a stop that is not cleared.
  virtual void bind_to_stop(McuIndex mcu, bushd_stop_mode mode) = 0;

  // --- What is asked of an MCU, and answered in later reports

  // Other tables or motors for an MCU, at rest: it goes through configuration again and comes back
  // with McuOnline.
  virtual void reconfigure(McuIndex mcu, McuSetup setup) = 0;
  // The MCU has room for these tables, as far as it is known; or why not.
  virtual Result<void> check_room(McuIndex, const McuSetup&) const { return {}; }
  virtual void control(McuIndex mcu, std::uint8_t actions) = 0;
  virtual void set_position(McuIndex mcu, std::uint8_t motor, std::int32_t position_steps) = 0;

  // Whether its identity tells of this capability.
  bool can(McuIndex mcu, std::uint32_t capability) const {
    return (view(mcu).identity.capabilities & capability) != 0;
  }
};

}  // namespace bushd::link
