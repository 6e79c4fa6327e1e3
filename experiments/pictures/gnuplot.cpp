#include "experiments/pictures/gnuplot.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <ostream>
#include <string>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

bool run_gnuplot(const std::filesystem::path& script) {
  std::string folder = script.parent_path().empty() ? "." : script.parent_path().string();
  std::string command = "cd '";
  for (const char c : folder) command += c == '\'' ? std::string("'\\''") : std::string(1, c);
  command += "' && gnuplot '" + script.filename().string() + "' >/dev/null 2>&1 </dev/null";
  return std::system(command.c_str()) == 0;
}

/// Cairo writes the time into a PDF. The date gets other digits in place, so that nothing moves in the file.
void fix_date(const std::filesystem::path& pdf) {
  std::ifstream in(pdf, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string key = "/CreationDate (D:", fixed = "20110401000000";
  const std::size_t at = bytes.find(key);
  if (at == std::string::npos || at + key.size() + fixed.size() > bytes.size())
    throw Error("there is no date to replace in " + pdf.string());
  bytes.replace(at + key.size(), fixed.size(), fixed);
  std::ofstream out(pdf, std::ios::binary);
  if (!out.write(bytes.data(), std::streamsize(bytes.size())).flush())
    throw Error("cannot write " + pdf.string());
}

}  // namespace

void draw_with_gnuplot(const std::filesystem::path& stem, std::ostream& out) {
  const bool drawn = run_gnuplot(stem.string() + ".gp");
  if (drawn) fix_date(stem.string() + ".pdf");
  out << (drawn ? "Plot: " + stem.string() + ".png, .pdf, .svg\n"
                : "Not drawn, because gnuplot is missing or failed: " + stem.string() + ".gp\n");
}

}  // namespace hermesh
