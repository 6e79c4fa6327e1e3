#include "validation/fracture_ledger.h"

#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "algorithms/core/parallel.h"
#include "validation/self_intersection.h"

namespace hermesh::validation {
namespace {

/// Counted from 1, as files of pieces are.
std::string name_of(std::size_t piece) { return "piece " + std::to_string(piece + 1); }

using Eigen::Vector3d;

/// The share of the expected volume by which the pieces' sum may be off before a piece counts as lost. The
/// uncut mesh and the pieces differ by what the cells along the cuts move their points, which stays below
/// this share.
constexpr double kLostPiece = 0.02;
/// The share of a piece's volume by which its record may differ from it, besides what the single precision of
/// its coordinates makes of it.
constexpr double kRecordError = 1e-6;

/// The mesh's polygon attribute `surface`, or null.
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

/// A triangle of a piece, to be sorted so that triangles over the same points come together.
struct Entry {
  Triangle sorted;  ///< its points among those of all pieces, ascending
  std::uint32_t piece;
  std::uint32_t triangle;  ///< its number among those of all pieces
  bool odd;                ///< whether sorting turned it round
  std::int8_t surface;     ///< its tag; −1 if there is none
};

class Ledger {
 public:
  Ledger(const std::vector<MeshFile>& pieces, const ExpectedVolumes& expected, RunContext& context)
      : pieces_(pieces), expected_(expected), context_(context) {}

  FractureLedger run() {
    ledger_.pieces = static_cast<std::int64_t>(pieces_.size());
    judge_pieces();
    weld();
    find_seams();
    judge_rest();
    judge_tags();
    compare_volumes();
    {
      const Stage stage(context_, "intersections of all pieces");
      MeshFile all;
      all.points = points_;
      all.triangles = once_;
      const TriangleSoup soup(all);
      if (!soup.triangles.empty()) {
        const SelfIntersections found = find_self_intersections(soup, TriangleTree(soup), context_);
        ledger_.intersecting_pairs = found.pairs;
        if (found.pairs > 0) say("two triangles intersect", found.places.points.front());
      }
    }
    find_nested();
    return std::move(ledger_);
  }

 private:
  void say(const std::string& what, const Vector3d& where) {
    if (ledger_.places.size() >= 4 * kMaxPlaces) return;
    ledger_.places.push_back(what + " at (" + std::to_string(where.x()) + ", " + std::to_string(where.y()) +
                             ", " + std::to_string(where.z()) + ")");
  }

  void judge_pieces() {
    const Stage stage(context_, "judge pieces");
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      RunContext quiet;
      quiet.cancel = context_.cancel;
      const MeshReport report = judge(pieces_[i], {.libraries = false}, quiet);
      if (report.watertight() && report.oriented() && report.duplicate_polygons == 0) continue;
      ++ledger_.broken_pieces;
      if (ledger_.broken_pieces <= std::int64_t(kMaxPlaces)) {
        std::string text = name_of(i) + ":";
        for (const std::string& sentence : report.sentences()) text += " " + sentence;
        ledger_.places.push_back(text);
      }
    }
  }

  /// Numbers the points of all pieces, as one if all three coordinates are equal.
  void weld() {
    const Stage stage(context_, "weld pieces");
    struct Corner {
      Vector3d point;
      std::uint32_t number;
    };
    std::vector<Corner> corners;
    first_point_.push_back(0);
    for (const MeshFile& piece : pieces_) {
      for (const Vector3d& p : piece.points)
        corners.push_back({p, static_cast<std::uint32_t>(corners.size())});
      first_point_.push_back(static_cast<std::uint32_t>(corners.size()));
    }
    const auto key = [](const Corner& c) { return std::tuple(c.point.x(), c.point.y(), c.point.z()); };
    tbb::parallel_sort(corners.begin(), corners.end(), [&](const Corner& a, const Corner& b) {
      return std::pair(key(a), a.number) < std::pair(key(b), b.number);
    });
    number_.resize(corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (i == 0 || key(corners[i]) != key(corners[i - 1])) points_.push_back(corners[i].point);
      number_[corners[i].number] = static_cast<std::uint32_t>(points_.size() - 1);
    }
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
    ledger_.triangles = static_cast<std::int64_t>(triangles_.size());
  }

