// Cells that fail: for want of an input, and what is said of them in the end.
#pragma once

#include <iosfwd>
#include <vector>

#include "algorithms/core/error.h"
#include "experiments/harness/columns.h"

namespace hermesh {

/// A case whose mesh cannot be had: its file is not there, is torn or holds no polygons. The cells of that case fail, and
/// those of other cases go on.
class CaseUnreadable : public Error {
  using Error::Error;
};

/// Writes a line with the number of rows that failed and the first one's reason; without such a row, nothing. Rows of variants
/// that are absent do not count.
void write_failures(const std::vector<Json>& rows, std::ostream& out);

}  // namespace hermesh
