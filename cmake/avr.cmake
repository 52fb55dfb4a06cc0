# ATmega2560 with Debian's gcc-avr (5.4) and avr-libc.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR avr)
set(CMAKE_C_COMPILER avr-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_FLAGS_INIT "-mmcu=atmega2560 -ffunction-sections -fdata-sections")
set(CMAKE_ASM_FLAGS_INIT "-mmcu=atmega2560")
