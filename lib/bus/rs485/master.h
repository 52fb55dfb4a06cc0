// The master of an RS-485 bus (bus_master.h says what each function does). What motors shall do it
// asks from a TickSource.
//
// It is composed of machines that share the records of the MCUs (mcu_record.h), and decides which
// of them has the line next:
//
//   Transactions      a request and its answers; nothing else is sent meanwhile
//   Connector         finds and configures MCUs, and what else is asked of one of them
//   Synchroniser      keeps them in step, and knows bus time
//   StreamScheduler   keeps their tick queues filled, and repairs what was lost
//   Poller            asks for reports
//   EmergencyStop     says so until every MCU has heard it
//
// Not thread-safe; all times are microseconds of one monotonic clock.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bus/rs485/bus_master.h"
#include "bus/rs485/bus_setup.h"
#include "bus/rs485/connector.h"
#include "bus/rs485/emergency_stop.h"
#include "bus/rs485/event.h"
#include "bus/rs485/frame_writer.h"
#include "bus/rs485/health.h"
#include "bus/rs485/horizon.h"
#include "bus/rs485/mcu_index.h"
#include "bus/rs485/mcu_record.h"
#include "bus/rs485/poller.h"
#include "bus/rs485/rehearsal.h"
#include "bus/rs485/start_margin.h"
#include "bus/rs485/stream_scheduler.h"
#include "bus/rs485/synchroniser.h"
#include "bus/rs485/table_run.h"
#include "bus/rs485/tick_source.h"
#include "bus/rs485/transactions.h"
#include "engine/message.h"

namespace bushd::link {

class Rs485Master final : public BusMaster,
                          public SharedLine,
                          public Homing,
                          public TableRuns,
                          public LineRuns,
                          public Uploads,
                          public Trigger,
                          public Travel,
                          public LocalInputs,
                          public Requests,
                          public Programs,
                          private Transactions::Listener,
                          private Connector::Listener {
 public:
  // `source` outlives it.
  Rs485Master(BusSetup setup, TickSource& source);

  Offers offers() override {
    return {.streams = true,
            .shared_line = this,
            .homing = this,
            .table_runs = this,
            .line_runs = this,
            .uploads = this,
            .trigger = this,
            .travel = this,
            .local_inputs = this,
            .requests = this,
            .programs = this};
  }

  void port_opened(std::int64_t now_us) override;
  void port_lost(std::int64_t now_us, const std::string& cause) override;
  void receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) override;
  std::span<const std::uint8_t> step(std::int64_t now_us) override;
  std::int64_t next_wake_us() const override { return due_us_ == INT64_MIN ? wake_us() : due_us_; }
  std::int64_t listen_from_us() const override {
    return transactions_.open() ? listen_from_us_ : INT64_MIN;
  }
  std::vector<Event> take_events() override;

  const McuView& view(McuIndex mcu) const override { return mcus_[mcu].view; }
  bool time_known() const override { return clock().valid(); }
  Tick tick_at(std::int64_t now_us) const override { return clock().tick_at(now_us); }
  const McuHealth& health(McuIndex mcu) const override { return mcus_[mcu].health; }
  const BusHealth& bus_health() const override { return transactions_.health(); }
  void reset_low_water() override;
  bool busy(McuIndex mcu) const override {
    return !connector_.queue(mcu).empty() || connector_.program(mcu).has_orders() ||
           connector_.program(mcu).wants_state() || mcus_[mcu].poll_wanted || mcus_[mcu].answered;
  }
  bool heard() const override { return heard_; }
  // By this master or by an MCU.
  bool two_masters(std::int64_t now_us) const override { return synchroniser_.two_masters(now_us); }

  // All first frames of the move still arrive well before.
  Tick earliest_start(std::int64_t now_us, McuIndex mcu, std::uint8_t motor) const override;
  CommonStart earliest_common_start(std::int64_t now_us,
                                    std::span<const ToBegin> together) const override;
  void confirm_start(Tick at) override { streams().confirm_start(at); }
  LineLoad line_load(std::span<const ToBegin> more) const override;
  void start_missed() override {
    look_again();
    start_margin_.missed(stepped_us_);
  }
  bool start_was_lost(McuIndex mcu, std::uint8_t motor) const override {
    return streams_.start_was_lost(mcu, motor);
  }
  std::int64_t start_margin_us(std::int64_t now_us) const override {
    return start_margin_.margin_us(now_us);
  }
  Tick earliest_replace(std::int64_t now_us, std::span<const ToReplace> together) const override;
  Tick earliest_retarget(std::int64_t now_us, std::span<const ToReplace> together,
                         Tick start) const override;
  // No replacement of this MCU is on its way, and no queue of the bus is about to run empty. Each
  // replacement takes back ticks that have been sent, so too many of them would leave no time for
  // ticks.
  bool has_time_to_retarget(std::int64_t now_us, McuIndex mcu) const override;
  void begin(McuIndex mcu, std::uint8_t motor, Tick start) override;
  void replace(McuIndex mcu, std::uint16_t motors, Tick first) override;
  void drop(McuIndex mcu, std::uint8_t motor) override { streams().drop(mcu, motor); }
  // Within two ticks of hearing it.
  void emergency_stop(bushd_stop_mode mode) override;
  void bind_to_stop(McuIndex mcu, bushd_stop_mode mode) override;
  void enable_no_more() override { connector().enable_no_more(); }

  void reconfigure(McuIndex mcu, McuSetup setup) override;
  Result<void> check_room(McuIndex mcu, const McuSetup& setup) const override;
  // Sent as soon as the line allows.
  void control(McuIndex mcu, std::uint8_t actions) override { connector().control(mcu, actions); }
  void set_position(McuIndex mcu, std::uint8_t motor, std::int32_t position_steps) override {
    ask(mcu, bushd_set_position{motor, position_steps});
  }

