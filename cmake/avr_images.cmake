# bushd_avr_image(bushd-keypad [SEAL]): of this executable only what is used, an .hex of it for avrdude, and how much of the
# chip is used. SEAL: with its CRC.
function(bushd_avr_image image)
  cmake_parse_arguments(arg SEAL "" "" ${ARGN})
  set_target_properties(${image} PROPERTIES SUFFIX .elf)
  target_link_options(${image} PRIVATE -Wl,--gc-sections -Wl,--relax)
  bushd_target(${image})
  if(arg_SEAL)
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
    set(seal ${PROJECT_SOURCE_DIR}/firmware/ports/seal_image.py)
    set_property(TARGET ${image} APPEND PROPERTY LINK_DEPENDS ${seal})
    add_custom_command(TARGET ${image} POST_BUILD
      COMMAND ${Python3_EXECUTABLE} ${seal} avr-objcopy avr-nm $<TARGET_FILE:${image}>
      VERBATIM)
  endif()
  add_custom_command(TARGET ${image} POST_BUILD
    COMMAND avr-objcopy -O ihex -R .eeprom $<TARGET_FILE:${image}> ${image}.hex
    COMMAND avr-size $<TARGET_FILE:${image}>
    VERBATIM)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${image}.hex DESTINATION share/bushd/firmware COMPONENT firmware)
endfunction()

# bushd_avr_mcu_image(bushd-atmega2560-500000 LIBRARY bushd_atmega2560 BAUD 500000 RAM_END 0x2200 [SOURCES ...]): an image of an MCU,
# with sources beside those of the library. RAM_END: behind the last byte of RAM.
function(bushd_avr_mcu_image image)
  cmake_parse_arguments(arg "" "LIBRARY;BAUD;RAM_END" "SOURCES" ${ARGN})
  add_executable(${image} ${PROJECT_SOURCE_DIR}/firmware/ports/atmega2560/line.c ${arg_SOURCES})
  target_compile_definitions(${image} PRIVATE BUSHD_AVR_BAUD=${arg_BAUD}UL)
  target_link_libraries(${image} PRIVATE ${arg_LIBRARY} bushd::firmware)
  # A ring of 256 bytes at a multiple of 256 costs nothing at the end of RAM; the stack begins below it.
  math(EXPR ring "${arg_RAM_END} - 0x100" OUTPUT_FORMAT HEXADECIMAL)
  math(EXPR line_bytes "0x800000 + ${ring}" OUTPUT_FORMAT HEXADECIMAL)
  math(EXPR stack "${ring} - 1" OUTPUT_FORMAT HEXADECIMAL)
  target_link_options(${image} PRIVATE -Wl,--section-start=.line_bytes=${line_bytes} -Wl,--defsym=__stack=${stack})
  bushd_avr_image(${image} SEAL)
endfunction()
