// hermesh-lab, which the laboratory in Python (experiments/lab) starts:
//   hermesh-lab cell           works on one job (serve.h)
//   hermesh-lab describe       prints the build and the vocabulary of experiment files as JSON
//   hermesh-lab exploded DIR   draws DIR/exploded.png, the pieces of a fracture moved apart
#include <iostream>
#include <string>
#include <vector>

#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/cells/serve.h"
#include "experiments/pictures/exploded.h"
#include "experiments/provenance.h"

namespace {

int run(const std::vector<std::string>& words) {
  using namespace hermesh;
  RunContext context;
  if (words == std::vector<std::string>{"cell"}) {
    serve_job(all_tables(), context);
  } else if (words == std::vector<std::string>{"describe"}) {
    Json description = build_facts();
    description.update(vocabulary(all_tables()));
    std::cout << description.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
  } else if (words.size() == 2 && words[0] == "exploded") {
    draw_exploded(words[1], context);
  } else {
    std::cerr << "usage: hermesh-lab cell | describe | exploded DIR; `hermesh run` starts it\n";
    return 2;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    hermesh::register_dense_grids();
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << "hermesh-lab: " << error.what() << '\n';
    return 1;
  }
}
