// What may be changed of motors in operation: their offsets, directions, soft limits and greatest
// speeds, what their MCU keeps of velocity loop and currents, and its sequence of phases. Kept in
// the state store, where each counts until its key in bushd.toml is edited.
//
// This daemon reads bushd.toml when it starts and never writes it: clients do, with the rights of
// those who use them, and say so (docs/decisions/0033-settings-in-operation.md).
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "config/setting.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/journal.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/positions.h"

namespace bushd::daemon {

class MotorSettings final : public Service {
 public:
  static constexpr std::int64_t kPatienceUs = 3'000'000;  // with the disk

  // `about_to_move`: a request for this motor has been taken and is not yet carried out.
  MotorSettings(Installation& installation, const Positions& positions, KeptPositions& kept,
                Journal& journal, Outputs& outputs, std::function<bool(MotorId)> about_to_move);

  void request(const api::Asker& asker, const api::Configure& request);

  // The store is in use: what it has counts from now on.
  void take_kept();
  // Where it stands was given another user position.
  void offset_set(MotorId motor, const units::Coordinates& before, const api::Asker& by);

  void step(std::int64_t now_us) override;

 private:
  struct Change {
    MotorId motor;
    config::SettingKey key;
    std::string before;
    std::string after;
  };
  // A request, checked: nothing has been changed yet.
  struct Plan {
    std::vector<MotorId> motors{};             // each once
    std::vector<config::Settings> settings{};  // of these, afterwards
    std::vector<Change> changes{};
  };
  // Changed, and not yet on the disk, or not yet told to all MCUs.
  struct Open {
    api::Asker asker;
    std::uint64_t number;  // of KeptPositions::told
    api::Completed answer;
    std::vector<MotorId> motors{};
    std::optional<std::int64_t> until_us{};  // no longer is the disk waited for
  };
  config::Settings settings_of(MotorId motor) const;
  Result<void> add(Plan& plan, MotorId motor, config::SettingKey key, const std::string& value,
                   const ById<MotorId, config::Settings>* from) const;
  std::vector<MotorId> changed_by(MotorId motor, config::SettingKey key) const;
  Result<Plan> plan_of(const api::Configure& request,
                       const ById<MotorId, config::Settings>* from) const;
  Result<void> may_be_changed(MotorId motor) const;
  Result<void> mcu_takes(const Plan& plan, MotorId motor) const;
  static bool begins_phases_anew(const Plan& plan, MotorId motor);
  std::string other_steps(const Plan& plan, MotorId motor) const;
  void change(const api::Asker& asker, const api::Configure& request);
  void carry_out(const Plan& plan, const api::Asker& asker);
  void saved(const api::Asker& asker, const api::Configure& request);
  void keep(MotorId motor);
  void take_kept(MotorId motor, config::SettingKey key, const state::Setting& kept);
  void put(MotorId motor, const config::Settings& settings);
  bool being_set_up(const Open& open) const;
  std::string text_of(const Plan& plan) const;
  api::Configuration configuration_of(const std::vector<MotorId>& motors) const;

  Installation& installation_;
  const Positions& positions_;
  KeptPositions& kept_;
  Journal& journal_;
  Outputs& outputs_;
  std::function<bool(MotorId)> about_to_move_;
  ById<MotorId, config::Settings> in_file_;
  std::string file_sha256_;
  std::list<Open> open_;
};

}  // namespace bushd::daemon
