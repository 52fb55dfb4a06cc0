// Stands for avr-libc's: an interrupt is a function that is called when it would come.
#ifndef BUSHD_FUZZ_ATMEGA2560_AVR_INTERRUPT_H
#define BUSHD_FUZZ_ATMEGA2560_AVR_INTERRUPT_H

#include "avr/io.h"

#define ISR(vector, ...) \
  void vector(void);     \
  void vector(void)

#endif
