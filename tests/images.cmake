# The very images that are flashed, by the toolchains of the presets, each in a build of its own below the one that
# tests them. Where toolchain and simulator are there, <TARGET> is made and <PREFIX>_IMAGES says where its images are:
# ${..._IMAGES}-<baud rate>.elf
function(bushd_images target prefix toolchain port)
  string(REPLACE _ - build ${CMAKE_BINARY_DIR}/${target})
  set(images ${build}/firmware/ports/${port}/bushd-${port})
  add_custom_target(${target}
    COMMAND ${CMAKE_COMMAND} -S ${PROJECT_SOURCE_DIR} -B ${build} -G Ninja --log-level=WARNING
      -DCMAKE_TOOLCHAIN_FILE=${PROJECT_SOURCE_DIR}/cmake/${toolchain}.cmake -DCMAKE_BUILD_TYPE=Release
      -DBUSHD_FIRMWARE_ONLY=ON -DBUSHD_WERROR=${BUSHD_WERROR}
    COMMAND ${CMAKE_COMMAND} --build ${build}
    BYPRODUCTS ${images}-500000.elf ${images}-1000000.elf
    VERBATIM)
  set(${prefix}_IMAGES ${images} PARENT_SCOPE)
endfunction()

if(TARGET bushd_sim_avr AND AVR_GCC)
  bushd_images(avr_image AVR avr atmega2560)
else()
  message(STATUS "The image for ATmega2560 is not tested: it needs gcc-avr and libsimavr-dev (tools/setup)")
endif()
