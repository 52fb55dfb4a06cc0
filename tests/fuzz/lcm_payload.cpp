// What anybody may send as a message: it is refused, or what the encoder makes of it means the
// same.
//
// Input: a type, then a payload behind that type's fingerprint; with any other type byte the
// payload has to bring its own.
#include <tuple>
#include <vector>

#include "fuzz/fuzz.h"
#include "lcm/all_messages.h"
#include "lcm/wire.h"

namespace bushd::fuzz {
namespace {

template <class T>
void check(std::span<const std::uint8_t> payload) {
  const auto message = lcm::decode<T>(payload);
  if (!message) return;
  const auto again = lcm::encode("FUZZ", *message);
  BUSHD_REQUIRE(again.has_value());
  const auto heard = lcm::decode<T>(*again);
  BUSHD_REQUIRE(heard.has_value());
  BUSHD_REQUIRE(*lcm::encode("FUZZ", *heard) == *again);
}

template <class T>
void check_behind_fingerprint(std::span<const std::uint8_t> fields) {
  std::vector<std::uint8_t> payload;
  payload.reserve(8 + fields.size());
  for (int shift = 56; shift >= 0; shift -= 8) {
    payload.push_back(static_cast<std::uint8_t>(lcm::fingerprint<T>() >> shift));
  }
  payload.insert(payload.end(), fields.begin(), fields.end());
  check<T>(payload);
}

template <class... Pair>
void check_one_of(Input input, const std::tuple<Pair...>* /*all*/) {
  const std::size_t type = input.u8();
  const auto rest = input.bytes(SIZE_MAX);
  if (type >= sizeof...(Pair)) return (check<typename Pair::Message>(rest), ...);
  std::size_t i = 0;
  ((i++ == type ? check_behind_fingerprint<typename Pair::Message>(rest) : void()), ...);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::check_one_of({data, size}, static_cast<bushd::test::AllMessages*>(nullptr));
  return 0;
}
