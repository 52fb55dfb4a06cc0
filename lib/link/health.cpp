#include "link/health.h"

#include <algorithm>

namespace bushd::link {

void Latency::add(std::int64_t us) {
  const auto bound = std::find_if(kBoundsUs.begin(), kBoundsUs.end(),
                                  [us](std::int64_t limit) { return us < limit; });
  ++count[static_cast<std::size_t>(bound - kBoundsUs.begin())];
  // Fades to a half within some 20 answers: a second.
  recent_us = std::max(us, recent_us - recent_us / 32);
}

}  // namespace bushd::link
