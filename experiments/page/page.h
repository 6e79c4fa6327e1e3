// A page of results: one HTML file that shows the rows of a folder without a network.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/harness/columns.h"
#include "experiments/page/page_meshes.h"

namespace hermesh {

/// The parts of the page, as the files of experiments/page were when the program was built
/// (embed_page.cmake).
extern const std::string_view kPageHtml;
extern const std::string_view kPageStyle;
extern const std::string_view kPageScript;  ///< figures.js, viewer.js and page.js, one behind the other

/// The page as text. Whatever a row says stands in it as data alone: in blocks that no browser runs, with
/// each `<` as an escape of JSON. A policy in the page's head lets the browser load nothing, and run the
/// page's own script only, by its hash. `title` is text, too. @throws Error for a plot of a column that there
/// is not.
std::string html_page(const std::string& title, const std::vector<Json>& rows,
                      const std::vector<PageMesh>& meshes);

/// Writes report.html into the folder (beside a file of rows), and says so. Rows of a folder `baselines` beside
/// it or one level up (results/baselines, for results/local/NAME) that are of the same experiments count as
/// earlier runs. What the context notes is said, too.
/// @throws Error if there are no rows, or the file cannot be written; Cancelled.
void write_page(const std::filesystem::path& folder, const MeshChoice& choice, RunContext& context,
                std::ostream& out);

}  // namespace hermesh
