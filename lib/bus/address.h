// Who is meant on the bus.
#pragma once

#include "base/ids.h"

namespace bushd::fieldbus {

using bushd::McuAddress;

}  // namespace bushd::fieldbus