  Vector3d middle(const Entry& e) const {
    return (points_[e.sorted[0]] + points_[e.sorted[1]] + points_[e.sorted[2]]) / 3.0;
  }

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
        ledger_.repeated_triangles += static_cast<std::int64_t>(end - i);
        say("a triangle stands in " + name_of(entries_[i].piece) + " and in " +
                name_of(entries_[i + 1].piece) + " but is no seam",
            middle(entries_[i]));
      }
      for (std::size_t k = i; k < end; ++k) {
        const Entry& e = entries_[k];
        if (seam) {
          ++ledger_.seam_triangles;
          ledger_.matched_original += e.surface == 0;
          if (e.surface == 0) rest_.push_back(triangles_[e.triangle]);
          continue;
        }
        if (e.surface <= 0) rest_.push_back(triangles_[e.triangle]);
        if (e.surface == 1 && ledger_.unmatched_cut++ < std::int64_t(kMaxPlaces))
          say("a cut triangle of " + name_of(e.piece) + " has no other side", middle(e));
      }
    }
  }

  /// Sets `gaps_can_be_judged`. Triangles that are neither matched nor tagged as cut pass for original, so
  /// gaps show by the tags alone.
  void judge_tags() {
    if (pieces_.size() < 2 || ledger_.seam_triangles == ledger_.triangles) return;
    const bool all_tagged =
        std::none_of(entries_.begin(), entries_.end(), [](const Entry& e) { return e.surface < 0; });
    const bool some_cut =
        std::any_of(entries_.begin(), entries_.end(), [](const Entry& e) { return e.surface > 0; });
    ledger_.gaps_can_be_judged =
        (all_tagged && (some_cut || is_complete() || is_on_whole())) || are_far_apart();
  }

  /// Whether the pieces' volumes add up to the whole's: the volume of a gap would be missing.
  bool is_complete() const {
    return expected_.whole &&
           std::abs(ledger_.pieces_volume - *expected_.whole) <= 1e-9 * std::abs(*expected_.whole);
  }

  /// Returns whether all triangles lie near the uncut surface, by their corners and middles: pieces that
  /// touch in edges have no cut between them.
  bool is_on_whole() const {
    if (!(expected_.reach > 0.0) || !expected_.surface) return false;
    const TriangleSoup whole(*expected_.surface);
    if (whole.triangles.empty()) return false;
    const TriangleTree tree(whole);
    const auto is_near = [&](const Vector3d& p) {
      return tree.closest(p).squared <= expected_.reach * expected_.reach;
    };
    return std::ranges::all_of(points_, is_near) && std::ranges::all_of(triangles_, [&](const Triangle& t) {
             return is_near((points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3.0);
           });
  }

  /// Whether no two pieces can ever have been one. A gap that a fracture leaves is narrower than the cells
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
      ledger_.expected_difference = ledger_.pieces_volume / *expected_.whole - 1.0;
    if (expected_.pieces.empty()) return;
    ledger_.wrong_records = std::abs(static_cast<std::int64_t>(expected_.pieces.size()) -
                                     static_cast<std::int64_t>(pieces_.size()));
    for (std::size_t i = 0; i < std::min(expected_.pieces.size(), pieces_.size()); ++i) {
      if (std::abs(volumes_[i] - expected_.pieces[i]) <=
          kRecordError * std::abs(expected_.pieces[i]) + rounding(pieces_[i]))
        continue;
      ++ledger_.wrong_records;
      if (!pieces_[i].points.empty())
        say(name_of(i) + " holds " + std::to_string(volumes_[i]) + ", its record says " +
                std::to_string(expected_.pieces[i]),
            pieces_[i].points.front());
    }
  }

  /// A bound of how far a piece's volume moves if each coordinate is rounded to single precision.
  static double rounding(const MeshFile& piece) {
    double area = 0.0, greatest = 0.0;
    for (const Triangle& t : TriangleSoup(piece).triangles)
      area += 0.5 *
              (piece.points[t[1]] - piece.points[t[0]]).cross(piece.points[t[2]] - piece.points[t[0]]).norm();
    for (const Vector3d& p : piece.points) greatest = std::max(greatest, p.cwiseAbs().maxCoeff());
    return area * greatest * double(std::numeric_limits<float>::epsilon());
  }

  void judge_rest() {
    ledger_.rest_triangles = static_cast<std::int64_t>(rest_.size());
    Vector3d about = Vector3d::Zero();
    for (const Vector3d& p : points_) about += p / static_cast<double>(points_.size());
    ledger_.rest_volume = volume_of(points_, rest_, about);
    for (const MeshFile& piece : pieces_) {
      volumes_.push_back(volume_of(piece.points, TriangleSoup(piece).triangles, about));
      ledger_.pieces_volume += volumes_.back();
    }
    // Each directed edge counts for its own way, its opposite against it.
    std::vector<std::tuple<std::uint32_t, std::uint32_t, int>> edges;
    for (const Triangle& t : rest_)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        edges.emplace_back(std::min(a, b), std::max(a, b), a < b ? 1 : -1);
      }
    tbb::parallel_sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
      const auto [a, b, ignored] = edges[i];
      int sum = 0;
      for (; i < edges.size() && std::get<0>(edges[i]) == a && std::get<1>(edges[i]) == b; ++i)
        sum += std::get<2>(edges[i]);
      ledger_.rest_open_edges += std::abs(sum);
      if (sum != 0 && ledger_.rest_open_edges < 4) say("the original surface is open", points_[a]);
    }
  }

  /// The solid angle of a piece's triangles, seen from a point, over 4π: 1 inside, 0 outside (van Oosterom &
  /// Strackee 1983).
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

  /// Counts components that lie inside another piece: one point of each component of each piece is tested
  /// against the pieces whose box holds it and that do not have it.
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
    for (const std::int64_t n : nested) ledger_.nested_components += n;
  }

  std::vector<std::vector<std::uint32_t>> components(std::size_t piece) const {
    std::vector<std::uint32_t> parent(pieces_[piece].points.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto find = [&](std::uint32_t a) {
      while (parent[a] != a) a = parent[a] = parent[parent[a]];
      return a;
    };
    std::vector<char> used(parent.size());
    for (const Triangle& t : TriangleSoup(pieces_[piece]).triangles)
      for (int k = 0; k < 3; ++k) used[t[k]] = 1, parent[find(t[k])] = find(t[(k + 1) % 3]);
    std::vector<std::vector<std::uint32_t>> result;
    std::vector<std::size_t> place(parent.size(), parent.size());
    for (std::uint32_t p = 0; p < parent.size(); ++p) {
      if (!used[p]) continue;
      std::size_t& at = place[find(p)];
      if (at == parent.size()) at = result.size(), result.emplace_back();
      result[at].push_back(p);
    }
    return result;
  }

  const std::vector<MeshFile>& pieces_;
  const ExpectedVolumes& expected_;
  RunContext& context_;
  FractureLedger ledger_;
  std::vector<Vector3d> points_;            ///< points of all pieces, no two equal
  std::vector<std::uint32_t> first_point_;  ///< each piece's first place in number_
  std::vector<std::uint32_t> number_;       ///< each piece's points, by their places in points_
  std::vector<Triangle> triangles_, once_, rest_;
  std::vector<double> volumes_;  ///< volume of each piece
  std::vector<Entry> entries_;
};

}  // namespace

