# ATmega328P of the keypad node, by the same compiler as the ATmega2560.
set(BUSHD_AVR_CHIP atmega328p)
set(BUSHD_AVR_NODE keypad)
include(${CMAKE_CURRENT_LIST_DIR}/avr.cmake)
