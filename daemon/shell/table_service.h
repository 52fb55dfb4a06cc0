// What other programs may ask about tables, and change in them, without moving a motor.
#pragma once

#include <string>

#include "api/reply.h"
#include "api/request.h"
#include "base/result.h"
#include "daemon/shell/table_library.h"
#include "tables/table.h"

namespace bushd::daemon {

// Carries out ListTables, GetTable or SetTable; as long as the disk takes. What was set already is
// answered as done. `by`: for the table's history.
api::Reply answer(const TableLibrary& library, const api::Request& request, const std::string& by);

}  // namespace bushd::daemon
