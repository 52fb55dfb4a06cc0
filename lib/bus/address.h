// Who is meant on the line.
#pragma once

#include "base/ids.h"

namespace bushd::fieldbus {

using bushd::McuAddress;

}  // namespace bushd::fieldbus
