#include "experiments/page/page_meshes.h"

#include <openssl/evp.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "algorithms/core/error.h"
#include "algorithms/core/shown.h"
#include "experiments/cases/cases.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/table_text.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

class Packer {
 public:
  void add_difference(std::int64_t to) {
    const std::int64_t d = to - before_;
    before_ = to;
    for (std::uint64_t rest = d < 0 ? 2 * std::uint64_t(-(d + 1)) + 1 : 2 * std::uint64_t(d);;) {
      const auto low = static_cast<std::uint8_t>(rest & 0x7f);
      rest >>= 7;
      bytes_.push_back(rest ? low | 0x80 : low);
      if (!rest) return;
    }
  }
  void begin_differences() { before_ = 0; }
  void add_byte(std::uint8_t byte) { bytes_.push_back(byte); }

  std::string base64_of_deflated() const {
    uLongf size = compressBound(bytes_.size());
    std::vector<std::uint8_t> deflated(size);
    if (compress2(deflated.data(), &size, bytes_.data(), bytes_.size(), 6) != Z_OK)
      throw Error("a mesh could not be compressed for the page");
    std::string text;
    text.reserve(size / 3 * 4 + 8);
    // EVP_EncodeBlock() takes an int; a piece is a multiple of three bytes, so that only the last one is
    // padded.
    constexpr std::size_t kPiece = 3 << 20;
    std::vector<unsigned char> encoded(kPiece / 3 * 4 + 1);
    for (std::size_t at = 0; at < size; at += kPiece) {
      const int length = EVP_EncodeBlock(encoded.data(), deflated.data() + at,
                                         int(std::min<std::size_t>(kPiece, size - at)));
      text.append(reinterpret_cast<const char*>(encoded.data()), std::size_t(length));
    }
    return text;
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::int64_t before_ = 0;
};

struct StoredMesh {
  fs::path path;
  std::uintmax_t bytes;
};

/// The files, the chosen ones in the order of their names.
std::vector<StoredMesh> stored_meshes(const fs::path& folder, const MeshChoice& choice, RunContext& context) {
  std::vector<StoredMesh> found;
  if (!fs::is_directory(folder)) return found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() == ".ply" &&
        entry.path().parent_path().parent_path().filename() == "meshes")
      found.push_back({entry.path(), entry.file_size()});
  std::ranges::sort(found, {}, &StoredMesh::path);
  if (choice.all || found.size() <= choice.count) return found;
  const std::size_t left_out = found.size() - choice.count;
  std::ranges::stable_sort(found, std::greater(), &StoredMesh::bytes);
  found.resize(choice.count);
  std::ranges::sort(found, {}, &StoredMesh::path);
  context.note(
      std::to_string(left_out) + " of the " + std::to_string(left_out + choice.count) +
      " meshes are not in the page, which holds the largest ones; --meshes all, or a number, takes more");
  return found;
}

/// Whether a run writes this row's mesh to such a file:
/// meshes/EXPERIMENT-CASE-RESOLUTION[-VOXELIZER]/NUMBER-LABEL.ply.
bool is_mesh_of(const Json& row, const fs::path& path) {
  const std::string stem = path.stem().string(), folder = path.parent_path().filename().string();
  const std::size_t number = stem.find_first_not_of("0123456789");
  if (number == 0 || number == std::string::npos ||
      stem.substr(number) != "-" + file_name(text_at(row, "/variant/label")))
    return false;
  const std::string group = text_at(row, "/experiment") + "-" + file_name(text_at(row, "/case/name")) + "-" +
                            text_at(row, "/resolution");
  return folder == group || folder == group + "-" + file_name(text_at(row, "/voxelization/label"));
}

/// A row's input, which meshes that follow one another share.
class Inputs {
 public:
  explicit Inputs(RunContext& context) : context_(context) {}

  /// The tree of the row's input, or nothing, and then why in `sentence`.
  const validation::TriangleTree* tree_of(const Json& row, std::string& sentence) {
    const std::string name = text_at(row, "/case/name"), hash = text_at(row, "/case/sha256");
    if (name != name_ || hash != hash_) {
      name_ = name;
      hash_ = hash;
      tree_.reset();
      failure_.clear();
      RunContext child = child_context(context_, true);
      const auto failed = attempt([&] { load(child); });
      if (failed) failure_ = "the input " + name + " is not at hand: " + *failed;
    }
    sentence = failure_;
    return tree_ ? &*tree_ : nullptr;
  }

 private:
  void load(RunContext& context) {
    const LoadedCase input = load_case(name_, context);
    if (input.sha256 != hash_) {
      failure_ = "the input " + name_ + " at hand (" + input.origin + ", sha256 " +
                 input.sha256.substr(0, 12) + ") is not that of the row, sha256 " + hash_.substr(0, 12);
      return;
    }
    const MeshFile file = to_mesh_file(input.mesh);
    // Quads of an input are cut as the judge cuts them.
    tree_.emplace(validation::TriangleSoup(file, validation::QuadRule::better));
  }

