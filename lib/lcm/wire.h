// Messages as bytes. Payloads come from anybody on the network, and the decoders that lcm-gen makes
// trust them: a string length of INT32_MIN makes them copy 2 GiB from behind the buffer, an array
// length of 2^31-1 makes them allocate for as many elements, a negative one throws. So every
// payload is first walked through without copying anything; only one whose every length fits the
// bytes that are there is decoded.
//
// T is one of the types that travel by themselves (lcm/types.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "lcm/types.h"

namespace bushd::lcm {

// One message, one datagram: a fragmented message is lost as soon as one fragment is. LCM fragments
// above 65499 bytes.
inline constexpr std::size_t kMaxMessageBytes = 60 * 1024;

// The bytes to publish. Fails when the message is longer than kMaxMessageBytes, when a count is
// not the length of the arrays it counts, or when a text contains a NUL (LCM's strings end
// there).
template <class T>
Result<std::vector<std::uint8_t>> encode(const T& message);

// Nothing for a payload that is not exactly one message of type T: other fingerprint, truncated,
// bytes left over, a length beyond the end, a text without its NUL at the end or with one before.
// Memory needed is a small multiple of the payload. Throws nothing but std::bad_alloc.
template <class T>
std::optional<T> decode(std::span<const std::uint8_t> payload);

}  // namespace bushd::lcm
