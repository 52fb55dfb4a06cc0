// A keypad at the end of a pty: what is typed are its keys, and what it would show is printed.
#pragma once

#include <string>

#include "base/result.h"

namespace bushsim {

// f forward, r reverse, s slower, x stop; other characters are no keys. Says that it is ready, and
// runs until standard input ends or a signal ends it. A terminal that repeats a key that is held
// makes a keypad that does.
bushd::Result<void> run_keypad(const std::string& link);

}  // namespace bushsim
