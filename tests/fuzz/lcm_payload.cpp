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

template <class... T>
void check_one_of(Input input) {
  const std::size_t type = input.u8();
  const auto rest = input.bytes(SIZE_MAX);
  if (type >= sizeof...(T)) return (check<T>(rest), ...);
  std::size_t i = 0;
  ((i++ == type ? check_behind_fingerprint<T>(rest) : void()), ...);
}

void run(Input input) {
  // The corpus counts them in this order: a new type is added at the end.
  check_one_of<answer_t, arm_t, emergency_stop_t, get_table_t, health_t, hello_t, mcu_description_t,
               mcu_state_t, move_line_t, move_t, position_compare_t, set_position_t, set_table_t,
               stop_t, subscribe_t, table_answer_t, use_table_t, welcome_t, get_history_t,
               history_answer_t, jog_t, camac_request_t, camac_reply_t, camac_lam_t, move_path_t,
               follow_t, arm_line_t>(input);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({data, size});
  return 0;
}
