// What the vectors call. All are of one priority: none interrupts another.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_INTERRUPTS_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_INTERRUPTS_H

typedef void (*vector)(void);
// In RAM: those in force.
extern vector vectors[];
#define EXTERNAL(irq) (16u + (irq))

void input_edge(void);            // port A
void line_received(void);         // UART 0
void emission_half_slot(void);    // timer 0
void emission_tick_begins(void);  // timer 1
void line_due(void);              // timer 2
void compare_due(void);           // timer 3

#endif