  using Requests::ask;
  void home(McuIndex mcu, const bushd_home& message) override { ask(mcu, message); }
  void begin_table_run(McuIndex mcu, std::uint8_t motor, Tick start, TableRun run) override;
  bool can_run_line(McuIndex mcu, const bushd_table& table, bushd_delay shortest_delay,
                    bool alone) const override;
  bool makes_lines(McuIndex mcu) const override {
    return setup_.table_ticks && can(mcu, BUSHD_CAN_LINE_RUN);
  }
  bool keeps_up_with(McuIndex mcu, const bushd_table& table, bushd_delay shortest_delay,
                     bool alone) const override;
  void begin_line_run(McuIndex mcu, std::uint8_t motor, Tick start, const LineRun& run) override;
  std::optional<std::uint8_t> bank_of(McuIndex mcu, const bushd_table& table) const override;
  bool can_upload(McuIndex mcu, const bushd_table& table) const override;
  void upload(McuIndex mcu, const bushd_table& table) override {
    connector().scratch(mcu).upload(table);
  }
  bool uploads(McuIndex mcu) const override { return connector_.scratch(mcu).under_way(); }
  void end_upload(McuIndex mcu) override;
  std::uint8_t arm(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                   std::span<const Armed> moves) override;
  std::uint8_t arm_line(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                        std::span<const ArmedOnLine> parts) override;
  void disarm(McuIndex mcu) override { ask(mcu, disarming()); }
  void follow_run(McuIndex mcu, std::uint8_t motor, Tick start, const McuRun& run) override;
  std::uint8_t travel(McuIndex mcu, bushd_travel message) override;
  void end_travel(McuIndex mcu, std::uint8_t motor) override;
  void inhibit_local(McuIndex mcu, std::uint16_t motors) override {
    connector().inhibit_local(mcu, motors);
  }
  BusSnapshot snapshot(std::int64_t now_us) const override;

  const ProgramView& program(McuIndex mcu) const override { return connector_.program(mcu).view(); }
  void put_program(McuIndex mcu, std::vector<std::uint8_t> bytes) override {
    connector().program(mcu).put(std::move(bytes));
  }
  void erase_program(McuIndex mcu) override { connector().program(mcu).erase(); }
  Tick earliest_program_start(std::int64_t now_us, std::span<const McuIndex> mcus) const override;
  void run_program(McuIndex mcu, std::uint8_t number, Tick start) override {
    connector().program(mcu).run(number, start);
  }
  void stop_program(McuIndex mcu, bushd_stop_mode mode) override;
  void pause_program(McuIndex mcu) override { connector().program(mcu).pause(); }
  void resume_program(McuIndex mcu) override { connector().program(mcu).resume(); }

 private:
  void ask(McuIndex mcu, Request request) override {
    connector().queue(mcu).ask(std::move(request));
  }
  bool answered(std::int64_t now_us, const Transactions::Answer& answer) override;
  bool unanswered(std::int64_t now_us, McuIndex mcu, std::uint8_t type) override;
  void ended(std::int64_t now_us, McuIndex mcu, std::uint8_t type) override;
  void overheard(std::int64_t now_us, const bushd_frame& frame) override;

  void found(std::int64_t now_us, McuIndex mcu) override;
  void came_online(McuIndex mcu) override;
  void went_offline(McuIndex mcu, bool was_online) override;
  void refused(McuIndex mcu, std::uint8_t type, std::uint8_t status) override;
  void program_reported(McuIndex mcu) override;

  // Something has come by which step() may have more to do.
  void look_again() { due_us_ = INT64_MIN; }
  // What is done with these may give step() more to do.
  Connector& connector() {
    look_again();
    return connector_;
  }
  StreamScheduler& streams() {
    look_again();
    return streams_;
  }
  std::int64_t wake_us() const;
  void notice_standing_still(std::int64_t now_us);
  void handle_report(std::int64_t now_us, const Transactions::Answer& answer,
                     const bushd_report& report);
  void ask_at_end(std::int64_t now_us, McuIndex mcu);
  void note_begun(McuIndex mcu);
  bool send_next(std::int64_t now_us);
  std::int64_t silence_us() const;
  bool in_one_frame(std::span<const ToBegin> together) const;
  std::int64_t line_free_us(std::int64_t now_us) const;
  std::int64_t withdrawal_margin_us() const;
  void withdraw_late_starts(std::int64_t now_us);
  void ask_again_for_start(std::int64_t now_us, McuIndex mcu);
  std::int64_t withdrawal_due_us() const;
  std::int64_t wake_us(McuIndex mcu) const;
  std::int64_t answered_by_us() const;
  std::int64_t decided_from_us() const;
  bool awaits_news(McuIndex mcu, std::int64_t until_us) const;
  const BusClock& clock() const { return synchroniser_.clock(); }

  const BusSetup setup_;
  PerMcu<McuRecord> mcus_;
  std::vector<Event> events_;
  bool port_open_ = false;
  bool heard_ = false;
  std::int64_t stepped_us_ = 0;
  std::int64_t due_us_ = INT64_MIN;  // step() has nothing to do before
  FrameWriter writer_;
  Transactions transactions_;
  Connector connector_;
  Synchroniser synchroniser_;
  StreamScheduler streams_;
  Poller poller_;
  EmergencyStop emergency_;
  Horizon horizon_;
  StartMargin start_margin_;
  StartMargin repair_time_;  // for frames that begin motors together: none on a good line
  bool begun_ = false;       // something, since the last step
  std::int64_t listen_from_us_ = INT64_MIN;  // of the transaction under way
};

}  // namespace bushd::link
