// From no answer to a configured MCU in step with its tables in place, and back.
//
// An MCU that is looked for is asked once directly and once in reply windows, by turns: two MCUs
// that have the same address talk over each other, but rarely choose the same window.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bus/rs485/bus_setup.h"
#include "bus/rs485/mcu_record.h"
#include "bus/rs485/program_link.h"
#include "bus/rs485/request_queue.h"
#include "bus/rs485/scratch.h"
#include "bus/rs485/transactions.h"
#include "engine/message.h"

namespace bushd::link {

class Connector {
 public:
  // Who is told that an MCU's phase has changed. Called from within the functions below, after the
  // record has changed.
  class Listener {
   public:
    virtual ~Listener() = default;
    // It has answered and fits: it is being set up from now on.
    virtual void found(std::int64_t now_us, McuIndex mcu) = 0;
    virtual void came_online(McuIndex mcu) = 0;
    virtual void went_offline(McuIndex mcu, bool was_online) = 0;
    // The MCU, online, refused a request.
    virtual void refused(McuIndex mcu, std::uint8_t type, std::uint8_t status) = 0;
    // Its ProgramView is new.
    virtual void program_reported(McuIndex mcu) = 0;
  };

  // All of them outlive it.
  Connector(const BusSetup& setup, PerMcu<McuRecord>& mcus, Transactions& transactions,
            FrameWriter& writer, Listener& listener);

  void port_opened(std::int64_t now_us);
  // The MCU is offline, and looked for again from `retry_due_us` on.
  void give_up(McuIndex mcu, const std::string& cause, std::int64_t retry_due_us);
  void give_up_unanswering(std::int64_t now_us, McuIndex mcu);
  // Other tables or motors. Returns false if the MCU is offline: they will be found then.
  bool reconfigure(McuIndex mcu, McuSetup setup);
  // The MCU has room for these tables, as far as it is known; or why not.
  Result<void> check_room(McuIndex mcu, const McuSetup& setup) const;
  // It binds all MCUs, or this one, until they have carried out CLEAR_FAULTS.
  void emergency_stop(bushd_stop_mode mode);
  void bind_to_stop(McuIndex mcu, bushd_stop_mode mode);
  // The setup enables no drivers from now on.
  void enable_no_more() { enables_ = false; }
  // These motors are not people's to move by LOCAL, whatever the setup says.
  void inhibit_local(McuIndex mcu, std::uint16_t motors);

  // Requests beside the setup.
  RequestQueue& queue(McuIndex mcu) { return links_[mcu].queue; }
  const RequestQueue& queue(McuIndex mcu) const { return links_[mcu].queue; }
  void control(McuIndex mcu, std::uint8_t actions);
  // Its requests are sent when there are no others.
  Scratch& scratch(McuIndex mcu) { return links_[mcu].scratch; }
  const Scratch& scratch(McuIndex mcu) const { return links_[mcu].scratch; }
  // Its orders are sent after the requests of the queue, its parts as those of `scratch`.
  ProgramLink& program(McuIndex mcu) { return links_[mcu].program; }
  const ProgramLink& program(McuIndex mcu) const { return links_[mcu].program; }

  bool send_due_identify(std::int64_t now_us);
  // One that is bound by an emergency stop has it latched, and table runs of an earlier master are
  // ramped down, before the setup.
  bool send_stop(std::int64_t now_us);
  // An order that takes motion away from a program.
  bool send_program_stop(std::int64_t now_us);
  // MCUs that connect are asked for their reports together, when all requests to them have been
  // answered. (A routine poll asks them meanwhile.)
  void ask_for_reports();
  // By turns: one that does not answer its request keeps nobody else waiting.
  bool send_request(std::int64_t now_us);
  // When the next MCU is to be looked for. Precondition: it is offline.
  std::int64_t retry_due_us(McuIndex mcu) const;

