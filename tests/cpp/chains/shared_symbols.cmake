# Nothing in the objects that are compiled for AVX2 may be defined in others too: the linker could
# take it from either, and a processor without AVX2 would fail.
execute_process(COMMAND ${NM} -C ${OBJECTS} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE ";" "," symbols "${symbols}")
string(REPLACE "\n" ";" lines "${symbols}")
list(FILTER lines INCLUDE REGEX " [WTuVBDR] ")
list(LENGTH lines count)
if(count EQUAL 0)
  message(FATAL_ERROR "no symbols found")
endif()
list(FILTER lines EXCLUDE REGEX "avx2")
list(FILTER lines EXCLUDE REGEX "DW\\.ref\\.")  # an address
if(lines)
  list(JOIN lines "\n" lines)
  message(FATAL_ERROR "not only for AVX2:\n${lines}")
endif()
