# ATmega1284P, by the same compiler as the ATmega2560.
set(BUSHD_AVR_CHIP atmega1284p)
include(${CMAKE_CURRENT_LIST_DIR}/avr.cmake)