double FractureLedger::volume_difference() const {
  const double size = std::max(std::abs(rest_volume), std::abs(pieces_volume));
  return size > 0 ? std::abs(rest_volume - pieces_volume) / size : 0.0;
}

bool FractureLedger::lost_a_piece() const {
  return expected_difference && !(std::abs(*expected_difference) <= kLostPiece);
}

std::vector<std::string> FractureLedger::sentences() const {
  std::vector<std::string> result;
  const auto say = [&](std::int64_t n, const std::string& what) {
    if (n > 0) result.push_back(std::to_string(n) + " " + what + ".");
  };
  if (pieces == 0) result.push_back("There are no pieces.");
  if (!gaps_can_be_judged)
    result.push_back(
        "Pieces lie side by side, and cuts are not tagged: gaps cannot be judged (no triangle's attribute "
        "`surface` is 1).");
  say(broken_pieces, "pieces are not closed, manifold, oriented and free of self-intersections");
  say(unmatched_cut, "cut triangles have no other side");
  say(matched_original, "triangles are tagged original but lie between two pieces");
  say(repeated_triangles, "triangles are repeated and are no seam");
  say(rest_open_edges, "edges are open in the original surface of all pieces together");
  say(intersecting_pairs, "pairs of triangles intersect");
  say(nested_components, "components lie inside another piece");
  if (volume_difference() > 1e-9)
    result.push_back("The pieces' volumes sum to " + std::to_string(pieces_volume) +
                     ", the original surface holds " + std::to_string(rest_volume) + ".");
  if (lost_a_piece())
    result.push_back("The pieces' volumes sum to " + std::to_string(pieces_volume) +
                     ", which is not the uncut object's: they differ by " +
                     std::to_string(100.0 * *expected_difference) + " %.");
  say(wrong_records, "pieces do not hold the volume that was recorded of them");
  if (is_consistent())
    result.push_back((result.empty() ? "The books balance: " : "But for that the books balance: ") +
                     std::to_string(pieces) + " pieces, " + std::to_string(seam_triangles) +
                     " seam triangles, each reversed in one other piece.");
  return result;
}

FractureLedger judge_fracture(const std::vector<MeshFile>& pieces, RunContext& context,
                              const ExpectedVolumes& expected) {
  return Ledger(pieces, expected, context).run();
}

}  // namespace hermesh::validation
