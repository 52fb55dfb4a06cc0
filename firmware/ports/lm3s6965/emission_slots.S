@ The interrupt of timer 0, every half slot: by turns it begins the pulses of a slot and ends them. All that it works by
@ comes in one load (emission_slots.h); the CPU has saved r0 to r3 and r12. What is odd clears the interrupt.

#include "firmware/ports/lm3s6965/emission_slots.h"

    .syntax unified
    .thumb
    .text

    .global emission_half_slot
    .thumb_func
emission_half_slot:
    ldr     r3, =emission_slot
    ldmia   r3, {r0, r1, r2, r12}       @ cursor, timer, step_low, step_high
    tst     r0, #1
    bne     1f
    adds    r0, #1
    str     r0, [r1]
    str     r0, [r3]
    ldrh    r0, [r0, #-1]
    ldr     r3, [r3, #SLOT_REST]
    eors    r3, r0
    uxtb    r0, r3
    str     r0, [r2]
    lsrs    r3, #8
    str     r3, [r12]
    bx      lr
1:
    str     r0, [r1]
    adds    r0, #1
    str     r0, [r3]
    ldr     r1, [r3, #SLOT_END]
    ldr     r3, [r3, #SLOT_REST]
    str     r3, [r2]
    lsrs    r3, #8
    str     r3, [r12]
    cmp     r0, r1
    beq     2f
    bx      lr
2:
    b       emission_take_next
    .size emission_half_slot, . - emission_half_slot
