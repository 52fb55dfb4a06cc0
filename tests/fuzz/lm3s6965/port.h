// The LM3S6965's nvm.c on the host, the walk through what its flash keeps. The flash lies where
// the chip has it.
#ifndef BUSHD_FUZZ_LM3S6965_PORT_H
#define BUSHD_FUZZ_LM3S6965_PORT_H

#include "firmware/core/nvm.h"

#ifdef __cplusplus
extern "C" {
#endif

#include "firmware/ports/lm3s6965/nvm.h"

// A reset: all but the flash is as after power-on.
void host_reset(void);
void host_blank_flash(void);
// Size and CRC of what is kept, as its head says. Precondition: it is whole, and was found.
uint32_t host_nvm_size(void);
uint32_t host_nvm_crc(void);
// Where nvm_poll stands.
bushd_mcu_nvm_scan host_walk(void);

#ifdef __cplusplus
}
#endif
#endif