  RunContext& context_;
  std::string name_, hash_, failure_;
  std::optional<validation::TriangleTree> tree_;
};

std::vector<double> distances_to(const validation::TriangleTree& tree, const MeshFile& mesh,
                                 double voxel_size, const RunContext& context) {
  std::vector<double> distances(mesh.points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, distances.size(), 512), [&](const auto& range) {
    context.check();
    std::uint32_t guess = 0;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const validation::ClosestHit hit = tree.closest(mesh.points[i], guess);
      guess = hit.slot;
      distances[i] = std::sqrt(hit.squared) / voxel_size;
    }
  });
  return distances;
}

}  // namespace

MeshChoice mesh_choice(const std::string& text) {
  if (text == "all") return {.all = true, .count = 0};
  if (text == "none") return {.all = false, .count = 0};
  MeshChoice choice;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), choice.count);
  if (error != std::errc() || end != text.data() + text.size())
    throw Error("\"" + shown(text) + "\" is neither all, none nor a number of meshes");
  return choice;
}

PageMesh pack_mesh(const MeshFile& mesh, double voxel_size, const std::vector<double>& distances) {
  validation::Box box;
  for (const Eigen::Vector3d& point : mesh.points) {
    if (!point.allFinite()) throw Error("a coordinate is not finite");
    box.add(point);
  }
  const double longest = box.empty() ? 0.0 : (box.upper - box.lower).maxCoeff();
  const double finest = std::ldexp(longest > 0.0 ? longest : 1.0, -22);
  const double step = std::max(voxel_size / 256.0, finest);
  Packer packer;
  for (int axis = 0; axis < 3; ++axis) {
    packer.begin_differences();
    for (const Eigen::Vector3d& point : mesh.points)
      packer.add_difference(std::llround((point[axis] - box.lower[axis]) / step));
  }
  packer.begin_differences();
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) packer.add_difference(corner);
  for (const Quad& quad : mesh.quads)
    for (const std::uint32_t corner : quad) packer.add_difference(corner);

  const double largest = distances.empty() ? 0.0 : *std::ranges::max_element(distances);
  const auto level = [&](double distance) {
    return largest > 0.0 ? static_cast<std::uint32_t>(std::lround(65535.0 * distance / largest)) : 0u;
  };
  for (const double distance : distances) packer.add_byte(static_cast<std::uint8_t>(level(distance) >> 8));
  for (const double distance : distances) packer.add_byte(static_cast<std::uint8_t>(level(distance) & 0xff));

  const Eigen::Vector3d lower = box.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : box.lower;
  Json head = {{"points", mesh.points.size()},
               {"triangles", mesh.triangles.size()},
               {"quads", mesh.quads.size()},
               {"lower", {lower.x(), lower.y(), lower.z()}},
               {"step", step},
               {"voxel_size", voxel_size > 0.0 ? Json(voxel_size) : Json(nullptr)},
               {"largest", distances.empty() ? Json(nullptr) : Json(largest)}};
  return {std::move(head), packer.base64_of_deflated()};
}

std::vector<PageMesh> page_meshes(const fs::path& folder, const std::vector<Json>& rows,
                                  const MeshChoice& choice, RunContext& context) {
  std::vector<PageMesh> meshes;
  Inputs inputs(context);
  for (const StoredMesh& stored : stored_meshes(folder, choice, context)) {
    const std::string name =
        stored.path.parent_path().filename().string() + "/" + stored.path.filename().string();
    const auto row = std::find_if(rows.rbegin(), rows.rend(),
                                  [&](const Json& each) { return is_mesh_of(each, stored.path); });
    const auto failed = attempt([&] {
      const Stage stage(context, name);
      RunContext child = child_context(context, false);
      const MeshFile mesh = read_mesh_file(stored.path, child);
      std::string sentence = row == rows.rend() ? "no row is of this mesh" : "";
      const double voxel_size = row == rows.rend() ? 0.0 : number_at(*row, "/voxel_size");
      const validation::TriangleTree* tree = voxel_size > 0.0 ? inputs.tree_of(*row, sentence) : nullptr;
      PageMesh packed = pack_mesh(
          mesh, voxel_size, tree ? distances_to(*tree, mesh, voxel_size, context) : std::vector<double>());
      packed.head["name"] =
          row == rows.rend() ? name : group_title(*row) + ": " + text_at(*row, "/variant/label");
      packed.head["file"] = name;
      packed.head["row"] = row == rows.rend() ? Json(nullptr) : Json(std::distance(row, rows.rend()) - 1);
      packed.head["sentence"] = sentence;
      meshes.push_back(std::move(packed));
    });
    if (failed) context.note(name + " is not in the page: " + *failed);
  }
  return meshes;
}

}  // namespace hermesh
