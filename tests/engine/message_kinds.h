// A message seen from outside, for the tests of all of them.
#ifndef BUSHD_TESTS_ENGINE_MESSAGE_KINDS_H
#define BUSHD_TESTS_ENGINE_MESSAGE_KINDS_H

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/message.h"
#include "engine/properties.h"

namespace bushd::test {

using Bytes = std::vector<uint8_t>;

// A message seen from outside: how its payload looks, and what the engine makes of one. (Which byte
// is which field is pinned by the golden frames of tests/vectors.)
struct Kind {
  std::function<Bytes()> any;  // a valid payload
  std::function<bushd_status(const Bytes&, Bytes*)> decode_encode;
  struct Bad {
    std::string what;
    std::function<void(Bytes*)> spoil;
  };
  std::vector<Bad> out_of_range;
  // Its entries go on to the end of the frame, so what is cut between two is a message too.
  bool open_ended = false;
};

using Kinds = std::map<std::string, Kind>;
Kinds setup_kinds();
Kinds motion_kinds();
Kinds program_kinds();

bushd_run_state any_run_state();

// `encode` writes the message to a payload of the largest size, and returns its own.
template <class Message, class Encode>
auto codec(bushd_status (*decode)(const uint8_t*, size_t, Message*), Encode encode,
           Message message = {}) {
  return [=](const Bytes& payload, Bytes* again) {
    Message decoded = message;
    const bushd_status status = decode(payload.data(), payload.size(), &decoded);
    if (status == BUSHD_OK) {
      again->resize(BUSHD_FRAME_MAX_PAYLOAD);
      again->resize(encode(&decoded, again->data()));
    }
    return status;
  };
}

inline Bytes random_bytes(size_t size) {
  return *rc::gen::container<Bytes>(size, rc::gen::arbitrary<uint8_t>());
}

// Random bytes with the ranged fields put into their range.
inline std::function<Bytes()> bytes_with(size_t size, std::function<void(Bytes*)> put) {
  return [=] {
    Bytes payload = random_bytes(size);
    put(&payload);
    return payload;
  };
}

inline auto set8(size_t at, uint8_t value) {
  return [=](Bytes* payload) { (*payload)[at] = value; };
}
inline auto set16(size_t at, uint16_t value) {
  return [=](Bytes* payload) { bushd_put_u16(payload->data() + at, value); };
}
inline auto set32(size_t at, uint32_t value) {
  return [=](Bytes* payload) { bushd_put_u32(payload->data() + at, value); };
}

}  // namespace bushd::test
#endif
