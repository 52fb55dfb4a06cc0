#include "bus/rs485/request_queue.h"

#include <algorithm>
#include <vector>

namespace bushd::link {

bool RequestQueue::done(std::uint8_t type) {
  if (requests_.empty() || requests_.front().type != type) return false;
  requests_.pop_front();
  return true;
}

bool RequestQueue::may_be_setup(std::uint8_t type) {
  switch (type) {
    case BUSHD_MSG_TABLES:
      BUSHD_SETUP_REQUESTS(BUSHD_CASE)
      return true;
    default:
      return false;
  }
}

void RequestQueue::discard_setup() {
  std::erase_if(requests_, [](const Request& request) {
    return may_be_setup(request.type) && request.type != BUSHD_MSG_CONTROL;
  });
}

void RequestQueue::upload_table(std::uint8_t bank, const TableRef& ref) {
  const bushd_table& table = *ref.table;
  const bool symmetric = table.decel.code == table.accel.code;
  std::vector<std::uint16_t> codes(table.accel.code, table.accel.code + table.accel.count);
  if (!symmetric) {
    codes.insert(codes.end(), table.decel.code, table.decel.code + table.decel.count);
  }
  const bushd_table_begin begin = {
      .bank = bank,
      .accel_count = static_cast<std::uint16_t>(table.accel.count),
      .decel_count = static_cast<std::uint16_t>(symmetric ? 0 : table.decel.count),
      .cruise = table.cruise,
      .time_unit_ns = table.time_unit_ns,
      .revision = ref.revision};
  ask(begin);
  for (std::size_t at = 0; at < codes.size(); at += BUSHD_TABLE_DATA_MAX_CODES) {
    const auto count = static_cast<std::uint8_t>(
        std::min<std::size_t>(codes.size() - at, BUSHD_TABLE_DATA_MAX_CODES));
    ask(request_of(BUSHD_MSG_TABLE_DATA, [&](std::uint8_t* to) {
      return bushd_encode_table_data(bank, static_cast<std::uint16_t>(at), count, &codes[at], to);
    }));
  }
  ask(bushd_table_end{.bank = bank, .crc = bushd_table_crc32(&table)});
}

void RequestQueue::discard_clearing() {
  for (Request& request : requests_) {
    if (request.type != BUSHD_MSG_CONTROL) continue;
    request.payload.resize(1);  // without the faults
    request.payload[0] &= static_cast<std::uint8_t>(~BUSHD_CONTROL_CLEAR_FAULTS);
  }
}

}  // namespace bushd::link
