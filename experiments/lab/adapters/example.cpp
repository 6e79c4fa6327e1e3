// An adapter in C++: writes the bounding box of an OBJ file. g++ -O2 example.cpp -o example
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

int main() {
  const double inf = std::numeric_limits<double>::infinity();
  double low[3] = {inf, inf, inf}, high[3] = {-inf, -inf, -inf};
  std::ifstream input(std::getenv("HERMESH_INPUT"));
  std::ofstream out(std::getenv("HERMESH_OUTPUT")), result(std::getenv("HERMESH_RESULT"));
  for (std::string line, word; std::getline(input, line);) {
    std::istringstream words(line);
    double p[3];
    if (words >> word >> p[0] >> p[1] >> p[2] && word == "v")
      for (int i = 0; i < 3; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
  }
  if (!(low[0] < high[0] && low[1] < high[1] && low[2] < high[2]))
    return result << R"({"status": "refused", "message": "no OBJ file with a volume"})", 0;
  out.precision(17);
  out << "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n"
      << "element face 6\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) out << (i >> k & 1 ? high : low)[k] << (k < 2 ? ' ' : '\n');
  out << "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";
  result << R"({"status": "done", "claims": {"watertight": true, "manifold": true}})";
}
