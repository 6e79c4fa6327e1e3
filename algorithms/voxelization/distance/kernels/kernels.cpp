#include "algorithms/voxelization/distance/kernels/kernels.h"

#define HERMESH_WIDEST_VECTORS
#include "algorithms/lattice/simd/vectors.h"

namespace hermesh::kernels {
namespace HERMESH_SIMD_LEVEL {
namespace {

using namespace simd;

/// A triangle whose height is below this, in voxels, is replaced by its longest side: the distance errs by no
/// more, and its normal would be noise.
constexpr double kThin = 1e-6;
/// A grid line that passes this close to a triangle's boundary, in voxels, counts as intersecting it. Far
/// above the rounding of double precision at any coordinate of a grid, far below any visible distance.
constexpr double kOn = 1e-9;

// ---- Grid edges that triangles cross.

/// Integers of 0 … most within [low − kOn, high + kOn].
struct Range {
  int from, to;
  Range(double low, double high, int most) {
    low -= kOn;
    high += kOn;
    if (!(low <= most) || !(high >= 0)) {
      from = 1;
      to = 0;
      return;
    }
    const int floor_low = low <= 0 ? 0 : int(low);
    from = low <= 0 ? 0 : (double(floor_low) < low ? floor_low + 1 : floor_low);
    to = high >= most ? most : int(high);
  }
  bool empty() const { return from > to; }
};

/// Marks the edge at `t` along the axis on grid line (u, v), and both if t is an integer within the
/// tolerance.
inline void mark(EdgeBits& bits, int axis, int u, int v, double t, double tolerance) {
  const Range edges(t - 1.0 - tolerance + kOn, t + tolerance - kOn, 7);
  for (int k = edges.from; k <= edges.to; ++k) {
    int place[3];
    place[axis] = k;
    place[(axis + 1) % 3] = u;
    place[(axis + 2) % 3] = v;
    bits.word[axis][place[0]] |= 1ull << (place[1] * 8 + place[2]);
  }
}

/// Grid lines of 0 … 8 that the boxes of eight triangles reach on one axis: `first` to `last`, none if first
/// > last.
struct LineRange {
  alignas(64) double first[8], last[8];
};

inline unsigned find_lines(const Corners& corners, int axis, int from, LineRange& lines) {
  const Doubles8 a = eight(corners.corner[axis] + from), b = eight(corners.corner[3 + axis] + from),
                 c = eight(corners.corner[6 + axis] + from);
  const Doubles8 on = eight(kOn);
  const Doubles8 low = larger(smaller(smaller(a, b), c) - on, eight(0.0));
  const Doubles8 high = smaller(larger(larger(a, b), c) + on, eight(8.0));
  // Adding and subtracting 1.5 · 2⁵² rounds to an integer; half a unit more or less rounds up or down. A
  // value just beyond half may be rounded too far by one, which the exact test corrects.
  const Doubles8 shift = eight(6755399441055744.0);
  const Doubles8 first = ((low + eight(0.5 - 1e-12)) + shift) - shift,
                 last = ((high - eight(0.5 - 1e-12)) + shift) - shift;
  store(lines.first, first);
  store(lines.last, last);
  return ~less(last, first) & 0xffu;
}

/// Up to eight pairs of a triangle and a grid line along one axis that its box reaches.
struct Candidates {
  alignas(64) double u[3][8], v[3][8], t[3][8];  ///< corners
  alignas(64) double line_u[8], line_v[8];
  int count = 0;

