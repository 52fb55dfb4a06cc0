// Which table a line waits for, and which MCUs get it (LineTables sees to that).
#include <algorithm>

#include "bus/rs485/mcu_fit.h"
#include "daemon/services/lines.h"

namespace bushd::daemon {
namespace {

// A line that can be streamed at once waits no longer than people notice.
constexpr std::int64_t kMostUs = 500'000;
constexpr std::int64_t kPerPartUs = 2'000;       // adapter and MCU, until the next one can be sent
constexpr std::int64_t kBitsPerPart = 10 * 270;  // with its answer

}  // namespace

std::int64_t upload_us(const bushd_table& table, std::int64_t baud) {
  const auto codes = static_cast<std::int64_t>(link::codes_of(table));
  const std::int64_t parts = 3 + codes / BUSHD_TABLE_DATA_MAX_CODES;
  return parts * (kPerPartUs + kBitsPerPart * 1'000'000 / baud);
}

std::optional<Lines::WantedTable> Lines::table_to_upload(const api::MoveLine& request) const {
  if (request.dry_run) return std::nullopt;
  return table_to_upload(request, false);
}

std::optional<Lines::WantedTable> Lines::table_to_upload(const api::ArmLine& request) const {
  return table_to_upload(as_move(request), true);
}

std::optional<Lines::WantedTable> Lines::table_to_upload(const api::MoveLine& request,
                                                         bool armed) const {
  const auto motors = installation_.find(request.motors);
  if (!motors || !may_get_tables(*motors, armed)) return std::nullopt;
  const auto line = line_of(request);
  return line ? table_to_upload(*line, armed) : std::nullopt;
}

// Cheaper than to find out by which table.
bool Lines::may_get_tables(const std::vector<MotorId>& motors, bool armed) const {
  return std::ranges::none_of(motors,
                              [this](MotorId motor) { return installation_[motor].has_plan(); }) &&
         std::ranges::all_of(installation_.mcus_of(motors), [&](McuId id) {
           const Mcu& mcu = installation_[id];
           return (armed ? mcu.can_arm_lines() : mcu.makes_lines()) && !makes_another(mcu, 0);
         });
}

std::optional<Lines::WantedTable> Lines::table_to_upload(const Line& line, bool armed) const {
  // A motor that goes by a table in place of its own is streamed: no upload, which MCUs take at
  // rest only.
  const Straight* straight = line.straight();
  if (straight == nullptr || straight->by || line.longest() == 0 ||
      !may_get_tables(line.motors, armed)) {
    return std::nullopt;
  }
  WantedTable wanted{.table = straight->way.table(),
                     .mcus = {},
                     .all = installation_.mcus_of(line.motors),
                     .upload_us = 0,
                     .most_us = armed ? kMostArmedUs : kMostUs};
  const bushd_table& table = wanted.table->view();
  for (const McuId id : wanted.all) {
    const Mcu& mcu = installation_[id];
    if (!mcu.keeps_up_with(table, straight->way.shortest_delay(), has_all_of(line, mcu)))
      return std::nullopt;
    if (mcu.has_table(table)) continue;
    if (!mcu.can_upload(table) || mcu.uploads() || !installation_.rests(mcu)) return std::nullopt;
    wanted.mcus.push_back(id);
    wanted.upload_us += upload_us(table, installation_.bus_of(mcu).config.baud);
  }
  if (wanted.mcus.empty() || wanted.upload_us > wanted.most_us) return std::nullopt;
  return wanted;
}

}  // namespace bushd::daemon
