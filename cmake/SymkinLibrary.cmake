# SPDX-License-Identifier: MIT

# Results shall not depend on the processor; GCC leaves multiplications unfused without being told.
function(symkin_set_arithmetic target)
  target_compile_options(
    ${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,Clang,AppleClang>:-ffp-contract=off>
  )
endfunction()

# A library of the project with what all have in common; `symkin_room` is symkin::room to its users.
function(symkin_add_library name)
  add_library(${name} ${ARGN})
  string(REGEX REPLACE "^symkin_" "" exported ${name})
  add_library(symkin::${exported} ALIAS ${name})
  set_target_properties(
    ${name}
    PROPERTIES
      EXPORT_NAME ${exported}
      POSITION_INDEPENDENT_CODE ON
      VERSION ${PROJECT_VERSION}
      SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
      UNITY_BUILD ${SYMKIN_UNITY_BUILD}
      UNITY_BUILD_BATCH_SIZE 8
  )
  target_compile_features(${name} PUBLIC cxx_std_17)
  symkin_set_arithmetic(${name})
  # std::mt19937_64 chooses by random bits, and jumps that no processor foretells took two thirds of
  # its time.
  target_compile_options(
    ${name}
    PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:--param=max-rtl-if-conversion-unpredictable-cost=40>
  )
  target_include_directories(
    ${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/cpp> $<INSTALL_INTERFACE:include>
  )
  symkin_set_warnings(${name})
endfunction()
