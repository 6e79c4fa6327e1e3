#include "validation/fracture_report.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"
#include "validation/self_intersection.h"

namespace hermesh::validation {
namespace {

using Eigen::Vector3d;

/// The share of the expected volume by which the pieces' sum may differ before a piece counts as lost. The
/// uncut mesh and the pieces differ by the moved vertices of cells along the cuts, which stays below this
/// share.
constexpr double kLostPiece = 0.02;
/// The share of a piece's volume by which its record may differ, in addition to the rounding of its
/// coordinates to single precision.
constexpr double kRecordError = 1e-6;

/// Returns a piece's name. Pieces count from 1, as their files do.
std::string name_of(std::size_t piece) { return "piece " + std::to_string(piece + 1); }

/// Returns the mesh's polygon attribute `surface`, or null.
const std::vector<std::int32_t>* surface_of(const MeshFile& mesh) {
  for (const MeshAttribute& a : mesh.attributes)
    if (a.name == "surface" && a.domain == AttributeDomain::polygon && a.components == 1)
      return std::get_if<std::vector<std::int32_t>>(&a.values);
  return nullptr;
}

double volume_of(const std::vector<Vector3d>& points, const std::vector<Triangle>& triangles,
                 const Vector3d& about) {
  double six = 0.0;
  for (const Triangle& t : triangles)
    six += (points[t[0]] - about).dot((points[t[1]] - about).cross(points[t[2]] - about));
  return six / 6.0;
}

/// Returns a bound of the change of a piece's volume if each coordinate is rounded to single precision.
double rounding(const MeshFile& piece) {
  double greatest = 0.0;
  for (const Vector3d& p : piece.points) greatest = std::max(greatest, p.cwiseAbs().maxCoeff());
  return TriangleSoup(piece).area() * greatest * double(std::numeric_limits<float>::epsilon());
}

/// A triangle of a piece, to be sorted so that triangles over the same points are adjacent.
struct Entry {
  Triangle sorted;  ///< its points among those of all pieces, ascending
  std::uint32_t piece;
  std::uint32_t triangle;  ///< its number among those of all pieces
  bool odd;                ///< true if sorting reversed its winding
  std::int8_t surface;     ///< its tag; −1 if there is none
};

class Pieces {
 public:
  Pieces(const std::vector<MeshFile>& pieces, const ExpectedVolumes& expected, RunContext& context)
      : pieces_(pieces), expected_(expected), context_(context) {}

  FractureReport check() {
    report_.pieces = static_cast<std::int64_t>(pieces_.size());
    check_each();
    weld_all();
    find_seams();
    check_rest();
    check_tags();
    compare_volumes();
    find_intersections();
    find_nested();
    return std::move(report_);
  }

 private:
  void add_place(const std::string& what, const Vector3d& where) {
    if (report_.places.size() >= 4 * kMaxPlaces) return;
    report_.places.push_back(what + " at (" + std::to_string(where.x()) + ", " + std::to_string(where.y()) +
                             ", " + std::to_string(where.z()) + ")");
  }

  void check_each() {
    const Stage stage(context_, "validate pieces");
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      RunContext quiet;
      quiet.cancel = context_.cancel;
      const MeshReport report = check_mesh(pieces_[i], {.libraries = false}, quiet);
      if (report.watertight() && report.oriented() && report.duplicate_polygons == 0) continue;
      ++report_.broken_pieces;
      if (report_.broken_pieces <= std::int64_t(kMaxPlaces)) {
        std::string text = name_of(i) + ":";
        for (const std::string& sentence : report.sentences()) text += " " + sentence;
        report_.places.push_back(text);
      }
    }
  }

