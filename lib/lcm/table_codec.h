// A table's content as a message, and back.
#pragma once

#include "bushd/table_t.hpp"
#include "tables/table.h"

namespace bushd::lcm {

tables::TableContent content_of(const table_t& message);
table_t message_of(const tables::TableContent& content);

}  // namespace bushd::lcm
