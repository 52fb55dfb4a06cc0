// Positions that outlive the daemon and the power: what is kept of them, what they are worth when
// an MCU is connected, and whether a motor may begin to move without looking at rest afterwards.
//
// Without a store nothing is kept, and nothing is held back.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>

#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/journal.h"
#include "daemon/services/positions.h"
#include "state/keeper.h"
#include "state/rules.h"

namespace bushd::daemon {

class KeptPositions final : public Service {
 public:
  static constexpr std::int64_t kAnswerUs = 3'000'000;  // for the disk, until it is said to fail

  KeptPositions(Installation& installation, const Positions& positions, Journal& journal,
                Outputs& outputs);

  // Once, before anything else. `kept`: of the store as it was opened; the backend is where it is,
  // and outlives this. Not required: motors move also if the disk does not take their marks.
  void use(const std::map<std::string, state::Kept>& kept, state::Backend& backend, bool required);
  bool keeps() const { return keeper_.has_value(); }
  // Told once the store is in use.
  void set_listener(std::function<void()> in_use) { in_use_ = std::move(in_use); }
  // Answers of the backend.
  void marked(std::int64_t now_us, const Result<void>& done);
  void written(std::int64_t now_us, const Result<void>& done);

  void request(const api::Asker& asker, const api::Confirm& request);
  void request(const api::Asker& asker, const api::GetHistory& request);

  // Whether the motor's position may change from now on. If not, it is made so; ask again after the
  // next step. Errors: it does not come to pass. In any case until not_wanted() it stays ready,
  // once it is, and is not kept as a motor at rest.
  Result<bool> make_ready(std::int64_t now_us, MotorId motor);
  void not_wanted(MotorId motor) { motors_[motor].wanted = false; }
  bool being_restored(MotorId motor) const { return motors_[motor].restoring.has_value(); }

  // What was set in operation in place of bushd.toml's keys; empty without a store.
  state::Settings settings(MotorId motor) const;
  void keep(MotorId motor, state::Settings settings);
  // Settings of what is no motor (state::is_no_motor), or is not configured any more.
  state::Settings settings(const std::string& name) const;
  void keep(const std::string& name, const state::Settings& settings);
  // At rest its position has become uncertain, by no motion.
  void keep_uncertain(MotorId motor);
  std::map<std::string, state::Settings> settings_of_others() const { return others_; }
  // How much there was to keep so far, and how much of that is on the disk; why no more is.
  std::uint64_t told() const { return keeper_ ? keeper_->told() : 0; }
  std::uint64_t kept_up_to() const { return keeper_ ? keeper_->kept_up_to() : 0; }
  std::optional<std::string> trouble() const { return keeper_ ? keeper_->trouble() : std::nullopt; }
  // Tells that it is done when the disk has all that it is about, as far as this has been told by
  // the end of the next step. If the disk does not take it in time, that is said.
  void answer_when_kept(const api::Asker& asker, api::Completed done);
  // For the history. Says who asked, and where from; how people see both is added where it is not
  // told.
  void past(state::PastMove move);

  // All that there is to keep is on the disk, as far as the disk takes it.
  bool settled() const;
  // No motor has moved without being marked.
  bool guarded() const { return keeper_ && !keeper_->any_unguarded(); }

  void goes_online(Mcu& mcu) override;
  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void reports(std::int64_t now_us, Mcu& mcu) override;
  void step(std::int64_t now_us) override;
  std::int64_t next_wake_us() const { return keeper_ ? keeper_->next_wake_us() : INT64_MAX; }

 private:
  struct Restoring {
    std::int64_t steps;
    std::string reason;  // of what is restored, for the log
  };
  // Its name at this output, or its steps_per_unit, is another one now. What the disk has stays so
  // until it is moved, set or confirmed, so that the change can be taken back.
  struct Unmoved {
    std::optional<state::Record> record;  // of its own, as it was; none: that of the name before
    std::int64_t steps;
    std::string reason;  // why it is uncertain meanwhile
  };
  struct Motor {
    bool wanted = false;  // a motion is about to begin
    std::optional<Unmoved> unmoved{};
    std::optional<Restoring> restoring{};
    std::int64_t seen_us = 0;  // when its motion was kept last
  };
  // Whose counters positions are.
  struct Heard {
    std::string unique_id{};
    std::uint16_t boot_number = 0;
    bool operator==(const Heard&) const = default;
  };
  void connect(Mcu& mcu, MotorId id, bool first);
  state::Seen seen(const Mcu& mcu, MotorId id) const;
  void note_unmoved(MotorId id, const state::Seen& seen, const state::Verdict& verdict);
  void take(MotorId id, const state::Verdict& verdict);
  void follow_restoring(const Mcu& mcu, MotorId id);
  void keep(std::int64_t now_us, const Mcu& mcu, MotorId id);
  void keep_at_rest(const Mcu& mcu, MotorId id);
  state::Record record_of(const Mcu& mcu, MotorId id) const;
  void ask_for_kept(MotorId id);
  void keep_confirmed(MotorId id);
  void tell_counter(MotorId id);
  void keep_heard(const Mcu& mcu);
  void answer_open(std::int64_t now_us);
  void tell_trouble();
  Result<void> may_be_confirmed(MotorId id) const;

  Installation& installation_;
  const Positions& positions_;
  Journal& journal_;
  Outputs& outputs_;
  std::function<void()> in_use_;
  std::optional<state::Keeper> keeper_;
  state::Backend* backend_ = nullptr;  // with keeper_
  int reading_ = 0;                    // requests for histories
  bool required_ = true;
  ById<MotorId, Motor> motors_;
  std::map<std::string, state::Settings> others_;  // of what is no motor of the configuration
  struct OfMcu {
    std::optional<Heard> heard{};
    bool reported = false;  // since the last step
  };
  ById<McuId, OfMcu> mcus_;
  std::optional<std::string> told_trouble_;
  // Done, and not yet on the disk.
  struct Open {
    api::Asker asker;
    api::Completed done;
    std::optional<std::uint64_t> number{};   // of told()
    std::optional<std::int64_t> until_us{};  // no longer is the disk waited for
  };
  std::list<Open> open_;
};

}  // namespace bushd::daemon