  // Answers.
  void identity(const bushd_identity& identity) { identities_.push_back(identity); }
  void identify_ended(std::int64_t now_us, McuIndex mcu);
  void not_found(std::int64_t now_us, McuIndex mcu);
  // `may_clear`: no emergency stop is under way.
  void tables(McuIndex mcu, const bushd_tables& held, bool may_clear);
  void acknowledged(std::int64_t now_us, McuIndex mcu, std::uint8_t type, std::uint8_t status);
  void program_told(std::int64_t now_us, McuIndex mcu, const bushd_program_state& state);
  void program_acknowledged(McuIndex mcu, std::uint8_t type, std::uint8_t status);
  // Programs that are to begin within `margin` and that their MCUs have not taken do not begin.
  void end_late_runs(Tick now, Tick margin);
  // The record of an MCU has a new report: whether a stop binds it.
  void follow_stop(McuIndex mcu);
  // Then, of one that connects. `in_step`: with bus time.
  void follow_report(std::int64_t now_us, McuIndex mcu, bool in_step);
  // An MCU that is online was found with a program under way, which has ended: reconfigure() is to
  // tell it all of its setup.
  bool has_more_to_tell(McuIndex mcu) const;
  // It connects, and its program has, or may have, gone on alone: its ticks need not be the bus's.
  bool may_have_own_time(McuIndex mcu) const;
  // A program that ends in silence is under way: it is to hear of the time as lines are.
  bool runs_with_host() const;
  // The MCU has disabled its drivers, and people are to find out why.
  void drivers_off(McuIndex mcu) { links_[mcu].powered = false; }

 private:
  struct Link {
    RequestQueue queue;
    Scratch scratch;  // of an MCU that is online
    ProgramLink program;
    // It was found with a program under way: it is told only what it then takes, and all of its
    // setup when that has ended.
    bool adopts = false;
    // While connecting: its program has another configuration, and has not ended.
    bool left_alone = false;
    bool setup_written = false;  // while connecting: into the queue
    bool report_wanted = false;  // while connecting: ask_for_reports
    bool was_online = false;     // while it gets another setup: nobody was told otherwise
    // EN as wanted; empty until the first report tells how the MCU was found. Drivers that somebody
    // switched off stay off through restarts and lost links: there may be hands in the mechanism.
    std::optional<bool> powered;
    // While connecting: it is to be stopped now; and has been, for no other reason than that table
    // runs of an earlier master went on.
    bool stop_now = false;
    bool taken_over = false;
    bushd_stop_mode stop_mode = BUSHD_STOP_RAMP;  // of the stop that binds it
    bool clearing = false;                        // people have asked it to clear its faults
    std::uint16_t not_local = 0;                  // as wanted
    std::uint16_t not_local_told = 0;             // as told in the setup
    std::int64_t retry_due_us = 0;
    unsigned identify_attempts = 0;  // in a row without an MCU that fits
  };

  // The request that is to be sent next; null if there is none.
  const Request* next_request(std::int64_t now_us, McuIndex mcu);
  const Request* next_part(McuIndex mcu);
  template <class Next>
  bool send_first(std::int64_t now_us, std::size_t& turn, Next next);
  void take(std::int64_t now_us, McuIndex mcu, const bushd_identity& identity);
  void write_configuration(McuIndex mcu);
  void write_setup(McuIndex mcu);
  void go_online(McuIndex mcu);
  bool holds_its_tables(McuIndex mcu, const bushd_tables& held) const;
  std::uint8_t first_actions(McuIndex mcu, bool may_clear) const;
  void add_control(McuIndex mcu, std::uint8_t actions);
  void note_power(McuIndex mcu);
  void tell_local(McuIndex mcu);
  // A request of it has been answered: whether nothing else is to be asked before its report.
  void want_report(McuIndex mcu, bool wanted);

  // connector_program.cpp
  void ask_for_program(McuIndex mcu);
  bool knows_program(McuIndex mcu) const;
  // Its program has motors.
  bool runs_program(McuIndex mcu) const;
  // While connecting. False: it runs none.
  bool goes_on_with_program(McuIndex mcu);
  void follow_program(McuIndex mcu, bool in_step);
  void write_adoption(McuIndex mcu);
  void adopt_tables(McuIndex mcu, const bushd_tables& held, bool may_clear);
  void leave_alone(McuIndex mcu);

  const BusSetup& setup_;
  PerMcu<McuRecord>& mcus_;
  Transactions& transactions_;
  FrameWriter& writer_;
  Listener& listener_;
  PerMcu<Link> links_;
  bool enables_ = true;
  std::uint16_t salt_ = 0;
  std::vector<bushd_identity> identities_;  // that the last IDENTIFY was answered with
  std::size_t turn_ = 0;                    // whose request is sent next
  std::size_t identify_turn_ = 0;           // who is looked for next
  std::int64_t unanswered_due_us_ = 0;      // not before, if it has not answered
  std::size_t part_turn_ = 0;     // whose part of a table or program, if nothing else is asked
  std::size_t program_turn_ = 0;  // whose program is stopped next
};

}  // namespace bushd::link
