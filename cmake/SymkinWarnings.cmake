# SPDX-License-Identifier: MIT

# Our own targets are built with these flags under the preset dev; they never reach a user's target.
function(symkin_set_warnings target)
  if(SYMKIN_WARNINGS)
    target_compile_options(
      ${target} PRIVATE -Wall -Wextra -Wconversion $<$<BOOL:${SYMKIN_WARNINGS_AS_ERRORS}>:-Werror>
    )
  endif()
endfunction()
