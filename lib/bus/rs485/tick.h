// Time on a bus, as its master counts it.
#pragma once

#include <cstdint>

namespace bushd::link {

using Tick = std::int64_t;  // absolute, unwrapped from the 32 bits on the bus

}  // namespace bushd::link
