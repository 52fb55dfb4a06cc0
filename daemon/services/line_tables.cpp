#include "daemon/services/line_tables.h"

#include <algorithm>
#include <variant>

#include "base/overloaded.h"

namespace bushd::daemon {

bool LineTables::concerns(const api::Request& request) {
  return std::holds_alternative<api::MoveLine>(request) ||
         std::holds_alternative<api::ArmLine>(request);
}

bool LineTables::make_ready(std::int64_t now_us, const api::Request& request, Wait& wait) {
  if (!wait.looked) begin(now_us, request, wait);
  if (wait.table && !is_over(now_us, wait)) return false;
  end(wait);
  return true;
}

void LineTables::begin(std::int64_t now_us, const api::Request& request, Wait& wait) {
  using Wanted = std::optional<Lines::WantedTable>;
  wait.looked = true;
  auto wanted =
      std::visit(Overloaded{[&](const api::MoveLine& r) { return lines_.table_to_upload(r); },
                            [&](const api::ArmLine& r) { return lines_.table_to_upload(r); },
                            [](const auto&) -> Wanted { return std::nullopt; }},
                 request);
  if (!wanted) return;
  // An MCU has one such table: what one line waits for, or goes by, no other one replaces.
  const auto waits = [this](McuId id) { return std::ranges::find(waiting_, id) != waiting_.end(); };
  if (std::ranges::any_of(wanted->all, waits)) return;
  waiting_.insert(waiting_.end(), wanted->all.begin(), wanted->all.end());
  for (const McuId id : wanted->mcus) {
    const Mcu& mcu = installation_[id];
    mcu.offers.uploads->upload(mcu.on_bus(), wanted->table->view());
  }
  wait.deadline_us = now_us + wanted->most_us;
  wait.table = std::move(wanted);
}

bool LineTables::is_over(std::int64_t now_us, const Wait& wait) const {
  const auto has_it = [&](McuId id) {
    return installation_[id].has_table(wait.table->table->view());
  };
  const std::vector<McuId>& mcus = wait.table->mcus;
  if (now_us > wait.deadline_us || std::ranges::all_of(mcus, has_it)) return true;
  return !std::ranges::all_of(mcus, [&](McuId id) {
    const Mcu& mcu = installation_[id];
    return installation_.rests(mcu) && (has_it(id) || mcu.uploads());
  });
}

void LineTables::end(Wait& wait) {
  if (!wait.table) return;
  for (const McuId id : wait.table->mcus) {
    const Mcu& mcu = installation_[id];
    mcu.offers.uploads->end_upload(mcu.on_bus());
  }
  std::erase_if(waiting_, [&](McuId id) {
    return std::ranges::find(wait.table->all, id) != wait.table->all.end();
  });
  wait.table.reset();
}

}  // namespace bushd::daemon
