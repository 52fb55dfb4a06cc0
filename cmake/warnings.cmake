function(bushd_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
    $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes>
    $<$<BOOL:${BUSHD_WERROR}>:-Werror>)
endfunction()

# bushd_warnings_of_the_front_end(engine_test): all but those that follow from what the optimiser finds out, as with a sanitizer it
# finds much that is not so.
function(bushd_warnings_of_the_front_end target)
  bushd_warnings(${target})
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    foreach(warning aggressive-loop-optimizations array-bounds dangling-pointer format-overflow format-truncation free-nonheap-object
        infinite-recursion maybe-uninitialized nonnull restrict return-local-addr stringop-overflow stringop-overread
        stringop-truncation uninitialized use-after-free)
      target_compile_options(${target} PRIVATE -Wno-${warning})
    endforeach()
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-mismatched-new-delete>)
  endif()
endfunction()

# One place for warnings and sanitizers: bushd_target(<target>) is called for every target of ours.
function(bushd_target target)
  if(NOT BUSHD_SANITIZE)
    # With a sanitizer GCC warns of much that is not so; and warnings are a seventh of the time that the build takes.
    bushd_warnings(${target})
  endif()
  if(CMAKE_SYSTEM_PROCESSOR STREQUAL avr)
    # Registers of interrupts: firmware/ports/atmega2560/emission_slots.h.
    foreach(register RANGE 2 9)
      target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:C>:-ffixed-r${register}>)
    endforeach()
  endif()
  if(BUSHD_SANITIZE)
    # With the pattern, a pointer that was never set fails at its first use, whatever the stack held. In C++ it would take
    # a tenth of the build's time.
    #
    # In C++, checks of pointers are left to AddressSanitizer: those of UBSan are a quarter of what the build takes.
    #
    # In the preset asan, what UBSan finds is a trap of which AddressSanitizer tells the place: the words for it take a fifth of
    # the build. docs/testing.md has them back.
    target_compile_options(${target} PRIVATE -fsanitize=${BUSHD_SANITIZE} -fno-sanitize-recover=all
      -fno-omit-frame-pointer $<$<COMPILE_LANGUAGE:C>:-ftrivial-auto-var-init=pattern>
      $<$<COMPILE_LANGUAGE:CXX>:-fno-sanitize=null,alignment,object-size,vptr>)
    target_link_options(${target} PUBLIC -fsanitize=${BUSHD_SANITIZE})
  endif()
endfunction()

# bushd_in_batches(bushctl ...): the compiler gets sixteen C++ sources of these targets at once, which takes less than half of
# the time, as headers are read and templates made once. Names of a target's anonymous namespaces must differ therefore.
function(bushd_in_batches)
  if(BUSHD_BATCHES)
    set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 16)
  endif()
endfunction()

# bushd_checked_by_calls(daemon_test): the same checks of AddressSanitizer, with the same reports, but by calls instead of in place. The
# compiler takes a seventh less, and tests of the daemon's core, which is checked in place, take a twentieth longer.
function(bushd_checked_by_calls target)
  if(BUSHD_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE --param=asan-instrumentation-with-call-threshold=0)
  endif()
endfunction()

# bushd_built_quickly(bushctl ...): command lines and screens, whose speed nobody could tell, take half the compiler's time with
# -Og; with sanitizers they are not optimised at all. Packages are built with the flags of the distribution.
function(bushd_built_quickly)
  foreach(target IN LISTS ARGN)
    if(BUSHD_SANITIZE AND NOT BUSHD_FUZZ)
      target_compile_options(${target} PRIVATE -O0)
      bushd_checked_by_calls(${target})
    elseif(CMAKE_BUILD_TYPE STREQUAL Release)
      target_compile_options(${target} PRIVATE -Og)
    endif()
  endforeach()
endfunction()

# bushd_sanitized_quickly(config ...): libraries that no long simulation runs through are not optimised with sanitizers.
function(bushd_sanitized_quickly)
  if(BUSHD_SANITIZE)
    bushd_built_quickly(${ARGN})
  endif()
endfunction()

# bushd_library(engine SOURCES...) makes the target bushd_engine with the alias bushd::engine.
# Headers are included by their path below lib/ ("engine/table.h") or below the top ("firmware/core/mcu.h").
function(bushd_library name)
  add_library(bushd_${name} STATIC ${ARGN})
  add_library(bushd::${name} ALIAS bushd_${name})
  target_include_directories(bushd_${name} PUBLIC ${PROJECT_SOURCE_DIR}/lib ${PROJECT_SOURCE_DIR})
  bushd_target(bushd_${name})
endfunction()

# bushd_program(bushtab SOURCES...) makes a program of that name in <build>/bin.
function(bushd_program name)
  add_executable(${name} ${ARGN})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/lib ${PROJECT_SOURCE_DIR})
  bushd_target(${name})
  # What the program answers to --version; of this file alone, for a new one is another version of
  # nothing else.
  set_property(SOURCE main.cpp APPEND PROPERTY
    COMPILE_DEFINITIONS BUSHD_VERSION="${PROJECT_VERSION}")
endfunction()
