#include "lcm/wire.h"

#include <fmt/format.h>

namespace bushd::lcm {

Result<std::vector<std::uint8_t>> checked(std::string_view channel, std::vector<std::uint8_t> bytes,
                                          bool good) {
  if (bytes.size() > kMaxMessageBytes) {
    return fail(
        fmt::format("{} of {} bytes does not fit one datagram ({} bytes); name fewer motors, or "
                    "use a table of fewer codes",
                    channel, bytes.size(), kMaxMessageBytes));
  }
  if (!good) {
    return fail(fmt::format("{}: one of its texts contains a NUL character; remove it", channel));
  }
  return bytes;
}

}  // namespace bushd::lcm
