#include "bus/rs485/scratch.h"

#include <algorithm>
#include <span>

namespace bushd::link {

void Scratch::upload(const bushd_table& table) {
  clear();
  const std::span accel(table.accel.code, table.accel.count);
  const std::span decel(table.decel.code, table.decel.count);
  const bool symmetric = std::ranges::equal(accel, decel);
  codes_.assign(accel.begin(), accel.end());
  if (!symmetric) codes_.insert(codes_.end(), decel.begin(), decel.end());
  table_ = {};
  table_.cruise = table.cruise;
  table_.time_unit_ns = table.time_unit_ns;
  table_.accel.code = codes_.data();
  table_.accel.count = table.accel.count;
  table_.decel.code = codes_.data() + (symmetric ? 0 : accel.size());
  table_.decel.count = table.decel.count;
  requests_.upload_table(BUSHD_SCRATCH_BANK, {.table = &table_, .revision = 0});
}

void Scratch::clear() {
  there_ = asked_ = false;
  requests_.clear();
}

void Scratch::acknowledged(std::uint8_t type, std::uint8_t status) {
  if (!asked_ || !requests_.done(type)) return;
  asked_ = false;
  if (status != BUSHD_OK) return clear();
  there_ = requests_.empty();
}

}  // namespace bushd::link
