// What the tests know of each message: valid payloads, its codec, its fields as text, and their
// ranges. (Which byte is which field is pinned by the golden frames of tests/vectors.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/message.h"
#include "engine/properties.h"

namespace bushd::test {

using Bytes = std::vector<uint8_t>;
constexpr int64_t kLastMotor = BUSHD_MOTORS_PER_MCU - 1;

// The fields of a decoded message: as text, in the notation of tests/vectors/frames.csv, and
// whether they are in the ranges of engine/message.h.
class Fields {
 public:
  Fields(std::span<const uint8_t> payload, bool with_text)
      : payload_(payload), with_text_(with_text) {}

  template <class T>
  Fields& add(const char* name, T value) {
    return with_text_ ? add_text(name, std::to_string(static_cast<int64_t>(value))) : *this;
  }
  template <class T>
  Fields& add(const char* name, T value, int64_t least, int64_t most) {
    add(name, value);
    return promise(static_cast<int64_t>(value) >= least && static_cast<int64_t>(value) <= most,
                   name);
  }
  // `count` numbers of `width` bytes (1, 2).
  Fields& add_list(const char* name, const uint8_t* data, size_t count, size_t width);
  // The message has them where they are in the payload.
  Fields& add_part(const char* name, const uint8_t* data, size_t count, size_t width) {
    promise_inside(data, count * width, name);
    return in_range() ? add_list(name, data, count, width) : *this;
  }
  Fields& add_text(const char* name, const std::string& value);
  // `what`: the field, or what is said of several.
  Fields& promise(bool kept, const char* what) {
    if (!kept && out_of_range_.empty()) out_of_range_ = what;
    return *this;
  }
  Fields& promise_inside(const uint8_t* data, size_t size, const char* what) {
    return promise(data >= payload_.data() && data + size <= payload_.data() + payload_.size(),
                   what);
  }

  const std::string& text() const { return text_; }
  bool in_range() const { return out_of_range_.empty(); }
  const std::string& out_of_range() const { return out_of_range_; }  // the first one; "": none

 private:
  std::span<const uint8_t> payload_;
  bool with_text_;  // fuzzers have no time for it
  std::string text_;
  std::string out_of_range_;
};

// The numbers of one element of a list, and such a list.
std::string parts(std::initializer_list<int64_t> values);
void append(std::string* list, const std::string& element);

// What is made of a payload.
struct Decoded {
  bushd_status status = BUSHD_OK;
  // If it is taken:
  std::string text;          // " motor=3 ...": its fields, if they are wanted
  std::string out_of_range;  // the first field that is not as promised; "": none
  Bytes reencoded;           // by the encoder; empty if a field is out of range
};

struct Kind {
  std::function<Bytes()> valid;  // a payload
  std::function<Decoded(std::span<const uint8_t>, bool with_text)> codec;
  struct Bad {
    std::string what;
    std::function<void(Bytes*)> spoil;
  };
  std::vector<Bad> out_of_range;
  // Its entries go on to the end of the frame, so what is cut between two is a message too.
  bool open_ended = false;

  Decoded decode(std::span<const uint8_t> payload, bool with_text = true) const {
    return codec(payload, with_text);
  }
};

// By the name of the payload (bushd_<name>).
using Kinds = std::map<std::string, Kind>;
const Kinds& message_kinds();
Kinds setup_kinds();
Kinds motion_kinds();
Kinds run_kinds();
Kinds stream_kinds();
Kinds report_kinds();
Kinds program_kinds();

bushd_run_state any_run_state();
std::vector<uint8_t> some_motors();

// `encode` writes the message to a payload of the largest size, and returns its own; `tell` tells
// its fields. Decoding begins with `before`: else with bytes of which none may be left in a message
// that is taken.
template <class Message, class Encode>
auto codec(bushd_status (*decode)(const uint8_t*, size_t, Message*), Encode encode,
           void (*tell)(const Message&, Fields&), const Message* before = nullptr) {
  return [=](std::span<const uint8_t> payload, bool with_text) {
    Message message;
    std::memset(static_cast<void*>(&message), 0xA5, sizeof message);
    if (before != nullptr) message = *before;
    Decoded decoded;
    decoded.status = decode(payload.data(), payload.size(), &message);
    if (decoded.status != BUSHD_OK) return decoded;
    Fields fields(payload, with_text);
    tell(message, fields);
    decoded.text = fields.text();
    decoded.out_of_range = fields.out_of_range();
    if (!fields.in_range()) return decoded;
    decoded.reencoded.resize(BUSHD_FRAME_MAX_PAYLOAD);
    decoded.reencoded.resize(encode(&message, decoded.reencoded.data()));
    return decoded;
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
// With this entry alone behind a header of that size.
inline std::function<void(Bytes*)> entry_alone(size_t header, Bytes entry) {
  return [header, entry = std::move(entry)](Bytes* p) {
    p->resize(header);
    p->insert(p->end(), entry.begin(), entry.end());
  };
}
inline auto cut_to(size_t size) {
  return [=](Bytes* payload) { payload->resize(size); };
}

// The entries of a decoded message.
template <class Entry>
std::vector<Entry> entries_of(const uint8_t* at, uint8_t count, Entry (*next)(const uint8_t**)) {
  std::vector<Entry> entries;
  for (uint8_t i = 0; i < count; ++i) entries.push_back(next(&at));
  return entries;
}

}  // namespace bushd::test
