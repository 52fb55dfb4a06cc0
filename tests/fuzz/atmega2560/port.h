// The ATmega2560's C files that deal with borrowed memory, on the host: line.c, the reply at the
// end of the receiver's buffer; and nvm.c, the walk through what the EEPROM keeps. What surrounds
// them (interrupts in assembler, timer 3, the EEPROM) is made up here.
#ifndef BUSHD_FUZZ_ATMEGA2560_PORT_H
#define BUSHD_FUZZ_ATMEGA2560_PORT_H

#include "firmware/core/nvm.h"

#ifdef __cplusplus
extern "C" {
#endif

#include "firmware/ports/atmega2560/line.h"
#include "firmware/ports/atmega2560/nvm.h"

// A reset: all but the EEPROM is as after power-on.
void host_reset(void);
void host_blank_eeprom(void);
// Size and CRC of what is kept, as its head says. Precondition: it is whole.
uint16_t host_nvm_size(void);
uint32_t host_nvm_crc(void);
// Where nvm_poll stands.
bushd_mcu_nvm_scan host_walk(void);

// A byte comes; it is lost while an answer is sent, and if the ring is full.
void host_receive(uint8_t byte);
// An answer waits, or is being sent.
bool host_has_reply(void);
bool host_sends(void);
// The line's time goes on: timer 3 comes if it is waited for; or a byte of the answer, whose buffer
// begins at `reply`, is sent to `wire`. True when that was its last.
bool host_send(const uint8_t* reply, uint8_t* wire, size_t* size);

// A byte is being written to the EEPROM.
bool host_writes(void);
void host_end_write(void);

#ifdef __cplusplus
}
#endif
#endif
