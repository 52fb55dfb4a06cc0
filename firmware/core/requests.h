// Frames for this MCU, and their answers.
#ifndef BUSHD_FIRMWARE_CORE_REQUESTS_H
#define BUSHD_FIRMWARE_CORE_REQUESTS_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// What was heard of the line.
typedef struct bushd_mcu_reception {
  uint16_t comm_timeout_ticks;  // after as many without a valid frame, table runs are ramped down
  uint16_t silent_ticks;        // since the last valid frame; saturates
  bool frames_heard;
  uint8_t newest_sequence;  // of the master's frames, whomever they were for
  uint32_t newest_uptime;   // when it was heard
  uint16_t bad_frames;
  uint16_t rejected_frames;
  uint8_t last_rejection;
} bushd_mcu_reception;

// An answer that is to be sent. In the reply buffer the CRC's register stands behind it, until it
// is through.
typedef struct bushd_mcu_answer {
  uint8_t size;     // of the frame before its CRC; 0: none
  uint8_t checked;  // by the CRC
  uint32_t delay_ns;
} bushd_mcu_answer;

// bushd_mcu_take_home(mcu, message), and so on: what a message asks for is done, or refused by the
// status. Each is in the source that its message is about (homing.c); those that are about the MCU
// as a whole are in requests.c.
#define BUSHD_MCU_TAKE(type, number, kind, needs) \
  bushd_status bushd_mcu_take_##kind(bushd_mcu* mcu, const bushd_##kind* message);
BUSHD_SETUP_REQUESTS(BUSHD_MCU_TAKE)
BUSHD_MOTION_REQUESTS(BUSHD_MCU_TAKE)
BUSHD_PROGRAM_REQUESTS(BUSHD_MCU_TAKE)
BUSHD_STREAMED(BUSHD_MCU_TAKE)
#undef BUSHD_MCU_TAKE
bushd_status bushd_mcu_take_emergency(bushd_mcu* mcu, const bushd_emergency* message);

void bushd_mcu_handle_frame(bushd_mcu* mcu, const bushd_frame* frame, int32_t time_in_tick_ns);
// Goes on with an answer; false if there is none.
bool bushd_mcu_go_on_answering(bushd_mcu* mcu);

#endif
