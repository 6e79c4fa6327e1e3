#include "reference/cgal_surface_mesher.h"

#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Random.h>
#include <CGAL/Surface_mesh_default_criteria_3.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/Surface_mesher_generator.h>
#include <CGAL/make_surface_mesh.h>
#include <openvdb/tools/Interpolation.h>

#include <unordered_map>

#include "algorithms/core/level_set_grid.h"
#include "reference/isosurface_seeds.h"
#include "reference/meshing_frame.h"

namespace hermesh {
namespace {

/// Numbers the triangulation's vertices and cells in the order of their making. CGAL then compares handles by
/// number instead of by address, and the same input gives the same mesh.
template <class Base>
class Numbered : public Base {
 public:
  template <class Structure>
  struct Rebind_TDS {
    using Other = Numbered<typename Base::template Rebind_TDS<Structure>::Other>;
  };
  using Has_timestamp = CGAL::Tag_true;
  using Base::Base;
  std::size_t time_stamp() const { return number_; }
  void set_time_stamp(const std::size_t& number) { number_ = number; }

 private:
  std::size_t number_ = std::size_t(-1);
};

// CGAL's Surface_mesh_default_triangulation_3, numbered.
using Traits = CGAL::Robust_circumcenter_traits_3<CGAL::Exact_predicates_inexact_constructions_kernel>;
using Vertex = Numbered<CGAL::Surface_mesh_vertex_base_3<Traits>>;
using Cell = Numbered<CGAL::Delaunay_triangulation_cell_base_with_circumcenter_3<
    Traits, CGAL::Surface_mesh_cell_base_3<Traits>>>;
using Triangulation =
    CGAL::Delaunay_triangulation_3<Traits, CGAL::Triangulation_data_structure_3<Vertex, Cell>>;
using Complex = CGAL::Complex_2_in_triangulation_3<Triangulation>;
using Kernel = Triangulation::Geom_traits;
using Point = Kernel::Point_3;
using Surface = CGAL::Implicit_surface_3<Kernel, std::function<double(Point)>>;

/// Points are rounded to the output's precision before they enter the triangulation, so that the output is
/// exactly the triangulation that the predicates evaluated.
Point rounded(double x, double y, double z) { return {double(float(x)), double(float(y)), double(float(z))}; }

struct RoundNewPoints {
  void new_point(Point& p) const { p = rounded(p.x(), p.y(), p.z()); }
};
using Oracle = CGAL::Surface_mesher::Implicit_surface_oracle_3<
    Kernel, Surface, CGAL::Real_embeddable_traits<double>::Sgn, CGAL::Surface_mesher::Return_min<CGAL::Sign>,
    CGAL::Creator_uniform_3<double, Point>, RoundNewPoints>;

/// The trilinear interpolation of a grid at points relative to the frame's origin.
class Field {
 public:
  Field(const openvdb::FloatGrid& grid, const MeshingFrame& frame, double isovalue, const RunContext& context)
      : values_(grid.getConstAccessor()),
        transform_(frame.transform),
        isovalue_(isovalue),
        inside_is_above_(frame.inside_is_above),
        context_(context) {}

  /// The side of a point, −1 inside and 1 elsewhere: there is no third side of points exactly on the surface.
  double side(const Point& p) {
    if (++calls_ % 1024 == 0) context_.check();
    float value = 0.0f;
    openvdb::tools::BoxSampler::sample(values_, transform_->worldToIndex({p.x(), p.y(), p.z()}), value);
    const bool inside = inside_is_above_ ? double(value) > isovalue_ : double(value) < isovalue_;
    return inside ? -1.0 : 1.0;
  }

 private:
  openvdb::FloatGrid::ConstAccessor values_;
  openvdb::math::Transform::ConstPtr transform_;
  double isovalue_;
  bool inside_is_above_;
  const RunContext& context_;
  std::uint64_t calls_ = 0;
};

/// CGAL's standard criteria, except that a facet far below a voxel is good in any shape. The trilinear
/// interpolation has creases between cells, at which the angle bound alone would ask for ever smaller facets.
class Criteria {
 public:
  using Standard = CGAL::Surface_mesh_default_criteria_3<Triangulation>;
  using Quality = Standard::Quality;
  Criteria(const Options& options, double voxel)
      : standard_(options.number("angle_bound"), options.number("facet_size") * voxel,
                  options.number("facet_distance") * voxel),
        smallest_squared_(0.01 * voxel * voxel) {}

  bool is_bad(const Triangulation::Facet& facet, Quality& quality) const {
    const bool bad = standard_.is_bad(facet, quality);
    const Point& centre = facet.first->get_facet_surface_center(facet.second);
    return bad && CGAL::squared_distance(centre, facet.first->vertex((facet.second + 1) & 3)->point()) >
                      smallest_squared_;
  }

 private:
  Standard standard_;
  double smallest_squared_;
};
using Mesher = CGAL::Surface_mesher_generator<Complex, Oracle, Criteria, CGAL::Manifold_tag>::Type;

/// CGAL prints its failures to the terminal before it throws; here they become an Error.
class QuietCgal {
 public:
  QuietCgal()
      : previous_(CGAL::set_error_handler([](const char*, const char*, const char*, int, const char*) {})) {}
  ~QuietCgal() { CGAL::set_error_handler(previous_); }
  QuietCgal(const QuietCgal&) = delete;
  QuietCgal& operator=(const QuietCgal&) = delete;

