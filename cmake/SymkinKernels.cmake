# SPDX-License-Identifier: MIT
include(CheckCXXCompilerFlag)

check_cxx_compiler_flag(-mavx2 SYMKIN_COMPILER_HAS_AVX2)
check_cxx_compiler_flag(-mavx512f SYMKIN_COMPILER_HAS_AVX512)

# The last kind of symkin/support/processor.hpp that this machine has, where kernels are for it alone.
set(SYMKIN_PROCESSOR "")
if(NOT SYMKIN_ALL_PROCESSORS AND NOT CMAKE_CROSSCOMPILING)
  include(CheckCXXSourceRuns)
  foreach(kind avx2 avx512)
    string(TOUPPER ${kind} upper)
    string(REPLACE avx512 avx512f feature ${kind})
    check_cxx_source_runs(
      "int main() { return __builtin_cpu_supports(\"${feature}\") ? 0 : 1; }" SYMKIN_PROCESSOR_HAS_${upper}
    )
    if(SYMKIN_COMPILER_HAS_${upper} AND SYMKIN_PROCESSOR_HAS_${upper})
      set(SYMKIN_PROCESSOR ${kind})
    endif()
  endforeach()
endif()

# symkin_add_kernels(
#   <library> [NAME <of these, where a library has several>] PROCESSORS <avx2 or avx512>...
#   SOURCES <file>... LIBRARIES <target>...
# )
#
# Kernels, the loops in which the library spends its time, are compiled once to run everywhere and
# once more for each kind of processor that the compiler knows; the program takes at run time what
# its own processor has (symkin/support/processor.hpp). Sources see SYMKIN_COMPILES_<KIND>, and those
# that run everywhere SYMKIN_HAS_<KIND> for what there is beside them. What is compiled for a kind
# shares no function with the rest: tests/cpp/support/shared_symbols.cmake. Fused multiplications stay
# off, so that results do not depend on the processor. Without SYMKIN_ALL_PROCESSORS this machine's
# kinds alone are compiled: of what runs everywhere nothing is left but the way to them.
function(symkin_add_kernels library)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "NAME" "PROCESSORS;SOURCES;LIBRARIES")
  set(flags_avx2 -mavx2)
  set(flags_avx512 -mavx2 -mfma -mavx512f)  # Eigen wants both
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    list(APPEND flags_avx512 -Wno-maybe-uninitialized)  # its own header begins with what is undefined
  endif()
  # GCC copies arrays of batches by halves, which the processor then cannot read at once.
  check_cxx_compiler_flag(-mmove-max=256 SYMKIN_COMPILER_HAS_MOVE_MAX)
  if(SYMKIN_COMPILER_HAS_MOVE_MAX)
    list(APPEND flags_avx2 -mmove-max=256 -mstore-max=256)
  endif()
  set(own ${library})
  if(arg_NAME)
    set(own ${library}_${arg_NAME})
  endif()
  set(plain ${own}_kernels)
  set(kinds everywhere ${arg_PROCESSORS})
  foreach(kind IN LISTS kinds)
    string(TOUPPER ${kind} upper)
    if(kind STREQUAL everywhere)
      set(name ${plain})
    elseif(SYMKIN_COMPILER_HAS_${upper} AND (NOT SYMKIN_PROCESSOR OR SYMKIN_PROCESSOR_HAS_${upper}))
      set(name ${own}_${kind})
    else()
      continue()
    endif()
    add_library(${name} OBJECT ${arg_SOURCES})
    symkin_set_warnings(${name})
    set_target_properties(
      ${name} PROPERTIES POSITION_INDEPENDENT_CODE ON UNITY_BUILD ${SYMKIN_UNITY_BUILD} UNITY_BUILD_BATCH_SIZE 4
    )
    target_compile_features(${name} PRIVATE cxx_std_17)
    symkin_set_arithmetic(${name})
    target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/cpp)
    target_link_libraries(${name} PRIVATE ${arg_LIBRARIES})
    target_sources(${library} PRIVATE $<TARGET_OBJECTS:${name}>)
    # One layout and one way to allocate arrays of Eigen, whatever a kind's flags would make of them.
    target_compile_definitions(
      ${name} PRIVATE $<TARGET_PROPERTY:symkin_support,INTERFACE_COMPILE_DEFINITIONS>
    )
    if(kind STREQUAL everywhere)
      if(SYMKIN_PROCESSOR)
        target_compile_definitions(${name} PRIVATE SYMKIN_PROCESSOR=${SYMKIN_PROCESSOR})
      endif()
    else()
      # Optimised in any case: what is not inlined could be shared.
      target_compile_options(${name} PRIVATE -O3 ${flags_${kind}})
      target_compile_definitions(${name} PRIVATE SYMKIN_COMPILES_${upper})
      target_compile_definitions(${plain} PRIVATE SYMKIN_HAS_${upper})
      set_property(GLOBAL APPEND PROPERTY SYMKIN_KERNELS_OF_A_KIND ${name})
    endif()
  endforeach()
endfunction()
