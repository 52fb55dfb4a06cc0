// What anybody may send as a message: it is refused, or it is exactly what the encoder makes of
// what was decoded.
//
// Input: a type, then a payload behind that type's fingerprint; with any other type byte the
// payload has to bring its own.
#include <algorithm>
#include <vector>

#include "fuzz/fuzz.h"
#include "lcm/wire.h"

namespace bushd::fuzz {
namespace {

template <class T>
void check(std::span<const std::uint8_t> payload) {
  const auto message = lcm::decode<T>(payload);
  if (!message) return;
  const auto again = lcm::encode(*message);
  BUSHD_REQUIRE(again.has_value());
  BUSHD_REQUIRE(std::ranges::equal(*again, payload));
}

template <class T>
void check_behind_fingerprint(std::span<const std::uint8_t> fields) {
  std::vector<std::uint8_t> payload;
  payload.reserve(8 + fields.size());
  const auto fingerprint = static_cast<std::uint64_t>(T::getHash());
  for (int shift = 56; shift >= 0; shift -= 8) {
    payload.push_back(static_cast<std::uint8_t>(fingerprint >> shift));
  }
  payload.insert(payload.end(), fields.begin(), fields.end());
  check<T>(payload);
}

void run(Input input) {
  const std::uint8_t type = input.u8();
  const auto rest = input.bytes(SIZE_MAX);
  switch (type) {
    case 0:
      return check_behind_fingerprint<command_t>(rest);
    case 1:
      return check_behind_fingerprint<reply_t>(rest);
    case 2:
      return check_behind_fingerprint<state_t>(rest);
    case 3:
      return check_behind_fingerprint<health_t>(rest);
    default:
      check<command_t>(rest);
      check<health_t>(rest);
      check<reply_t>(rest);
      check<state_t>(rest);
  }
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({data, size});
  return 0;
}
