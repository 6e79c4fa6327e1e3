# Writes the source file OUTPUT with the parts of the page in the folder PAGE as string literals, so that the program needs
# no file to write a page.
foreach(part page.html page.css figures.js viewer.js page.js)
  string(MAKE_C_IDENTIFIER ${part} name)
  file(READ ${PAGE}/${part} ${name})
  if("${${name}}" MATCHES "\\)embedded\"")
    message(FATAL_ERROR "${PAGE}/${part} holds )embedded\", which ends a literal of the generated source")
  endif()
endforeach()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT [[#include "experiments/page/page.h"

namespace hermesh {

const std::string_view kPageHtml = R"embedded(@page_html@)embedded";
const std::string_view kPageStyle = R"embedded(@page_css@)embedded";
const std::string_view kPageScript = R"embedded(@figures_js@@viewer_js@@page_js@)embedded";

}  // namespace hermesh
]] @ONLY)
