// What an MCU is asked and answers: for the most part a message that it acknowledges.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/message.h"

namespace bushd::link {

struct Request {
  std::uint8_t type;
  std::vector<std::uint8_t> payload;

  std::size_t reply_payload() const {
    if (type == BUSHD_MSG_PROGRAM_STATE) return BUSHD_PROGRAM_STATE_SIZE;
    return type == BUSHD_MSG_TABLES ? BUSHD_TABLES_SIZE : 1;
  }
};

// `encode` writes the payload, and returns its size.
template <class Encode>
Request request_of(std::uint8_t type, Encode encode) {
  Request request{.type = type, .payload = std::vector<std::uint8_t>(BUSHD_FRAME_MAX_PAYLOAD)};
  request.payload.resize(encode(request.payload.data()));
  return request;
}

// Of each message that is acknowledged and has no list: request_of(bushd_home{...}).
#define BUSHD_REQUEST_OF(type, number, kind, needs)                                         \
  template <class Message>                                                                  \
    requires std::same_as<Message, bushd_##kind>                                            \
  Request request_of(const Message& message) {                                              \
    return request_of(BUSHD_MSG_##type,                                                     \
                      [&](std::uint8_t* to) { return bushd_encode_##kind(&message, to); }); \
  }
BUSHD_ACKNOWLEDGED(BUSHD_REQUEST_OF)
BUSHD_ACKNOWLEDGED_OF_PROGRAMS(BUSHD_REQUEST_OF)
#undef BUSHD_REQUEST_OF

// No run waits for the trigger any more.
inline Request disarming() {
  return request_of(BUSHD_MSG_TRIGGER, [](std::uint8_t* to) {
    return bushd_encode_trigger(0, BUSHD_EDGE_NONE, 0, nullptr, 0, to);
  });
}

// "CONFIGURE"; "": no such message.
inline const char* name_of_request(std::uint8_t type) {
  switch (type) {
#define BUSHD_NAME_OF(type, number, kind, needs) \
  case BUSHD_MSG_##type:                         \
    return #type;
    BUSHD_MESSAGES(BUSHD_NAME_OF)
#undef BUSHD_NAME_OF
    default:
      return "";
  }
}

}  // namespace bushd::link
