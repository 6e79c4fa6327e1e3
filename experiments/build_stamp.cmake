# Writes the source file OUTPUT, which records the commit of the checkout SOURCE_DIR from which the program is
# built, and whether files differ from it; pages and results are not part of a program. Runs in each build,
# and writes only changes.
function(ask_git result output)
  execute_process(COMMAND git -C ${SOURCE_DIR} ${ARGN} OUTPUT_VARIABLE text RESULT_VARIABLE failure
    ERROR_QUIET
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  set(${output} "${text}" PARENT_SCOPE)
  set(${result} "${failure}" PARENT_SCOPE)
endfunction()

ask_git(failure commit rev-parse --verify HEAD)
ask_git(status_failure changes status --porcelain -- ":(top)" ":(top,exclude)results" ":(top,exclude)paper"
  ":(top,exclude,glob)**/*.md")
set(dirty "std::nullopt")
if(NOT failure STREQUAL "0")
  set(commit "unknown")
elseif(status_failure STREQUAL "0" AND changes STREQUAL "")
  set(dirty "false")
elseif(status_failure STREQUAL "0")
  set(dirty "true")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT [[#include <optional>

#include "experiments/provenance.h"

namespace hermesh {

SourceState built_from() { return {"@commit@", @dirty@}; }

}  // namespace hermesh
]] @ONLY)
