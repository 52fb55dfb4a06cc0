// A table by which fuzz targets let programs and envelopes run.
#pragma once

#include <utility>

#include "tables/table.h"

namespace bushd::fuzz {

inline const bushd_table& fuzz_table() {
  static const tables::TablePtr kTable = [] {
    tables::TableContent content{.name = "fuzz", .time_unit_ns = 40'000};
    content.accel = {250, 200, 150, 110};
    content.decel = {160, 240};
    content.cruise = 100;
    return tables::make(std::move(content)).value();
  }();
  return kTable->view();
}

}  // namespace bushd::fuzz