 private:
  CGAL::Failure_function previous_;
};

Kernel::Sphere_3 bounding_sphere(const openvdb::FloatGrid& grid, const MeshingFrame& frame) {
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  box.expand(2);
  const openvdb::BBoxd world = frame.transform->indexToWorld(box);
  const openvdb::Vec3d centre = world.getCenter();
  return {Point(centre.x(), centre.y(), centre.z()), 0.26 * world.extents().lengthSqr()};
}

void insert_seeds(Triangulation& triangulation, const openvdb::FloatGrid& grid, const MeshingFrame& frame,
                  const ExtractionInput& input) {
  std::vector<Point> points;
  const int spacing = std::max(1, int(input.options.number("seed_spacing")));
  for (const openvdb::Vec3d& seed : isosurface_seeds(grid, input.isovalue, spacing)) {
    const openvdb::Vec3d p = frame.transform->indexToWorld(seed);
    points.push_back(rounded(p.x(), p.y(), p.z()));
  }
  input.context.check();
  CGAL::get_default_random() = CGAL::Random(0);  // it shuffles the order of insertion
  triangulation.insert(points.begin(), points.end());
}

void refine(Mesher& mesher, const Triangulation& triangulation, const ExtractionInput& input) {
  const auto limit = std::size_t(input.options.number("max_points"));
  mesher.init();
  CGAL::Null_mesh_visitor visitor;
  std::size_t steps = 0;
  while (!mesher.is_algorithm_done()) {
    mesher.one_step(visitor);
    if (++steps % 256 == 0) input.context.check();
    if (triangulation.number_of_vertices() > limit || steps > 4 * limit)
      throw Error("cgal-surface-mesher: the refinement did not end within max_points=" +
                  std::to_string(limit) + "; raise it, or choose a larger facet_size or facet_distance.");
  }
}

/// Returns true if the cell on this side of the facet is inside. An infinite cell has no side of its own and
/// counts as the opposite of the cell beyond the facet.
bool cell_inside(const Triangulation& triangulation, const Triangulation::Facet& facet, Field& field) {
  if (!triangulation.is_infinite(facet.first)) return field.side(triangulation.dual(facet.first)) < 0.0;
  return !(field.side(triangulation.dual(triangulation.mirror_facet(facet).first)) < 0.0);
}

PolygonMesh to_mesh(const Complex& complex, Field& field) {
  const Triangulation& triangulation = complex.triangulation();
  PolygonMesh mesh;
  // Looked up only: the order of the points is that of their first use.
  std::unordered_map<const void*, std::uint32_t> number;
  for (auto facet = complex.facets_begin(); facet != complex.facets_end(); ++facet) {
    Triangulation::Facet side = *facet;
    if (triangulation.is_infinite(side.first)) side = triangulation.mirror_facet(side);
    std::array<Triangulation::Vertex_handle, 3> corners;
    for (int i = 0; i < 3; ++i) corners[i] = side.first->vertex((side.second + 1 + i) & 3);
    const bool normal_into_cell =
        CGAL::orientation(corners[0]->point(), corners[1]->point(), corners[2]->point(),
                          side.first->vertex(side.second)->point()) == CGAL::POSITIVE;
    if (normal_into_cell == cell_inside(triangulation, side, field)) std::swap(corners[1], corners[2]);
    Triangle triangle{};
    for (int i = 0; i < 3; ++i) {
      const auto [entry, is_new] = number.try_emplace(&*corners[i], std::uint32_t(mesh.points.size()));
      const Point& p = corners[i]->point();
      if (is_new) mesh.points.emplace_back(float(p.x()), float(p.y()), float(p.z()));
      triangle[i] = entry->second;
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace

PolygonMesh cgal_surface_mesher(const ExtractionInput& input) {
  const Stage stage(input.context, "extraction");
  const openvdb::FloatGrid& grid = *input.level_set.grid().grid;
  const MeshingFrame frame = meshing_frame(grid, input.isovalue);
  PolygonMesh mesh;
  if (grid.tree().activeVoxelCount() == 0) return mesh;

  const QuietCgal quiet;
  try {
    Field field(grid, frame, input.isovalue, input.context);
    const double voxel = input.level_set.voxel_size();
    const Kernel::Sphere_3 sphere = bounding_sphere(grid, frame);
    // Crossings are found by bisection to a thousandth of a voxel; CGAL wants that relative to the sphere's
    // radius.
    const double tolerance = 1e-3 * voxel / std::sqrt(sphere.squared_radius());
    const Surface surface([&field](const Point& p) { return field.side(p); }, sphere, tolerance);
    const Oracle oracle;
    const Criteria criteria(input.options, voxel);
    Triangulation triangulation;
    insert_seeds(triangulation, grid, frame, input);
    if (triangulation.number_of_vertices() > 0 && triangulation.dimension() < 3)
      throw Error(
          "cgal-surface-mesher: the surface crosses the grid's edges in too few points; try smaller voxels, "
          "or "
          "another extractor");
    if (triangulation.number_of_vertices() == 0) return mesh;
    Complex complex(triangulation);
    Mesher mesher(complex, surface, oracle, criteria);
    refine(mesher, triangulation, input);
    mesh = to_mesh(complex, field);
    // Its facets are those that a segment between two cells' centres pierces once; both ends of such a
    // segment lie outside where the solid is thin against the distances of the points.
    if (mesh.triangles.empty())
      throw Error(
          "cgal-surface-mesher: none of its triangles separates inside from outside: the solid is thinner "
          "than "
          "its points are apart; try -o seed_spacing=1 and a smaller facet_size, or another extractor");
  } catch (const CGAL::Failure_exception& failure) {
    std::string reason = failure.message();
    reason.resize(reason.find_last_not_of(". \n") + 1);
    throw Error("cgal-surface-mesher: CGAL gave up (" + reason +
                "); try a larger facet_size or facet_distance.");
  }
  mesh.origin = frame.origin;
  return mesh;
}

}  // namespace hermesh
