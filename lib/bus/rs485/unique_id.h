// Unique ids of MCUs as people read them.
#pragma once

#include <string>

#include "engine/message.h"

namespace bushd::link {

// 16 lower case hexadecimal digits.
std::string unique_id_text(const bushd_identity& identity);

}  // namespace bushd::link