  /// Numbers the points of all pieces, merging those whose three coordinates are equal.
  void weld_all() {
    const Stage stage(context_, "weld pieces");
    std::vector<Vector3d> corners;
    first_point_.push_back(0);
    for (const MeshFile& piece : pieces_) {
      corners.insert(corners.end(), piece.points.begin(), piece.points.end());
      first_point_.push_back(static_cast<std::uint32_t>(corners.size()));
    }
    WeldedPoints welded = weld(corners);
    points_ = std::move(welded.points);
    number_ = std::move(welded.number);
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const TriangleSoup soup(pieces_[i]);
      const auto* surface = surface_of(pieces_[i]);
      for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
        Triangle whole = soup.triangles[t];
        for (std::uint32_t& p : whole) p = number_[first_point_[i] + p];
        Entry entry{
            whole, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(triangles_.size()), false,
            static_cast<std::int8_t>(surface ? (*surface)[static_cast<std::size_t>(soup.polygon(t))] != 0
                                             : -1)};
        for (const auto& [a, b] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)})
          if (entry.sorted[a] > entry.sorted[b])
            std::swap(entry.sorted[a], entry.sorted[b]), entry.odd = !entry.odd;
        entries_.push_back(entry);
        triangles_.push_back(whole);
      }
    }
    report_.triangles = static_cast<std::int64_t>(triangles_.size());
  }

  Vector3d middle(const Triangle& t) const { return (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3.0; }

  void find_seams() {
    const Stage stage(context_, "match seams");
    tbb::parallel_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.sorted, a.triangle) < std::tie(b.sorted, b.triangle);
    });
    for (std::size_t i = 0, end = 0; i < entries_.size(); i = end) {
      while (end < entries_.size() && entries_[end].sorted == entries_[i].sorted) ++end;
      once_.push_back(triangles_[entries_[i].triangle]);
      const bool seam = end - i == 2 && entries_[i].odd != entries_[i + 1].odd &&
                        entries_[i].piece != entries_[i + 1].piece;
      if (end - i > 1 && !seam) {
        report_.repeated_triangles += static_cast<std::int64_t>(end - i);
        add_place("a triangle of " + name_of(entries_[i].piece) + " and " + name_of(entries_[i + 1].piece) +
                      " is not a seam",
                  middle(entries_[i].sorted));
      }
      for (std::size_t k = i; k < end; ++k) {
        const Entry& e = entries_[k];
        if (seam) {
          ++report_.seam_triangles;
          report_.matched_original += e.surface == 0;
          if (e.surface == 0) rest_.push_back(triangles_[e.triangle]);
          continue;
        }
        if (e.surface <= 0) rest_.push_back(triangles_[e.triangle]);
        if (e.surface == 1 && report_.unmatched_cut++ < std::int64_t(kMaxPlaces))
          add_place("a cut triangle of " + name_of(e.piece) + " has no other side", middle(e.sorted));
      }
    }
  }

  /// Sets `gaps_checked`. Triangles that are neither matched nor tagged as cut are taken for original, so
  /// only the tags reveal gaps.
  void check_tags() {
    if (pieces_.size() < 2 || report_.seam_triangles == report_.triangles) return;
    const bool all_tagged = std::ranges::none_of(entries_, [](const Entry& e) { return e.surface < 0; });
    const bool some_cut = std::ranges::any_of(entries_, [](const Entry& e) { return e.surface > 0; });
    report_.gaps_checked = (all_tagged && (some_cut || is_complete() || is_on_whole())) || are_far_apart();
  }

  /// Returns true if the pieces' volumes add up to the whole's: the volume of a gap would be missing.
  bool is_complete() const {
    return expected_.whole &&
           std::abs(report_.pieces_volume - *expected_.whole) <= 1e-9 * std::abs(*expected_.whole);
  }

  /// Returns true if all triangles are near the uncut surface, by their corners and middles: pieces that
  /// touch in edges have no cut between them.
  bool is_on_whole() const {
    if (!(expected_.reach > 0.0) || !expected_.surface) return false;
    const TriangleSoup whole(*expected_.surface);
    if (whole.triangles.empty()) return false;
    const TriangleTree tree(whole);
    const auto is_near = [&](const Vector3d& p) {
      return tree.closest(p).squared <= expected_.reach * expected_.reach;
    };
    return std::ranges::all_of(points_, is_near) &&
           std::ranges::all_of(triangles_, [&](const Triangle& t) { return is_near(middle(t)); });
  }

  /// Returns true if no two pieces can ever have been one. A gap of a fracture is narrower than the cells
  /// along it, and edges are as long as cells: so pieces whose boxes are farther apart than the longest edge
  /// were never one.
  bool are_far_apart() const {
    double longest = 0.0;
    for (const Triangle& t : triangles_)
      for (int k = 0; k < 3; ++k)
        longest = std::max(longest, (points_[t[k]] - points_[t[(k + 1) % 3]]).norm());
    std::vector<Box> boxes;
    for (const MeshFile& piece : pieces_) {
      boxes.push_back(box_of(piece));
      if (boxes.back().empty()) return false;
      boxes.back().lower.array() -= 0.5 * longest;
      boxes.back().upper.array() += 0.5 * longest;
    }
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (boxes[i].overlaps(boxes[j])) return false;
    return true;
  }

  void compare_volumes() {
    if (expected_.whole && *expected_.whole != 0)
      report_.expected_difference = report_.pieces_volume / *expected_.whole - 1.0;
    if (expected_.pieces.empty()) return;
    report_.wrong_records = std::abs(static_cast<std::int64_t>(expected_.pieces.size()) -
                                     static_cast<std::int64_t>(pieces_.size()));
    for (std::size_t i = 0; i < std::min(expected_.pieces.size(), pieces_.size()); ++i) {
      if (std::abs(volumes_[i] - expected_.pieces[i]) <=
          kRecordError * std::abs(expected_.pieces[i]) + rounding(pieces_[i]))
        continue;
      ++report_.wrong_records;
      if (!pieces_[i].points.empty())
        add_place(name_of(i) + " has the volume " + std::to_string(volumes_[i]) + ", not the recorded " +
                      std::to_string(expected_.pieces[i]),
                  pieces_[i].points.front());
    }
  }

  void check_rest() {
    report_.rest_triangles = static_cast<std::int64_t>(rest_.size());
    Vector3d about = Vector3d::Zero();
    for (const Vector3d& p : points_) about += p / static_cast<double>(points_.size());
    report_.rest_volume = volume_of(points_, rest_, about);
    for (const MeshFile& piece : pieces_) {
      volumes_.push_back(volume_of(piece.points, TriangleSoup(piece).triangles, about));
      report_.pieces_volume += volumes_.back();
    }
    for_each_edge(sorted_sides(rest_), [&](std::span<const TriangleSide> sides) {
      int sum = 0;
      for (const TriangleSide& side : sides) sum += side.direction;
      report_.rest_open_edges += std::abs(sum);
      if (sum != 0 && report_.rest_open_edges < 4)
        add_place("the original surface is open", points_[sides[0].low]);
    });
  }

  void find_intersections() {
    const Stage stage(context_, "intersections of all pieces");
    MeshFile all;
    all.points = points_;
    all.triangles = once_;
    const TriangleSoup soup(all);
    if (soup.triangles.empty()) return;
    const SelfIntersections found = find_self_intersections(soup, TriangleTree(soup), context_);
    report_.intersecting_pairs = found.pairs;
    if (found.pairs > 0) add_place("two triangles intersect", found.places.points.front());
  }

  /// Returns the solid angle of a piece's triangles, seen from a point, over 4π: 1 inside, 0 outside (van
  /// Oosterom & Strackee 1983).
  double winding(std::size_t piece, const Vector3d& x) const {
    double sum = 0.0;
    for (const Triangle& t : TriangleSoup(pieces_[piece]).triangles) {
      const Vector3d a = pieces_[piece].points[t[0]] - x, b = pieces_[piece].points[t[1]] - x,
                     c = pieces_[piece].points[t[2]] - x;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (2.0 * std::numbers::pi);
  }

  /// Counts components inside another piece: tests one point of each component of each piece against the
  /// pieces whose box contains it and that do not share it.
  void find_nested() {
    const Stage stage(context_, "nested pieces");
    std::vector<Box> boxes;
    std::vector<std::vector<std::uint32_t>> own(pieces_.size());
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      boxes.push_back(box_of(pieces_[i]));
      own[i].assign(number_.begin() + first_point_[i], number_.begin() + first_point_[i + 1]);
      std::sort(own[i].begin(), own[i].end());
    }
    std::vector<std::int64_t> nested(pieces_.size());
    parallel_blocks(pieces_.size(), context_, [&](std::size_t i) {
      for (const std::vector<std::uint32_t>& component : components(i))
        for (std::size_t j = 0; j < pieces_.size(); ++j) {
          if (i == j || !boxes[j].overlaps(boxes[i])) continue;
          const auto free = std::find_if(component.begin(), component.end(), [&](std::uint32_t p) {
            return !std::binary_search(own[j].begin(), own[j].end(), number_[first_point_[i] + p]);
          });
          if (free == component.end()) continue;
          const Vector3d& x = pieces_[i].points[*free];
          if (boxes[j].squared_distance(x) == 0.0 && std::abs(winding(j, x)) > 0.5) ++nested[i];
        }
    });
    for (const std::int64_t n : nested) report_.nested_components += n;
  }

  /// Returns the used points of each component of a piece, in ascending order.
  std::vector<std::vector<std::uint32_t>> components(std::size_t piece) const {
    const std::size_t points = pieces_[piece].points.size();
    DisjointSets sets(points);
    std::vector<char> used(points);
    for (const Triangle& t : TriangleSoup(pieces_[piece]).triangles)
      for (int k = 0; k < 3; ++k) used[t[k]] = 1, sets.join(t[k], t[(k + 1) % 3]);
    std::vector<std::vector<std::uint32_t>> result;
    std::vector<std::size_t> position(points, points);
    for (std::uint32_t p = 0; p < points; ++p) {
      if (!used[p]) continue;
      std::size_t& at = position[sets.find(p)];
      if (at == points) at = result.size(), result.emplace_back();
      result[at].push_back(p);
    }
    return result;
  }

  const std::vector<MeshFile>& pieces_;
  const ExpectedVolumes& expected_;
  RunContext& context_;
  FractureReport report_;
  std::vector<Vector3d> points_;            ///< points of all pieces, no two equal
  std::vector<std::uint32_t> first_point_;  ///< each piece's first position in number_
  std::vector<std::uint32_t> number_;       ///< each piece's points, by their positions in points_
  std::vector<Triangle> triangles_, once_, rest_;
  std::vector<double> volumes_;  ///< volume of each piece
  std::vector<Entry> entries_;
};

}  // namespace

