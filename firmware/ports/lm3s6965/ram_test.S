@ From reset to C: all RAM but what outlives a reset is tested, in registers alone, since there is no memory to trust yet.
@
@ March: write 0 upwards; read 0, write 1 upwards; read 1, write 0 downwards; read 0. It finds bits that are stuck or
@ do not change, and words that change with others.

    .syntax unified
    .thumb
    .text

    .global reset
    .thumb_func
reset:
    ldr     r1, =kept_end
    ldr     r2, =stack_end
    movs    r0, #0                      @ what was found wrong
    movs    r4, #0
    mvns    r5, r4
    mov     r3, r1
1:  str     r4, [r3], #4
    cmp     r3, r2
    bne     1b
    mov     r3, r1
2:  ldr     r6, [r3]
    orrs    r0, r6
    str     r5, [r3], #4
    cmp     r3, r2
    bne     2b
3:  ldr     r6, [r3, #-4]!
    mvns    r6, r6
    orrs    r0, r6
    str     r4, [r3]
    cmp     r3, r1
    bne     3b
4:  ldr     r6, [r3], #4
    orrs    r0, r6
    cmp     r3, r2
    bne     4b
    b       start
