find_package(Python3 REQUIRED COMPONENTS Interpreter)

# The very images that are flashed, by the toolchains of the presets. With the presets all builds, and the presets `avr`
# and `cortex-m`, share one folder for the images of a toolchain, so that they are built once.
set(BUSHD_IMAGES_DIR ${CMAKE_BINARY_DIR}/images CACHE PATH "Where the builds of the images for MCUs are, a folder each")

# Where toolchain and simulator are there, <TARGET> is made and <PREFIX>_IMAGES says where its images are:
# ${..._IMAGES} and the ends of their names, such as -500000.elf; what follows are those that others need.
function(bushd_images target prefix toolchain port)
  set(build ${BUSHD_IMAGES_DIR}/${toolchain})
  set(images ${build}/firmware/ports/${port}/bushd-${port})
  set(files ${ARGN})
  list(TRANSFORM files PREPEND ${images})
  add_custom_target(${target}
    COMMAND ${CMAKE_COMMAND} -S ${PROJECT_SOURCE_DIR} -B ${build} -G Ninja --log-level=WARNING
      -DCMAKE_TOOLCHAIN_FILE=${PROJECT_SOURCE_DIR}/cmake/${toolchain}.cmake -DCMAKE_BUILD_TYPE=Release
      -DBUSHD_FIRMWARE_ONLY=ON -DBUSHD_WERROR=${BUSHD_WERROR}
    COMMAND ${CMAKE_COMMAND} --build ${build}
    BYPRODUCTS ${files}
    VERBATIM)
  bushd_check(${target}_is_reproducible LABEL slow STAGE nightly NEEDS ${target}
    COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tests/ports/reproducible_test.py ${PROJECT_SOURCE_DIR}
      ${toolchain} ${build}/firmware/ports/${port})
  set(${prefix}_IMAGES ${images} PARENT_SCOPE)
endfunction()

if(TARGET bushd_sim_avr AND AVR_GCC)
  bushd_images(avr_image AVR avr atmega2560 -500000.elf -1000000.elf -switch-500000.elf)
  bushd_images(atmega1284p_image ATMEGA1284P atmega1284p atmega1284p -500000.elf -1000000.elf)
  bushd_images(keypad_image KEYPAD keypad keypad .elf -switch.elf)
  bushd_images(commutator_image COMMUTATOR commutator commutator -9600.elf -57600.elf -500000.elf
    -converter-9600.elf -converter-57600.elf -converter-500000.elf)
  set(AVR_DEFINITIONS AVR_IMAGES="${AVR_IMAGES}"
    AVR_MEMORY_OWNERS="${PROJECT_SOURCE_DIR}/firmware/ports/atmega2560/memory_owners"
    ATMEGA1284P_IMAGES="${ATMEGA1284P_IMAGES}"
    KEYPAD_IMAGE="${KEYPAD_IMAGES}.elf"
    KEYPAD_SWITCH_IMAGE="${KEYPAD_IMAGES}-switch.elf"
    COMMUTATOR_IMAGES="${COMMUTATOR_IMAGES}"
    ATMEGA1284P_MEMORY_OWNERS="${PROJECT_SOURCE_DIR}/firmware/ports/atmega1284p/memory_owners")
  bushd_check(avr_stack_is_bounded LABEL slow NEEDS avr_image COMMAND ${Python3_EXECUTABLE}
    ${PROJECT_SOURCE_DIR}/tests/ports/stack_bound_test.py atmega2560 avr-objdump ${AVR_IMAGES}-500000.elf)
  bushd_check(atmega1284p_stack_is_bounded LABEL slow NEEDS atmega1284p_image COMMAND ${Python3_EXECUTABLE}
    ${PROJECT_SOURCE_DIR}/tests/ports/stack_bound_test.py atmega1284p avr-objdump ${ATMEGA1284P_IMAGES}-500000.elf)
  bushd_check(keypad_stack_is_bounded LABEL slow NEEDS keypad_image COMMAND ${Python3_EXECUTABLE}
    ${PROJECT_SOURCE_DIR}/tests/ports/stack_bound_test.py atmega328p avr-objdump ${KEYPAD_IMAGES}.elf ${KEYPAD_IMAGES}-switch.elf)
  bushd_check(commutator_stack_is_bounded LABEL slow NEEDS commutator_image COMMAND ${Python3_EXECUTABLE}
    ${PROJECT_SOURCE_DIR}/tests/ports/stack_bound_test.py atmega328p avr-objdump ${COMMUTATOR_IMAGES}-500000.elf ${COMMUTATOR_IMAGES}-converter-500000.elf)
else()
  message(STATUS "The image for ATmega2560 is not tested: it needs gcc-avr, libsimavr-dev and libdw-dev (tools/setup)")
endif()

if(ARM_GCC AND QEMU_SYSTEM_ARM)
  bushd_images(cortex_m_image LM3S cortex-m lm3s6965 -500000.elf -1000000.elf)
  bushd_check(cortex_m_stack_is_bounded LABEL slow NEEDS cortex_m_image COMMAND ${Python3_EXECUTABLE}
    ${PROJECT_SOURCE_DIR}/tests/ports/cortex_m_stack_bound_test.py arm-none-eabi-objdump ${LM3S_IMAGES}-500000.elf)
else()
  message(STATUS "The image for LM3S6965 is not tested: it needs gcc-arm-none-eabi and qemu-system-arm (tools/setup)")
endif()
