# ATmega328P of the commutator board, by the same compiler as the ATmega2560.
set(BUSHD_AVR_CHIP atmega328p)
set(BUSHD_AVR_NODE commutator)
include(${CMAKE_CURRENT_LIST_DIR}/avr.cmake)