double FractureReport::volume_difference() const {
  const double size = std::max(std::abs(rest_volume), std::abs(pieces_volume));
  return size > 0 ? std::abs(rest_volume - pieces_volume) / size : 0.0;
}

bool FractureReport::lost_a_piece() const {
  return expected_difference && !(std::abs(*expected_difference) <= kLostPiece);
}

std::vector<std::string> FractureReport::sentences() const {
  std::vector<std::string> result;
  const auto add = [&](std::int64_t n, const std::string& what) {
    if (n > 0) result.push_back(std::to_string(n) + " " + what + ".");
  };
  if (pieces == 0) result.push_back("There are no pieces.");
  if (!gaps_checked)
    result.push_back(
        "Pieces are adjacent, but cuts are not tagged: gaps cannot be checked (no triangle's attribute "
        "`surface` "
        "is 1).");
  add(broken_pieces, "pieces are not closed, manifold, oriented and free of self-intersections");
  add(unmatched_cut, "cut triangles have no other side");
  add(matched_original, "triangles are tagged original but lie between two pieces");
  add(repeated_triangles, "triangles are repeated and are not seams");
  add(rest_open_edges, "edges are open in the original surface of all pieces together");
  add(intersecting_pairs, "pairs of triangles intersect");
  add(nested_components, "components lie inside another piece");
  const std::string sum = "The pieces' volumes add up to " + std::to_string(pieces_volume) + ", ";
  if (volume_difference() > 1e-9)
    result.push_back(sum + "but the original surface bounds " + std::to_string(rest_volume) + ".");
  if (lost_a_piece())
    result.push_back(sum + "which differs from the uncut object's volume by " +
                     std::to_string(100.0 * *expected_difference) + " %.");
  add(wrong_records, "pieces do not have their recorded volume");
  if (is_consistent())
    result.push_back((result.empty() ? "The pieces fit: " : "Otherwise the pieces fit: ") +
                     std::to_string(pieces) + " pieces, " + std::to_string(seam_triangles) +
                     " seam triangles, each reversed in one other piece.");
  return result;
}

FractureReport check_fracture(const std::vector<MeshFile>& pieces, RunContext& context,
                              const ExpectedVolumes& expected) {
  return Pieces(pieces, expected, context).check();
}

}  // namespace hermesh::validation
