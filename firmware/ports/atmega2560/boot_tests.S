; Before anything is in RAM, and with registers only: why the chip was reset, the watchdog off, what RAM has kept, RAM and
; flash tested.
; What came out is in BOOT_CAUSE and BOOT_FAULTS (boot_tests.h) until interrupts are let in.
;
; RAM: a march test of all of it,
;     up w0; up r0 w1; up r1 w0; down r0 w1; down r1 w0; up r0 w paint
; finds cells that are stuck, do not change, or change with another one. The paint shows later how deep the stack went.
; Flash: the CRC-32 of the image, to the end of its last page, is 0: the bytes at image_seal are chosen so (seal_image.py).

#include <avr/io.h>

#include "firmware/ports/atmega2560/boot_tests.h"

#define ZEROS 0x55
#define ONES 0xAA
#define END hi8(RAMEND + 1)
; Four tables, of a byte of the CRC each, lie in the first four pages of 256 bytes; variables come there later.
#define TABLES hi8(RAMSTART)

    ; X is at the beginning of RAM, and then at its end.
    .macro march_up expected, written
    ldi r19, \written
1:
    ld r18, X
    cpi r18, \expected
    brne ram_is_bad
    st X+, r19
    cpi XH, END
    brne 1b
    ldi XL, lo8(RAMSTART)
    ldi XH, hi8(RAMSTART)
    .endm

    ; X is at the end, and stays there.
    .macro march_down expected, written
    ldi XH, END
    ldi XL, lo8(RAMEND + 1)
    ldi r19, \written
1:
    ld r18, -X
    cpi r18, \expected
    brne ram_is_bad
    st X, r19
    cpi XL, lo8(RAMSTART)
    brne 1b
    cpi XH, hi8(RAMSTART)
    brne 1b
    .endm

    .section .init3, "ax", @progbits

    in r18, _SFR_IO_ADDR(MCUSR)
    out BOOT_CAUSE, r18
    out _SFR_IO_ADDR(MCUSR), r1
    ; After a reset by the watchdog it goes on, at its shortest period.
    wdr
    ldi r18, 1 << WDCE | 1 << WDE
    sts WDTCSR, r18
    sts WDTCSR, r1
    out BOOT_FAULTS, r1

    lds r18, enable_kept
    lds r19, enable_kept + 1
    cpi r18, lo8(BOOT_ENABLE_HIGH)
    brne 1f
    cpi r19, hi8(BOOT_ENABLE_HIGH)
    brne 2f
    sbi BOOT_FAULTS, BOOT_ENABLE_HIGH_BIT
2:
    cpi r19, hi8(BOOT_ENABLE_LOW)
    brne 1f
    sbi BOOT_FAULTS, BOOT_ENABLE_LOW_BIT
1:
    ldi XL, lo8(RAMSTART)
    ldi XH, hi8(RAMSTART)
    ldi r19, ZEROS
1:
    st X+, r19
    cpi XH, END
    brne 1b
    ldi XH, hi8(RAMSTART)
    march_up ZEROS, ONES
    march_up ONES, ZEROS
    march_down ZEROS, ONES
    march_down ONES, ZEROS
    march_up ZEROS, BOOT_PAINT
    rjmp test_flash
ram_is_bad:
    ldi r18, BOOT_RAM_BAD
    out BOOT_FAULTS, r18

test_flash:
    ; r20 .. r23: CRC of one byte, least significant first.
    ldi r24, lo8(0xEDB88320)
    ldi r25, hi8(0xEDB88320)
    ldi r26, hlo8(0xEDB88320)
    ldi r27, hhi8(0xEDB88320)
    clr r30
2:
    mov r20, r30
    clr r21
    clr r22
    clr r23
    ldi r18, 8
3:
    lsr r23
    ror r22
    ror r21
    ror r20
    brcc 4f
    eor r20, r24
    eor r21, r25
    eor r22, r26
    eor r23, r27
4:
    dec r18
    brne 3b
    ldi r31, TABLES
    st Z, r20
    inc r31
    st Z, r21
    inc r31
    st Z, r22
    inc r31
    st Z, r23
    inc r30
    brne 2b

    ser r20
    ser r21
    ser r22
    ser r23
    clr r30
    clr r31
    out _SFR_IO_ADDR(RAMPZ), r1
    ldi r18, hi8(__data_load_end + 255)
    ldi r19, hh8(__data_load_end + 255)
5:
    elpm XL, Z+
    eor XL, r20
    ldi XH, TABLES
    ld r20, X
    eor r20, r21
    inc XH
    ld r21, X
    eor r21, r22
    inc XH
    ld r22, X
    eor r22, r23
    inc XH
    ld r23, X
    cp r30, r1
    brne 5b
    in r24, _SFR_IO_ADDR(RAMPZ)
    cp r31, r18
    cpc r24, r19
    brne 5b
    or r20, r21
    or r20, r22
    or r20, r23
    breq 6f
    sbi BOOT_FAULTS, BOOT_FLASH_BAD_BIT
6:
    out _SFR_IO_ADDR(RAMPZ), r1
    rjmp 7f
    .global image_seal
image_seal:
    .long 0
7:
