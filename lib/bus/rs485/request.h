// A request to one MCU, and how long its answer is; most are messages that it only acknowledges.
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

  std::size_t reply_size() const {
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

// request_of(bushd_home{...}): of each message that is acknowledged and has no list. Those with
// lists have encoders with other parameters; being a template, this one is compiled only where it
// is called.
#define BUSHD_REQUEST_OF(type, number, kind, needs)                                         \
  template <class Message>                                                                  \
    requires std::same_as<Message, bushd_##kind>                                            \
  Request request_of(const Message& message) {                                              \
    return request_of(BUSHD_MSG_##type,                                                     \
                      [&](std::uint8_t* to) { return bushd_encode_##kind(&message, to); }); \
  }
BUSHD_SETUP_REQUESTS(BUSHD_REQUEST_OF)
BUSHD_MOTION_REQUESTS(BUSHD_REQUEST_OF)
BUSHD_PROGRAM_REQUESTS(BUSHD_REQUEST_OF)
#undef BUSHD_REQUEST_OF

// Requests that nobody but the asker keeps account of. The setup and programs have owners, and what
// waits for the trigger, or travels, has a number that the master gives.
template <class Message>
concept Unnumbered =
    std::same_as<Message, bushd_set_position> || std::same_as<Message, bushd_home> ||
    std::same_as<Message, bushd_position_compare>;

// Cancels all runs that wait for the trigger.
inline Request disarming() {
  return request_of(BUSHD_MSG_TRIGGER, [](std::uint8_t* to) {
    return bushd_encode_trigger(0, BUSHD_EDGE_NONE, 0, nullptr, 0, to);
  });
}

// "CONFIGURE"; "": no such message.
inline const char* type_name(std::uint8_t type) {
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
