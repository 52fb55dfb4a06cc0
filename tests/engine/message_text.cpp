#include "engine/message_text.h"

#include <cstdint>

#include "engine/message_kinds.h"

namespace bushd::test {
namespace {

struct Row {
  uint8_t type;
  const char* name;
};
#define BUSHD_ROW(type, number, kind, needs) {number, #kind},
constexpr Row kRows[] = {
    BUSHD_MESSAGES(BUSHD_ROW)  //
    {BUSHD_TYPE_REPLY | BUSHD_MSG_PROGRAM_STATE, "program_state"},
    {BUSHD_TYPE_REPLY | BUSHD_MSG_TABLES, "tables"},
    {BUSHD_TYPE_REPLY | BUSHD_MSG_IDENTIFY, "identity"},
    {BUSHD_TYPE_REPLY | BUSHD_MSG_POLL, "report"},
};

// Null: there is no such message.
const char* name_of(const bushd_frame& frame) {
  for (const Row& row : kRows) {
    if (row.type == frame.type) return row.name;
  }
  return (frame.type & BUSHD_TYPE_REPLY) != 0 ? "acknowledgement" : nullptr;
}

Decoded decoded(const bushd_frame& frame, const char* name) {
  if (frame.type == BUSHD_MSG_TABLES || frame.type == BUSHD_MSG_PROGRAM_STATE) {
    Decoded without_payload;
    if (frame.payload_size != 0) without_payload.status = BUSHD_E_LENGTH;
    return without_payload;
  }
  return message_kinds().at(name).decode({frame.payload, frame.payload_size});
}

}  // namespace

std::string message_text(const bushd_frame& frame) {
  const char* const name = name_of(frame);
  if (name == nullptr) return "unknown message";
  const Decoded message = decoded(frame, name);
  if (message.status != BUSHD_OK) {
    return std::string(name) + ": " + bushd_status_text(message.status);
  }
  return name + message.text;
}

bool is_message(const bushd_frame& frame) {
  const char* const name = name_of(frame);
  if (name == nullptr) return false;
  const Decoded message = decoded(frame, name);
  return message.status == BUSHD_OK && message.out_of_range.empty();
}

std::set<std::string> message_names() {
  std::set<std::string> names{"acknowledgement"};
  for (const Row& row : kRows) names.insert(row.name);
  return names;
}

}  // namespace bushd::test
