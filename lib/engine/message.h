// The messages of the bus: what the payloads of frames mean. docs/protocol.md is the normative
// text, and tests/vectors/messages.py has the layouts once more, by hand. All numbers are
// little-endian. Every decode checks length and ranges of what it reads, so that a decoded struct
// can be used without further checks; encoders need BUSHD_FRAME_MAX_PAYLOAD bytes.
#ifndef BUSHD_ENGINE_MESSAGE_H
#define BUSHD_ENGINE_MESSAGE_H

#include "engine/frame.h"
#include "engine/message_base.h"
#include "engine/message_line.h"
#include "engine/message_motion.h"
#include "engine/message_program.h"
#include "engine/message_report.h"
#include "engine/message_setup.h"

#endif
