// Tables, as clients are told of them.
#pragma once

#include "api/reply.h"
#include "tables/table.h"

namespace bushd::daemon {

static_assert(api::TableRef::kHashLength == tables::kShortHashLength);

inline api::TableRef ref_to(const tables::Table& table) {
  return {.name = table.name(), .revision = table.revision(), .hash = table.short_hash()};
}

}  // namespace bushd::daemon
