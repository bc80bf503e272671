# Nothing in objects that are compiled for one kind of processor may be defined in others too: the
# linker could take it from either, and a processor of another kind would fail.
execute_process(COMMAND ${NM} -C ${OBJECTS} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE ";" "," symbols "${symbols}")
string(REPLACE "\n" ";" lines "${symbols}")
list(FILTER lines INCLUDE REGEX " [WTuVBDR] ")
list(LENGTH lines count)
if(count EQUAL 0)
  message(FATAL_ERROR "no symbols found")
endif()
list(FILTER lines EXCLUDE REGEX "avx(2|512)")
list(FILTER lines EXCLUDE REGEX "DW\\.ref\\.")  # an address
if(lines)
  list(JOIN lines "\n" lines)
  message(FATAL_ERROR "not only for this kind:\n${lines}")
endif()
