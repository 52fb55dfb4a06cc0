# ATmega328P of the keypad node, by the same compiler as the ATmega2560.
set(BUSHD_AVR_CHIP atmega328p)
include(${CMAKE_CURRENT_LIST_DIR}/avr.cmake)