  void add(const Corners& corners, int j, int axis, double at_u, double at_v) {
    const int au = (axis + 1) % 3, av = (axis + 2) % 3;
    for (int i = 0; i < 3; ++i) {
      u[i][count] = corners.corner[3 * i + au][j];
      v[i][count] = corners.corner[3 * i + av][j];
      t[i][count] = corners.corner[3 * i + axis][j];
    }
    line_u[count] = at_u;
    line_v[count++] = at_v;
  }
};

inline Doubles8 magnitude(Doubles8 x) { return larger(x, eight(0.0) - x); }

/// Eight pairs of a triangle and a grid line along one axis; the triangles may all be the same one.
struct EightPairs {
  Doubles8 u[3], v[3], t[3];  ///< corners
  Doubles8 line_u, line_v;
};

void cross_lines(const EightPairs& pairs, unsigned there, int axis, EdgeBits& bits) {
  const Doubles8 *u = pairs.u, *v = pairs.v, *t = pairs.t;
  const Doubles8 area = (u[1] - u[0]) * (v[2] - v[0]) - (v[1] - v[0]) * (u[2] - u[0]), size = magnitude(area);
  const Doubles8 on = eight(kOn);
  Doubles8 w[3], longest = eight(0.0);
  unsigned outside = 0;
  for (int i = 0; i < 3; ++i) {
    // Opposite corner i. The sign is exactly opposite for the reversed edge, so no line is outside of both
    // triangles that share it.
    const int a = (i + 1) % 3, b = (i + 2) % 3;
    w[i] = (u[a] - pairs.line_u) * (v[b] - pairs.line_v) - (v[a] - pairs.line_v) * (u[b] - pairs.line_u);
    const Doubles8 length = magnitude(u[b] - u[a]) + magnitude(v[b] - v[a]);
    longest = larger(longest, length);
    outside |= less(w[i] * area, eight(0.0) - on * length * size);
  }
  // Seen edge-on, thinner than the tolerance: its neighbours take the lines through it.
  unsigned inside = ~outside & less(on * longest, size) & there;
  if (!inside) return;
  const Doubles8 low = smaller(smaller(t[0], t[1]), t[2]), high = larger(larger(t[0], t[1]), t[2]);
  const Doubles8 met = (w[0] * t[0] + w[1] * t[1] + w[2] * t[2]) / (w[0] + w[1] + w[2]);
  // A line that only touches the triangle within the tolerance may intersect the plane anywhere. Rounding of
  // an edge function, some 1e-15 longest², moves the hit by its share of the area.
  alignas(64) double hit[8], tolerance[8], line_u[8], line_v[8];
  store(hit, smaller(larger(met, low), high));
  store(tolerance, on + eight(4e-15) * longest * longest / size * (high - low));
  store(line_u, pairs.line_u);
  store(line_v, pairs.line_v);
  for (; inside; inside &= inside - 1) {
    const int k = __builtin_ctz(inside);
    mark(bits, axis, int(line_u[k]), int(line_v[k]), hit[k], tolerance[k]);
  }
}

void cross_candidates(Candidates& candidates, int axis, EdgeBits& bits) {
  EightPairs pairs;
  for (int i = 0; i < 3; ++i) {
    pairs.u[i] = eight(candidates.u[i]);
    pairs.v[i] = eight(candidates.v[i]);
    pairs.t[i] = eight(candidates.t[i]);
  }
  pairs.line_u = eight(candidates.line_u);
  pairs.line_v = eight(candidates.line_v);
  const unsigned there = (1u << candidates.count) - 1;
  candidates.count = 0;
  cross_lines(pairs, there, axis, bits);
}

/// The grid lines along one axis, of 0 … 7 on each of the others, that a triangle's box reaches.
struct LineWindow {
  double first_u, last_u, first_v, last_v;
  double count() const { return (last_u - first_u + 1) * (last_v - first_v + 1); }
};

/// Marks the edges along one axis that a large triangle crosses, a row of lines at a time.
void cross_rows(const Corners& corners, int j, int axis, const LineWindow& box, EdgeBits& bits) {
  alignas(64) static constexpr double kColumns[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  EightPairs pairs;
  for (int i = 0; i < 3; ++i) {
    pairs.u[i] = eight(corners.corner[3 * i + (axis + 1) % 3][j]);
    pairs.v[i] = eight(corners.corner[3 * i + (axis + 2) % 3][j]);
    pairs.t[i] = eight(corners.corner[3 * i + axis][j]);
  }
  pairs.line_v = eight(kColumns);
  const unsigned there = (0xffu << int(box.first_v)) & (0xffu >> (7 - int(box.last_v)));
  for (double row = box.first_u; row <= box.last_u; ++row) {
    pairs.line_u = eight(row);
    cross_lines(pairs, there, axis, bits);
  }
}

void cross(const Corners& corners, int count, EdgeBits& bits) {
  Candidates candidates[3];
  for (int from = 0; from < count; from += 8) {
    LineRange lines[3];
    unsigned reaches[3];
    for (int axis = 0; axis < 3; ++axis) reaches[axis] = find_lines(corners, axis, from, lines[axis]);
    const unsigned there = count - from < 8 ? (1u << (count - from)) - 1 : 0xffu;
    for (int axis = 0; axis < 3; ++axis) {
      const LineRange &u = lines[(axis + 1) % 3], &v = lines[(axis + 2) % 3];
      for (unsigned both = reaches[(axis + 1) % 3] & reaches[(axis + 2) % 3] & there; both;
           both &= both - 1) {
        const int j = __builtin_ctz(both);
        // The lines at 8 belong to the next leaf.
        const LineWindow box{u.first[j], u.last[j] < 7 ? u.last[j] : 7, v.first[j],
                             v.last[j] < 7 ? v.last[j] : 7};
        if (box.first_u > 7 || box.first_v > 7) continue;
        if (box.count() > 8) {
          cross_rows(corners, from + j, axis, box, bits);
          continue;
        }
        for (double at_u = box.first_u; at_u <= box.last_u; ++at_u)
          for (double at_v = box.first_v; at_v <= box.last_v; ++at_v) {
            candidates[axis].add(corners, from + j, axis, at_u, at_v);
            if (candidates[axis].count == 8) cross_candidates(candidates[axis], axis, bits);
          }
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis)
    if (candidates[axis].count > 0) cross_candidates(candidates[axis], axis, bits);
}

// ---- Distances.

/// Positions of the 16 lanes of a 2×2×4 block relative to its centre, and the centres of the 32 blocks.
struct Positions {
  alignas(64) float lane[3][16];
  alignas(64) float centre[3][32];
};

constexpr Positions make_positions() {
  Positions p{};
  for (int i = 0; i < 16; ++i) {
    p.lane[0][i] = float(i >> 3) - 0.5f;
    p.lane[1][i] = float(i >> 2 & 1) - 0.5f;
    p.lane[2][i] = float(i & 3) - 1.5f;
  }
  for (int i = 0; i < 32; ++i) {
    p.centre[0][i] = float(2 * (i >> 3)) + 0.5f;
    p.centre[1][i] = float(2 * (i >> 1 & 3)) + 0.5f;
    p.centre[2][i] = float(4 * (i & 1)) + 1.5f;
  }
  return p;
}

constexpr Positions kPositions = make_positions();

/// Half the diagonal of a block's voxels, √(0.5² + 0.5² + 1.5²), rounded up.
constexpr float kBlockRadius = 1.6584f;

/// The seven linear functions of a triangle at 16 points.
struct Functions {
  Floats16 height, across[3], along[3];
};

/// Returns the squared distances from 16 points to a triangle by its functions (see Batch): to its plane
/// above the triangle, and to its nearest edge elsewhere.
inline Floats16 squared_distance(const Functions& at, const Floats16* low, const Floats16* high) {
  Floats16 nearest;
  for (int i = 0; i < 3; ++i) {
    const Floats16 beyond = at.along[i] - smaller(larger(at.along[i], low[i]), high[i]);
    const Floats16 squared = at.across[i] * at.across[i] + beyond * beyond;
    nearest = i == 0 ? squared : smaller(nearest, squared);
  }
  // Beyond any edge the nearest edge counts; within all three, only the height.
  const Floats16 outside = larger(larger(at.across[0], at.across[1]), at.across[2]);
  return at.height * at.height + kept_unless_negative(outside, nearest);
}

/// One triangle of a batch, its coefficients in all lanes.
struct Broadcast {
  Floats16 height[4], across[3][4], along[3][3], low[3], high[3];

  Broadcast(const Batch& batch, int j) {
    for (int k = 0; k < 4; ++k) height[k] = sixteen(batch.f[Batch::kHeight + k][j]);
    for (int i = 0; i < 3; ++i) {
      const float(*edge)[kBatch] = batch.f + Batch::kEdge + Batch::kPerEdge * i;
      for (int k = 0; k < 4; ++k) across[i][k] = sixteen(edge[k][j]);
      for (int k = 0; k < 3; ++k) along[i][k] = sixteen(edge[Batch::kAlong + k][j]);
      low[i] = sixteen(edge[Batch::kLow][j]);
      high[i] = sixteen(edge[Batch::kHigh][j]);
    }
  }
};

inline Floats16 dot(const Floats16* g, Floats16 x, Floats16 y, Floats16 z) {
  return g[0] * x + g[1] * y + g[2] * z;
}

/// Returns the functions without their constant parts, which a lane adds to the values at its block's centre.
inline Functions linear_parts(const Broadcast& t, const float (*place)[16]) {
  const Floats16 x = sixteen(place[0]), y = sixteen(place[1]), z = sixteen(place[2]);
  Functions f;
  f.height = dot(t.height, x, y, z);
  for (int i = 0; i < 3; ++i) {
    f.across[i] = dot(t.across[i], x, y, z);
    f.along[i] = dot(t.along[i], x, y, z);
  }
  return f;
}

/// Returns the functions at the centres of one half of the 32 blocks.
inline Functions at_centres(const Broadcast& t, int half) {
  const Floats16 x = sixteen(kPositions.centre[0] + 16 * half), y = sixteen(kPositions.centre[1] + 16 * half),
                 z = sixteen(kPositions.centre[2] + 16 * half);
  Functions f;
  f.height = dot(t.height, x, y, z) + t.height[3];
  for (int i = 0; i < 3; ++i) {
    f.across[i] = dot(t.across[i], x, y, z) + t.across[i][3];
    f.along[i] = dot(t.along[i], x, y, z);
  }
  return f;
}

/// The functions at the blocks' centres.
struct CentreValues {
  alignas(64) float height[32], across[3][32], along[3][32];
};

/// Lowers the distances of a block's voxels by one triangle. The functions are linear, so each is one
/// addition per voxel: the value at the block's centre plus that of the lane.
template <bool ids>
inline void update_block(const CentreValues& centre, const Functions& lane, const Broadcast& t, int block,
                         Ints id, Distances& distances) {
  Functions at;
  at.height = lane.height + sixteen(centre.height[block]);
  for (int i = 0; i < 3; ++i) {
    at.across[i] = lane.across[i] + sixteen(centre.across[i][block]);
    at.along[i] = lane.along[i] + sixteen(centre.along[i][block]);
  }
  const Floats16 squared = squared_distance(at, t.low, t.high);
  float* best = distances.squared + 16 * block;
  const Floats16 before = sixteen(best);
  if constexpr (ids) {
    for (int i = 0; i < Floats16::kRegisters; ++i) {
      std::int32_t* at_id = distances.id + 16 * block + kLanes * i;
      store(at_id, squared.r[i] < before.r[i] ? id : load(at_id));
    }
  }
  store(best, smaller(squared, before));
}

/// Lowers the distances by the triangles of a batch, one after the other. Only blocks whose centre is within
/// the reach plus half a block's diagonal have a voxel within reach.
template <bool ids>
void update_with(const Batch& batch, int count, float reach, Distances& distances) {
  const Floats16 limit = sixteen((reach + kBlockRadius) * (reach + kBlockRadius));
  for (int j = 0; j < count; ++j) {
    const Broadcast t(batch, j);
    CentreValues centre;
    unsigned blocks = 0;
    for (int half = 0; half < 2; ++half) {
      const Functions f = at_centres(t, half);
      blocks |= less(squared_distance(f, t.low, t.high), limit) << (16 * half);
      store(centre.height + 16 * half, f.height);
      for (int i = 0; i < 3; ++i) {
        store(centre.across[i] + 16 * half, f.across[i]);
        store(centre.along[i] + 16 * half, f.along[i]);
      }
    }
    if (!blocks) continue;
    const Functions lane = linear_parts(t, kPositions.lane);
    const Ints id = all(batch.id[j]);
    for (; blocks; blocks &= blocks - 1)
      update_block<ids>(centre, lane, t, __builtin_ctz(blocks), id, distances);
  }
}

void update(const Batch& batch, int count, float reach, bool ids, Distances& distances) {
  if (ids)
    update_with<true>(batch, count, reach, distances);
  else
    update_with<false>(batch, count, reach, distances);
}

// ---- Fetching.

/// Finds the triangles whose boxes come within reach of the leaf's samples, and those within a voxel of them,
/// by boxes in single precision that are widened by the largest rounding error.
Near near(const MeshCorners& corners, const LeafFrame& frame, float reach) {
  // Single precision errs by a few parts in ten million of the operands.
  float margin = 16.0f + reach;
  for (int axis = 0; axis < 3; ++axis)
    margin += float(frame.origin[axis] < 0 ? -frame.origin[axis] : frame.origin[axis]);
  margin *= 1e-6f;
  const Floats16 scale = sixteen(float(frame.scale)), zero = sixteen(0.0f);
  Floats16 gap2 = zero, farthest = zero;
  for (int axis = 0; axis < 3; ++axis) {
    const Floats16 origin = sixteen(float(frame.origin[axis]));
    const Floats16 a = sixteen(corners.corner[axis]), b = sixteen(corners.corner[3 + axis]),
                   c = sixteen(corners.corner[6 + axis]);
    const Floats16 low = smaller(smaller(a, b), c) * scale - origin,
                   high = larger(larger(a, b), c) * scale - origin;
    // How far the box is from the leaf's samples, which are 0 to 7, along this axis.
    const Floats16 gap = larger(larger(low - sixteen(7.0f), zero - high), zero);
    gap2 = gap2 + gap * gap;
    farthest = larger(farthest, gap);
  }
  // The edges that a leaf owns end a voxel beyond it.
  return {less(gap2, sixteen((reach + margin) * (reach + margin))), less(farthest, sixteen(1.0f + margin))};
}

/// In double precision, for a mesh's coordinates may be large compared with a voxel; relative to the leaf
/// they are small, and may be rounded to single precision later.
void to_leaf(const MeshCorners& from, const LeafFrame& frame, Corners& to) {
  const Doubles8 scale = eight(frame.scale);
  for (int i = 0; i < 9; ++i) {
    const Doubles8 origin = eight(frame.origin[i % 3]);
    for (int first = 0; first < kBatch; first += 8)
      store(to.corner[i] + first, eight(from.corner[i] + first) * scale - origin);
  }
}

// ---- Setting up.

struct Vector {
  Doubles8 x, y, z;
};

inline Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator*(const Vector& a, Doubles8 s) { return {a.x * s, a.y * s, a.z * s}; }
inline Doubles8 dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector cross_product(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline void put(float (*at)[kBatch], int first, const Vector& v) {
  store_rounded(at[0] + first, v.x);
  store_rounded(at[1] + first, v.y);
  store_rounded(at[2] + first, v.z);
}

/// Coefficients in double precision, rounded once. Division by a length of 0 gives values that are not
/// finite; such a triangle is reported as thin, and the caller sets its lane up as a segment.
unsigned set_up(const Corners& corners, Batch& batch) {
  unsigned thin = 0;
  for (int first = 0; first < kBatch; first += 8) {
    Vector corner[3];
    for (int i = 0; i < 3; ++i)
      corner[i] = {eight(corners.corner[3 * i] + first), eight(corners.corner[3 * i + 1] + first),
                   eight(corners.corner[3 * i + 2] + first)};
    const Vector side[3] = {corner[1] - corner[0], corner[2] - corner[1], corner[0] - corner[2]};
    const Vector area = cross_product(side[0], corner[2] - corner[0]);
    const Doubles8 squared = dot(area, area);
    Doubles8 length2[3];
    for (int i = 0; i < 3; ++i) length2[i] = dot(side[i], side[i]);
    const Doubles8 longest2 = larger(larger(length2[0], length2[1]), length2[2]);
    // Twice the area over the longest side is the height.
    thin |= (~less(longest2 * eight(kThin * kThin), squared) & 0xffu) << first;
    const Vector normal = area * (eight(1.0) / square_root(squared));
    put(batch.f + Batch::kHeight, first, normal);
    store_rounded(batch.f[Batch::kHeight + 3] + first, eight(0.0) - dot(normal, corner[0]));
    for (int i = 0; i < 3; ++i) {
      float(*edge)[kBatch] = batch.f + Batch::kEdge + Batch::kPerEdge * i;
      const Doubles8 length = square_root(length2[i]);
      const Vector along = side[i] * (eight(1.0) / length);
      const Vector across = cross_product(along, normal);
      const Doubles8 low = dot(along, corner[i]);
      put(edge, first, across);
      store_rounded(edge[3] + first, eight(0.0) - dot(across, corner[i]));
      put(edge + Batch::kAlong, first, along);
      store_rounded(edge[Batch::kLow] + first, low);
      store_rounded(edge[Batch::kHigh] + first, low + length);
    }
  }
  return thin;
}

// ---- Many small triangles.

/// Returns the squared distance from a point to each of 16 boxes, rounded down to be a lower bound.
inline Floats16 squared_distance(const Boxes& boxes, const Floats16* place) {
  Floats16 sum = sixteen(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    const Floats16 below = sixteen(boxes.side[axis][0]) - place[axis];
    const Floats16 above = place[axis] - sixteen(boxes.side[axis][1]);
    const Floats16 gap = larger(larger(below, above), sixteen(0.0f));
    sum = sum + gap * gap;
  }
  return sum * sixteen(0.99999f);
}

/// Returns the squared distances of one point to the 16 triangles of a batch.
inline Floats16 squared_distance(const Batch& batch, const Floats16* place) {
  const auto value = [&](int k) {
    return sixteen(batch.f[k]) * place[0] + sixteen(batch.f[k + 1]) * place[1] +
           sixteen(batch.f[k + 2]) * place[2];
  };
  Functions at;
  Floats16 low[3], high[3];
  at.height = value(Batch::kHeight) + sixteen(batch.f[Batch::kHeight + 3]);
  for (int i = 0; i < 3; ++i) {
    const int edge = Batch::kEdge + Batch::kPerEdge * i;
    at.across[i] = value(edge) + sixteen(batch.f[edge + 3]);
    at.along[i] = value(edge + Batch::kAlong);
    low[i] = sixteen(batch.f[edge + Batch::kLow]);
    high[i] = sixteen(batch.f[edge + Batch::kHigh]);
  }
  return squared_distance(at, low, high);
}

/// Returns a batch, which is set up when it is first needed: most of many small triangles never are.
inline const Batch& prepared(const LazyBatches& lazy, int b) {
  if (!lazy.batches[b]) lazy.batches[b] = lazy.prepare(lazy.context, b);
  return *lazy.batches[b];
}

/// Lowers `best`, a squared distance, to that of the batch's nearest triangle, and returns its lane; −1 if
/// none is nearer.
inline int lower(const Batch& batch, const Floats16* place, float& best) {
  const Floats16 found = squared_distance(batch, place);
  unsigned nearer = less(found, sixteen(best));
  int lane = -1;
  if (!nearer) return lane;
  alignas(64) float squared[16];
  store(squared, found);
  for (; nearer; nearer &= nearer - 1) {
    const int i = __builtin_ctz(nearer);
    if (squared[i] < best) {
      best = squared[i];
      lane = i;
    }
  }
  return lane;
}

inline void set_place(Floats16* place, float x, float y, float z) {
  place[0] = sixteen(x);
  place[1] = sixteen(y);
  place[2] = sixteen(z);
}

/// Returns the batch with the triangle nearest to a point, and lowers `best` to its squared distance; −1 if
/// none is nearer than `best`. `guess` is searched first.
int nearest_batch(const LazyBatches& lazy, const Floats16* place, int guess, float& best) {
  int nearest = guess >= 0 && lower(prepared(lazy, guess), place, best) >= 0 ? guess : -1;
  for (int first = 0; first < lazy.count; first += kBatch) {
    const Floats16 bound = squared_distance(lazy.boxes[first / kBatch], place);
    unsigned near = less(bound, sixteen(best));
    if (!near) continue;
    alignas(64) float bounds[16];
    store(bounds, bound);
    // `best` decreases from batch to batch, so each bound is checked again before its batch is searched.
    for (; near; near &= near - 1) {
      const int i = __builtin_ctz(near);
      if (bounds[i] < best && lower(prepared(lazy, first + i), place, best) >= 0) nearest = first + i;
    }
  }
  return nearest;
}

/// The 16 voxels of a block and their nearest triangles so far.
struct BlockSearch {
  Floats16 place[3];
  alignas(64) float best[16];
  alignas(64) int id[16];

  BlockSearch(const Distances& distances, int block, float reach) {
    for (int a = 0; a < 3; ++a) place[a] = sixteen(kPositions.centre[a][block]) + sixteen(kPositions.lane[a]);
    store(best, smaller(sixteen(distances.squared + 16 * block), sixteen(reach * reach)));
    for (int i = 0; i < 16; ++i) id[i] = -1;
  }

  /// Searches the batch from every voxel that is near enough to its box.
  [[gnu::always_inline]] void look_into(const LazyBatches& lazy, int b) {
    const Boxes& boxes = lazy.boxes[b / kBatch];
    Floats16 sum = sixteen(0.0f);
    for (int a = 0; a < 3; ++a) {
      const Floats16 gap = larger(larger(sixteen(boxes.side[a][0][b % kBatch]) - place[a],
                                         place[a] - sixteen(boxes.side[a][1][b % kBatch])),
                                  sixteen(0.0f));
      sum = sum + gap * gap;
    }
    unsigned near = less(sum * sixteen(0.99999f), sixteen(best));
    if (!near) return;
    const Batch& batch = prepared(lazy, b);
    // One voxel after the other, each against the 16 triangles of the batch at once.
    alignas(64) float x[16], y[16], z[16];
    store(x, place[0]);
    store(y, place[1]);
    store(z, place[2]);
    for (; near; near &= near - 1) {
      const int i = __builtin_ctz(near);
      Floats16 voxel[3];
      set_place(voxel, x[i], y[i], z[i]);
      if (const int lane = lower(batch, voxel, best[i]); lane >= 0) id[i] = batch.id[lane];
    }
  }

  /// Writes the voxels back to which a triangle of these batches is nearer.
  void save(Distances& distances, int block, bool ids) const {
    for (int i = 0; i < 16; ++i) {
      if (id[i] < 0) continue;
      distances.squared[16 * block + i] = best[i];
      if (ids) distances.id[16 * block + i] = id[i];
    }
  }
};

/// Searches the batches whose boxes are at a distance of `from` to `to` from a point, except one.
inline void look_around(const LazyBatches& lazy, const Floats16* place, float from, float to, int except,
                        BlockSearch& search) {
  const Floats16 low = sixteen(from * from), high = sixteen(to * to);
  for (int first = 0; first < lazy.count; first += kBatch) {
    const Floats16 squared = squared_distance(lazy.boxes[first / kBatch], place);
    for (unsigned in = less(squared, high) & ~less(squared, low); in; in &= in - 1) {
      const int b = first + __builtin_ctz(in);
      if (b != except) search.look_into(lazy, b);
    }
  }
}

/// Searches block by block of 16 voxels, so that a batch serves all voxels of a block while it is in the
/// cache.
void update_from_many(const LazyBatches& lazy, float reach, bool ids, Distances& distances) {
  // The previous block is adjacent, so its nearest batch is a good first guess.
  int guess = -1;
  for (int block = 0; block < 32; ++block) {
    Floats16 centre[3];
    set_place(centre, kPositions.centre[0][block], kPositions.centre[1][block], kPositions.centre[2][block]);
    const float far = reach + kBlockRadius;
    float best = far * far;
    const int nearest = nearest_batch(lazy, centre, guess, best);
    if (nearest < 0) continue;  // no triangle within the reach of any voxel of this block
    guess = nearest;
    BlockSearch search(distances, block, reach);
    search.look_into(lazy, nearest);
    // A triangle that is nearest to some voxel is at most a diagonal farther from the centre than the nearest
    // one. The likeliest first, so that fewer of the others are searched.
    const float first_radius = __builtin_sqrtf(best) + 0.5f,
                radius = __builtin_sqrtf(best) + 2.0f * kBlockRadius + 1e-4f;
    look_around(lazy, centre, 0.0f, first_radius, nearest, search);
    look_around(lazy, centre, first_radius, radius, nearest, search);
    search.save(distances, block, ids);
  }
}

// ---- The finished leaf.

/// Converts to distances in world units, in the order of OpenVDB's leaves; voxels out of reach get the reach.
/// Returns true if any voxel is within reach.
bool finish(const Distances& distances, float reach, float scale, float* values, std::uint64_t* active) {
  const Floats16 limit = sixteen(reach * reach);
  for (int x = 0; x < 8; ++x) active[x] = 0;
  std::uint64_t any = 0;
  for (int block = 0; block < 32; ++block) {
    const Floats16 squared = sixteen(distances.squared + 16 * block);
    // A block has four rows of four voxels along z.
    const std::uint64_t bits = less(squared, limit);
    alignas(64) float lanes[16];
    store(lanes, square_root(smaller(squared, limit)) * sixteen(scale));
    const int x = 2 * (block >> 3), y = 2 * (block >> 1 & 3), z = 4 * (block & 1);
    for (int row = 0; row < 4; ++row) {
      const int line = (y + (row & 1)) * 8 + z;
      __builtin_memcpy(values + (x + (row >> 1)) * 64 + line, lanes + 4 * row, 16);
      active[x + (row >> 1)] |= (bits >> (4 * row) & 15u) << line;
    }
    any |= bits;
  }
  return any != 0;
}

/// Signs each voxel, limits it to the band of its side, and deactivates those beyond.
void apply_signs(const std::uint64_t* inside, float exterior, float interior, float least, float* values,
                 std::uint64_t* active) {
  for (int x = 0; x < 8; ++x) {
    std::uint64_t below = 0;
    for (int part = 0; part < 64; part += 16) {
      const unsigned negative = unsigned(inside[x] >> part) & 0xffffu;
      float* at = values + 64 * x + part;
      const Floats16 limit = choose(negative, sixteen(interior), sixteen(exterior));
      const Floats16 distance = sixteen(at);
      const unsigned in_band = less(distance, limit) & (active[x] >> part) & 0xffffu;
      below |= std::uint64_t(in_band) << part;
      // Voxels beyond get exactly the width, as tiles do: rounding may have left less.
      const Floats16 value = choose(in_band, distance, limit);
      // Inside is negative even where the distance is 0, so that the sample keeps its side.
      store(at, choose(negative, sixteen(0.0f) - larger(value, sixteen(least)), value));
    }
    active[x] = below;
  }
}

constexpr Kernels kKernels = {kLevel,           near,  to_leaf, set_up,     update,
                              update_from_many, cross, finish,  apply_signs};

}  // namespace
}  // namespace HERMESH_SIMD_LEVEL

constinit const Kernels Kernels::HERMESH_SIMD_LEVEL = HERMESH_SIMD_LEVEL::kKernels;

}  // namespace hermesh::kernels
