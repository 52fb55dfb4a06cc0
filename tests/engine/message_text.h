// A frame as text: the message's name and its fields, in the notation of tests/vectors/frames.csv.
#pragma once

#include <set>
#include <string>

#include "engine/frame.h"

namespace bushd::test {

// "sync master=7 sync_id=41 ...", or "sync: impossible length" if the payload is refused.
std::string message_text(const bushd_frame& frame);

// Its type is known, and its payload is one of that.
bool is_message(const bushd_frame& frame);

// All names that message_text can give.
std::set<std::string> message_names();

}  // namespace bushd::test
