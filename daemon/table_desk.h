// What other programs may ask about tables, and change in them, without moving a motor.
#pragma once

#include "base/result.h"
#include "bushd/table_reply_t.hpp"
#include "bushd/table_request_t.hpp"
#include "daemon/table_library.h"
#include "tables/table.h"

namespace bushd::daemon {

// The table that a SET request brings, checked by itself.
Result<tables::TablePtr> table_of(const table_request_t& request);

// As long as the disk takes. A request that was carried out already is answered as done.
table_reply_t answer(const TableLibrary& library, const table_request_t& request);

table_reply_t refusal(const table_request_t& request, const std::string& reason);

}  // namespace bushd::daemon
