#pragma once

#include "motion/report_words.h"

namespace bushd::daemon {

using motion::fault_text;
using motion::forbidden_word;
using motion::forbids;
using motion::reset_cause_word;
using motion::stop_cause;
using motion::system_inputs_words;

}  // namespace bushd::daemon
