# ATmega2560 with Debian's gcc-avr (5.4) and avr-libc; another chip of this kind has a file of its own beside this one.
if(NOT BUSHD_AVR_CHIP)
  set(BUSHD_AVR_CHIP atmega2560)
endif()
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR avr)
set(CMAKE_C_COMPILER avr-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
# Line numbers, for whoever finds a program counter; of paths they hold nothing that depends on where it was built.
get_filename_component(source_dir ${CMAKE_CURRENT_LIST_DIR}/.. ABSOLUTE)
# A path may have spaces; this compiler would note it with the flags.
set(debug_flags "-gdwarf-2 -gno-record-gcc-switches \"-fdebug-prefix-map=${source_dir}=.\" \"-fdebug-prefix-map=${CMAKE_BINARY_DIR}=.\"")
# A switch made into a table would have it in RAM.
set(CMAKE_C_FLAGS_INIT "-mmcu=${BUSHD_AVR_CHIP} -ffunction-sections -fdata-sections -fno-tree-switch-conversion ${debug_flags}")
# Labels within functions would be symbols, which disassemblers take for functions.
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,--discard-locals")
set(CMAKE_ASM_FLAGS_INIT "-mmcu=${BUSHD_AVR_CHIP} ${debug_flags}")
