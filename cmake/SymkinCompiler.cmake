# SPDX-License-Identifier: MIT

if(PROJECT_IS_TOP_LEVEL AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(SYMKIN_CCACHE ccache)
  mark_as_advanced(SYMKIN_CCACHE)
  if(SYMKIN_CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${SYMKIN_CCACHE})
  endif()
endif()

# GCC tidies its memory up while it compiles, a tenth of its time with templates like ours; with
# this many kilobytes it does so seldom.
if(PROJECT_IS_TOP_LEVEL)
  add_compile_options($<$<COMPILE_LANG_AND_ID:CXX,GNU>:--param=ggc-min-heapsize=1000000>)
endif()
