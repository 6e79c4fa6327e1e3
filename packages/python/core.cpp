// The extension module hermesh._core: the public C++ functions except validation, which is in another module
// because of its licence. hermesh/__init__.py wraps both.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>

#include "hermesh/hermesh.h"
#include "packages/python/arrays.h"
#include "packages/python/watch.h"

namespace hermesh::python {
namespace {

// ---- Meshes.

/// Returns the indices of three or four points per polygon from an array. Arrays of 32 bits are not
/// converted, after a check for negative indices.
py::array polygon_array(const py::object& given, py::ssize_t corners, const std::string& what) {
  if (given.is_none()) return py::array_t<std::uint32_t>(0);
  const py::module_ numpy = py::module_::import("numpy");
  py::array array = contiguous(given, "i4 u4 i8 u8", "i8", what + "s");
  if (numpy.attr("asarray")(given).attr("dtype").attr("kind").cast<std::string>() == "f" && array.size() > 0)
    throw Error("the array of " + what + "s must hold whole numbers");
  check_rows(array, corners, what + "s");
  const bool is_signed = array.dtype().kind() == 'i';
  if (array.size() > 0 && (is_signed || array.itemsize() == 8)) {
    const py::object least = array.attr("min")(), greatest = array.attr("max")();
    const bool below = py::int_(least) < py::int_(0);
    if (below || py::int_(greatest) > py::int_(0xffffffffu)) {
      const py::object bad = below ? least : greatest;
      const py::object where = numpy.attr("argmax")(array.attr("__eq__")(bad));
      throw Error(what + " number " + std::to_string(where.cast<py::ssize_t>() / corners) +
                  " refers to point " + py::str(bad).cast<std::string>() +
                  ", which no mesh has: points count from 0, to 4294967295 at most");
    }
  }
  if (array.itemsize() == 8) return array.attr("astype")("u4");
  return array.attr("view")("u4");
}

/// Attributes from dicts of arrays, whose references are held.
struct GivenAttributes {
  std::vector<Attribute> attributes;
  std::vector<py::array> arrays;

  GivenAttributes(const py::dict& of_points, const py::dict& of_corners, const py::dict& of_polygons,
                  const std::map<std::string, std::vector<std::string>>& labels) {
    add(of_points, AttributeDomain::point);
    add(of_corners, AttributeDomain::corner);
    add(of_polygons, AttributeDomain::polygon);
    for (Attribute& attribute : attributes)
      if (const auto names = labels.find(attribute.name); names != labels.end())
        attribute.labels = names->second;
  }

  void add(const py::dict& given, AttributeDomain domain) {
    for (const auto& [key, value] : given) {
      Attribute attribute;
      attribute.name = py::str(key).cast<std::string>();
      attribute.domain = domain;
      const py::array numbers = py::module_::import("numpy").attr("asarray")(value);
      const bool whole = numbers.dtype().kind() == 'i' || numbers.dtype().kind() == 'u';
      const bool one = numbers.ndim() == 1 || (numbers.ndim() == 2 && numbers.shape(1) == 1);
      const std::string what = "the attribute '" + attribute.name + "'";
      if (numbers.ndim() != 1 && numbers.ndim() != 2)
        throw Error("the array of " + what + " must have the shape (n,) or (n, components)");
      // Integers of several components, such as 8-bit colours, become floats.
      const char* type = whole && one ? "i4" : "f4";
      const py::array array = contiguous(value, type, type, what);
      attribute.components = numbers.ndim() == 1 ? 1 : int(numbers.shape(1));
      if (whole && one)
        attribute.integers = span_of<std::int32_t>(array);
      else
        attribute.floats = span_of<float>(array);
      arrays.push_back(array);
      attributes.push_back(std::move(attribute));
    }
  }
};

Mesh make_mesh(const py::object& points, const py::object& triangles, const py::object& quads,
               const py::dict& of_points, const py::dict& of_corners, const py::dict& of_polygons,
               const std::map<std::string, std::vector<std::string>>& labels) {
  const py::array positions = contiguous(points, "f4 f8", "f8", "points");
  check_rows(positions, 3, "points");
  const py::array three = polygon_array(triangles, 3, "triangle");
  const py::array four = polygon_array(quads, 4, "quad");
  const GivenAttributes given(of_points, of_corners, of_polygons, labels);
  const auto t = span_of<std::uint32_t>(three), q = span_of<std::uint32_t>(four);
  const bool single = positions.itemsize() == 4;
  const auto f = single ? span_of<float>(positions) : std::span<const float>();
  const auto d = single ? std::span<const double>() : span_of<double>(positions);
  const py::gil_scoped_release others_may_run;
  return single ? Mesh(f, t, q, given.attributes) : Mesh(d, t, q, given.attributes);
}

Mesh with_attributes(const Mesh& mesh, const py::dict& of_points, const py::dict& of_corners,
                     const py::dict& of_polygons,
                     const std::map<std::string, std::vector<std::string>>& labels) {
  const GivenAttributes given(of_points, of_corners, of_polygons, labels);
  const py::gil_scoped_release others_may_run;
  return mesh.with_attributes(given.attributes);
}

py::array points_of(const Mesh& mesh) {
  return view(mesh.points(), {py::ssize_t(mesh.point_count()), 3}, mesh);
}

py::dict attributes_of(const Mesh& mesh, AttributeDomain domain) {
  py::dict arrays;
  for (const Attribute& attribute : mesh.attributes()) {
    if (attribute.domain != domain) continue;
    const auto array = [&](auto values) {
      std::vector<py::ssize_t> shape = {py::ssize_t(values.size()) / attribute.components};
      if (attribute.components > 1) shape.push_back(attribute.components);
      return view(values, std::move(shape), mesh);
    };
    arrays[py::str(attribute.name)] =
        attribute.integers.empty() ? array(attribute.floats) : array(attribute.integers);
  }
  return arrays;
}

std::map<std::string, std::vector<std::string>> labels_of(const Mesh& mesh) {
  std::map<std::string, std::vector<std::string>> labels;
  for (const Attribute& attribute : mesh.attributes())
    if (!attribute.labels.empty()) labels[attribute.name] = attribute.labels;
  return labels;
}

/// The triangles, then two for each quad: abc and acd.
py::array triangulated(const Mesh& mesh) {
  std::vector<std::uint32_t> all(mesh.triangles().begin(), mesh.triangles().end());
  all.reserve(all.size() + 6 * mesh.quad_count());
  for (std::size_t i = 0; i < mesh.quads().size(); i += 4)
    for (const int corner : {0, 1, 2, 0, 2, 3}) all.push_back(mesh.quads()[i + corner]);
  const py::ssize_t rows = py::ssize_t(all.size() / 3);
  return owning(std::move(all), {rows, 3});
}

void bind_mesh(py::module_& m) {
  const py::dict none;
  py::class_<Mesh>(
      m, "Mesh",
      R"(Triangles and quads over shared points, counter-clockwise seen from outside, with attributes.

A mesh is immutable. Its arrays are read-only views, not copies; use `mesh.points.copy()` to write.

Examples
--------
>>> mesh = hermesh.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
>>> mesh.points.dtype, mesh.triangles.dtype
(dtype('float32'), dtype('uint32'))
>>> hermesh.Mesh([[0, 0, 0]], [[0, 1, 2]])
Traceback (most recent call last):
    ...
hermesh.Error: triangle number 0 refers to point 1, but there are 1 points (both count from 0)
)")
      .def(py::init(&make_mesh), py::arg("points"), py::arg("triangles") = py::none(),
           py::arg("quads") = py::none(), py::kw_only(), py::arg("point_attributes") = none,
           py::arg("corner_attributes") = none, py::arg("polygon_attributes") = none,
           py::arg("labels") = std::map<std::string, std::vector<std::string>>(),
           R"(Makes a mesh of arrays, which are copied once.

Parameters
----------
points : array_like, shape (n, 3)
    float32 or float64, world units; float64 preserves precision far from the origin (see `origin`).
triangles : array_like, shape (m, 3), optional
    Indices of points from 0 on, int32 or uint32 (others are converted).
quads : array_like, shape (k, 4), optional
    As `triangles`. Functions that sample polygons split each quad along its better diagonal.
point_attributes, corner_attributes, polygon_attributes : dict of str to array_like, optional
    One row for each point, for each corner of a polygon, or for each triangle and then each quad; 1 to 4
    columns of float32, or one of integers (-1 means none).
labels : dict of str to list of str, optional
    Name of an integer attribute to the names of its values from 0 on.

Raises
------
Error
    If an index is out of range, a coordinate is not finite, or an array has the wrong shape.
)")
      .def(
          "with_attributes", &with_attributes, py::kw_only(), py::arg("point_attributes") = none,
          py::arg("corner_attributes") = none, py::arg("polygon_attributes") = none,
          py::arg("labels") = std::map<std::string, std::vector<std::string>>(),
          R"(Returns a mesh of the same polygons whose attributes are replaced by these; all arrays are copied.

Parameters
----------
point_attributes, corner_attributes, polygon_attributes, labels : optional
    As in the constructor.

Raises
------
Error
    If an attribute has a wrong number of values.

Examples
--------
>>> mesh = hermesh.as_mesh(cube).with_attributes(polygon_attributes={"material": np.arange(6)})
>>> mesh.polygon_attributes["material"]
array([0, 1, 2, 3, 4, 5], dtype=int32)
)")
      .def_property_readonly("points", &points_of,
                             "(n, 3) float32, world units relative to `origin`; a read-only view.")
      .def_property_readonly(
          "origin",
          [](const Mesh& mesh) {
            const std::array<double, 3> o = mesh.origin();
            return py::make_tuple(o[0], o[1], o[2]);
          },
          "The zero of `points`, world units; (0, 0, 0) unless the mesh lies far from it.")
      .def(
          "world_points",
          [](const Mesh& mesh) {
            return owning(mesh.world_points(), {py::ssize_t(mesh.point_count()), 3});
          },
          "(n, 3) float64, world units, in a new array.")
      .def_property_readonly(
          "triangles",
          [](const Mesh& mesh) {
            return view(mesh.triangles(), {py::ssize_t(mesh.triangle_count()), 3}, mesh);
          },
          "(m, 3) uint32, indices of points; a read-only view.")
      .def_property_readonly(
          "quads",
          [](const Mesh& mesh) {
            return view(mesh.quads(), {py::ssize_t(mesh.quad_count()), 4}, mesh);
          },
          "(k, 4) uint32, indices of points; a read-only view. A quad (a, b, c, d) of a mesh made by "
          "hermesh\n"
          "means the triangles abc and acd.")
      .def("triangulated", &triangulated,
           R"((m + 2 k, 3) uint32: the triangles, then two for each quad, in a new array.

Examples
--------
>>> hermesh.as_mesh(cube).triangulated().shape
(12, 3)
)")
      .def_property_readonly(
          "point_attributes", [](const Mesh& mesh) { return attributes_of(mesh, AttributeDomain::point); },
          "Name to a read-only view, one row for each point.")
      .def_property_readonly(
          "corner_attributes", [](const Mesh& mesh) { return attributes_of(mesh, AttributeDomain::corner); },
          "Name to a read-only view, one row for each corner: three a triangle, then four a quad.")
      .def_property_readonly(
          "polygon_attributes",
          [](const Mesh& mesh) { return attributes_of(mesh, AttributeDomain::polygon); },
          "Name to a read-only view, one row for each triangle, then for each quad.")
      .def_property_readonly("labels", &labels_of,
                             "Name of an integer attribute to the names of its values from 0 on.")
      .def("__repr__", [](const Mesh& mesh) {
        return "<hermesh.Mesh of " + std::to_string(mesh.point_count()) + " points, " +
               std::to_string(mesh.triangle_count()) + " triangles, " + std::to_string(mesh.quad_count()) +
               " quads>";
      });
}

// ---- Volumes.

Volume make_volume(const py::object& values, std::array<int, 3> lower, double voxel_size,
                   std::array<double, 3> origin, const py::object& placement, bool level_set,
                   std::optional<float> background, const std::string& name) {
  const py::array array = contiguous(values, "f4", "f4", "samples");
  if (array.ndim() != 3)
    throw Error("the array of samples must have three dimensions, not " + std::to_string(array.ndim()));
  DenseOptions options{.lower = lower, .level_set = level_set, .background = background, .name = name};
  if (placement.is_none()) {
    if (!(voxel_size > 0.0) || !std::isfinite(voxel_size))
      throw Error("the voxel size must be a finite number above 0");
    options.placement = Placement::uniform(voxel_size, origin);
  } else {
    const py::array map = contiguous(placement, "f8", "f8", "the placement");
    const bool fits = map.ndim() == 2 && (map.shape(0) == 3 || map.shape(0) == 4) && map.shape(1) == 4;
    if (!fits) throw Error("the placement must have the shape (3, 4) or (4, 4)");
    std::copy_n(span_of<double>(map).begin(), 12, &options.placement.rows[0][0]);
    const auto last = span_of<double>(map).subspan(12);
    if (!last.empty() && (last[0] != 0.0 || last[1] != 0.0 || last[2] != 0.0 || last[3] != 1.0))
      throw Error("the last row of a placement must be 0, 0, 0, 1");
  }
  for (int axis = 0; axis < 3; ++axis)
    if (array.shape(axis) > 0x7fffffff) throw Error("a box of samples has fewer than 2^31 on each side");
  const std::array<int, 3> dims = {int(array.shape(0)), int(array.shape(1)), int(array.shape(2))};
  if (array.size() == 0) throw Error("the array of samples is empty");
  const auto samples = span_of<float>(array);
  const py::gil_scoped_release others_may_run;
  return Volume::from_dense(samples, dims, options);
}

py::array dense_of(const Volume& volume, std::optional<std::array<int, 3>> lower,
                   std::optional<std::array<int, 3>> dims) {
  if (lower.has_value() != dims.has_value()) throw Error("give both lower and dims, or none of them");
  DenseVolume dense;
  {
    const py::gil_scoped_release others_may_run;
    dense = lower ? volume.to_dense(*lower, *dims) : volume.to_dense();
  }
  return owning(std::move(dense.values), {dense.dims[0], dense.dims[1], dense.dims[2]});
}

py::array sampled(const Volume& volume, const py::object& places) {
  const py::array array = contiguous(places, "f8", "f8", "places");
  check_rows(array, 3, "places");
  std::vector<float> values;
  {
    const auto numbers = span_of<double>(array);
    const py::gil_scoped_release others_may_run;
    values = volume.sample(numbers);
  }
  const py::ssize_t count = py::ssize_t(values.size());
  return owning(std::move(values), {count});
}

void bind_volume(py::module_& m) {
  py::class_<Volume>(
      m, "Volume",
      "A sparse grid of values with its placement, which owns an OpenVDB grid; immutable.\n\n"
      "A level set has signed distances in world units, negative inside, within a narrow band and plus or\n"
      "minus `background` beyond.")
      .def_static("from_numpy", &make_volume, py::arg("values"), py::kw_only(),
                  py::arg("lower") = std::array<int, 3>{0, 0, 0}, py::arg("voxel_size") = 1.0,
                  py::arg("origin") = std::array<double, 3>{0, 0, 0}, py::arg("placement") = py::none(),
                  py::arg("level_set") = false, py::arg("background") = py::none(), py::arg("name") = "",
                  R"(Makes a volume of a dense array.

Parameters
----------
values : array_like, shape (nx, ny, nz)
    float32 (others are converted); values[x, y, z] is the sample with the index lower + (x, y, z).
lower : sequence of three int, default (0, 0, 0)
    Index of the first sample.
voxel_size : float, default 1.0
    Edge of a voxel, world units.
origin : sequence of three float, default (0, 0, 0)
    Position of the sample with the index (0, 0, 0).
placement : array_like, shape (3, 4) or (4, 4), optional
    Maps an index to a position, instead of `voxel_size` and `origin`.
level_set : bool, default False
    True: values are signed distances in world units, negative inside; those of at least the background
    become the background. False: every sample is active, and the volume ends at its box.
background : float, optional
    Value beyond the samples. By default the greatest magnitude of a level set, else just below the least
    value.
name : str, optional
    By default `sdf` or `volume`.

Raises
------
Error
    If a value is not finite, or the placement cannot be inverted.

Examples
--------
>>> x, y, z = np.mgrid[-10:11, -10:11, -10:11]
>>> ball = hermesh.Volume.from_numpy(np.sqrt(x**2 + y**2 + z**2) - 7.0, lower=(-10, -10, -10), level_set=True)
>>> hermesh.validate(hermesh.extract(ball)).watertight
True
)")
      .def("to_numpy", &dense_of, py::arg("lower") = py::none(), py::arg("dims") = py::none(),
           R"(Returns a box of samples as a new array, (nx, ny, nz) float32.

Parameters
----------
lower, dims : sequence of three int, optional
    Index of the first sample, and numbers of samples. By default those of the active samples.

Examples
--------
>>> volume = hermesh.voxelize(cube, resolution=20)
>>> volume.to_numpy().shape == volume.dims
True
)")
      .def("sample", &sampled, py::arg("places"),
           R"(Returns the values at positions, (n,) float32, trilinear between samples.

Parameters
----------
places : array_like, shape (n, 3)
    World units.

Examples
--------
>>> hermesh.voxelize(cube, resolution=20).sample([[0.5, 0.5, 1.0]])
array([0.], dtype=float32)
)")
      .def_property_readonly("name", &Volume::name, "Name of the grid in a .vdb file.")
      .def("with_name", &Volume::with_name, py::arg("name"),
           "Returns a volume of the same samples with another name.")
      .def_property_readonly("value_type", &Volume::value_type, "\"float\", \"int32\", \"vec3s\", ...")
      .def_property_readonly("is_level_set", &Volume::is_level_set,
                             "True if the values are signed distances in world units.")
      .def_property_readonly(
          "placement",
          [](const Volume& volume) {
            const Placement placement = volume.placement();
            std::vector<double> map(16, 0.0);
            std::copy_n(&placement.rows[0][0], 12, map.begin());
            map[15] = 1.0;
            return owning(std::move(map), {4, 4});
          },
          "(4, 4) float64: maps the index (i, j, k, 1) of a sample to its position, world units.")
      .def_property_readonly("voxel_size", &Volume::voxel_size, "World units; cube root of a voxel's volume.")
      .def_property_readonly("background", &Volume::background,
                             "The value beyond the samples; world units in a level set.")
      .def_property_readonly("value_range", &Volume::value_range, "Least and greatest value of the samples.")
      .def_property_readonly("active_voxels", &Volume::active_voxels, "Number of samples with a value.")
      .def_property_readonly("memory_bytes", &Volume::memory_bytes, "Memory of the grid.")
      .def_property_readonly(
          "lower",
          [](const Volume& volume) {
            const std::array<int, 3> lower = volume.lower();
            return py::make_tuple(lower[0], lower[1], lower[2]);
          },
          "Least indices of active samples.")
      .def_property_readonly(
          "dims",
          [](const Volume& volume) {
            const std::array<int, 3> dims = volume.dims();
            return py::make_tuple(dims[0], dims[1], dims[2]);
          },
          "Sides of the box of the active samples, in samples.")
      .def("__repr__", [](const Volume& volume) {
        return "<hermesh.Volume '" + volume.name() + "' of " + std::to_string(volume.active_voxels()) +
               " active samples, type " + volume.value_type() + ">";
      });
}

// ---- Options and results.

void bind_options(py::module_& m) {
  py::class_<Watch>(
      m, "Watch",
      "Progress, cancellation and threads of a call, and its notes, times and figures afterwards.")
      .def(py::init([](py::object progress, py::object cancel, std::optional<int> threads) {
             return Watch{std::move(progress), std::move(cancel), threads};
           }),
           py::arg("progress"), py::arg("cancel"), py::arg("threads"))
      .def_readonly("notes", &Watch::notes)
      .def_readonly("stage_seconds", &Watch::stage_seconds)
      .def_readonly("figures", &Watch::figures);
  py::enum_<Thin>(m, "Thin")
      .value("keep", Thin::keep)
      .value("drop", Thin::drop)
      .value("refuse", Thin::refuse);
  py::class_<VoxelizeOptions>(m, "VoxelizeOptions")
      .def(py::init<>())
      .def_readwrite("resolution", &VoxelizeOptions::resolution)
      .def_readwrite("voxel_size", &VoxelizeOptions::voxel_size)
      .def_readwrite("like", &VoxelizeOptions::like)
      .def_readwrite("exterior_band", &VoxelizeOptions::exterior_band)
      .def_readwrite("interior_band", &VoxelizeOptions::interior_band)
      .def_readwrite("voxelizer", &VoxelizeOptions::voxelizer)
      .def_readwrite("options", &VoxelizeOptions::options)
      .def_readwrite("thin", &VoxelizeOptions::thin);
  py::class_<Frustum>(m, "Frustum", "The view of a camera: lengths in world units, the angle in degrees.")
      .def(py::init([](std::array<double, 3> position, std::array<double, 3> look_at,
                       std::array<double, 3> up, double angle, double aspect, double near,
                       double far) { return Frustum{position, look_at, up, angle, aspect, near, far}; }),
           py::kw_only(), py::arg("position") = std::array<double, 3>{0, 0, 0},
           py::arg("look_at") = std::array<double, 3>{0, 0, -1},
           py::arg("up") = std::array<double, 3>{0, 1, 0}, py::arg("angle") = 45.0, py::arg("aspect") = 1.0,
           py::arg("near") = 0.1, py::arg("far") = 100.0,
           R"(Makes the view of a camera.

Parameters
----------
position, look_at, up : sequence of three float
    Position of the camera, point in the centre of the view, and upward direction.
angle : float, default 45.0
    Vertical, from the lower to the upper plane, degrees.
aspect : float, default 1.0
    Width over height.
near, far : float, default 0.1 and 100.0
    Distances of the planes that limit the view.

Examples
--------
>>> view = hermesh.Frustum(position=(0.5, 0.5, 3), look_at=(0.5, 0.5, 0), near=1.5, far=10)
>>> mesh = hermesh.remesh(cube, resolution=20, frustum=view)
)")
      .def_readonly("position", &Frustum::position, "World units.")
      .def_readonly("look_at", &Frustum::look_at, "World units.")
      .def_readonly("up", &Frustum::up, "World units.")
      .def_readonly("angle", &Frustum::angle, "Degrees.")
      .def_readonly("aspect", &Frustum::aspect, "Width over height.")
      .def_readonly("near", &Frustum::near, "World units.")
      .def_readonly("far", &Frustum::far, "World units.");
  py::class_<ExtractOptions>(m, "ExtractOptions")
      .def(py::init<>())
      .def_readwrite("extractor", &ExtractOptions::extractor)
      .def_readwrite("options", &ExtractOptions::options)
      .def_readwrite("isovalue", &ExtractOptions::isovalue)
      .def_readwrite("ends", &ExtractOptions::ends)
      .def_readwrite("mask", &ExtractOptions::mask)
      .def_readwrite("frustum", &ExtractOptions::frustum)
      .def_readwrite("frustum_resolution", &ExtractOptions::frustum_resolution)
      .def_readwrite("outside", &ExtractOptions::outside)
      .def_readwrite("tolerance_grid", &ExtractOptions::tolerance_grid)
      .def_readwrite("written_in_single", &ExtractOptions::written_in_single);
  py::class_<CutterMesh>(m, "CutterMesh")
      .def(py::init([](std::string name, const Mesh& mesh, std::size_t copies) {
             return CutterMesh{std::move(name), mesh, copies};
           }),
           py::arg("name"), py::arg("mesh"), py::arg("copies"));
  py::class_<FractureOptions>(m, "FractureOptions")
      .def(py::init<>())
      .def_readwrite("cutters", &FractureOptions::cutters)
      .def_readwrite("meshes", &FractureOptions::meshes)
      .def_readwrite("seed", &FractureOptions::seed)
      .def_readwrite("roughness", &FractureOptions::roughness)
      .def_readwrite("impact", &FractureOptions::impact)
      .def_readwrite("impact_radius", &FractureOptions::impact_radius)
      .def_readwrite("density", &FractureOptions::density)
      .def_readwrite("mesh_scale", &FractureOptions::mesh_scale)
      .def_readwrite("method", &FractureOptions::method)
      .def_readwrite("tolerance", &FractureOptions::tolerance)
      .def_readwrite("rule", &FractureOptions::rule)
      .def_readwrite("min_volume", &FractureOptions::min_volume)
      .def_readwrite("split", &FractureOptions::split)
      .def_readwrite("hermite", &FractureOptions::hermite);

  py::class_<Piece>(m, "Piece", "One piece of a broken solid.")
      .def_readonly("name", &Piece::name, "Name of its file in the program.")
      .def_readonly(
          "mesh", &Piece::mesh,
          "World units. The method labelled adds polygon attributes `surface` (0 original, 1 cut) and\n"
          "`neighbour` (the number of the adjacent piece, -1 none), a corner attribute `uv`, and those of\n"
          "the fractured mesh.")
      .def_readonly("volume", &Piece::volume, "World units.")
      .def_readonly("area", &Piece::area, "World units.")
      .def_readonly("centre_of_mass", &Piece::centre_of_mass, "World units.")
      .def_property_readonly(
          "inertia",
          [](const Piece& piece) {
            return owning(std::vector<double>(piece.inertia.begin(), piece.inertia.end()), {3, 3});
          },
          "(3, 3) float64, about the centre of mass at density 1.")
      .def_readonly("neighbours", &Piece::neighbours,
                    "Number of a neighbour, from 1, to the triangles and the area of the seam with it.")
      .def("__repr__", [](const Piece& piece) { return "<hermesh.Piece '" + piece.name + "'>"; });
  py::class_<Fracture>(m, "Fracture", "A solid in pieces; piece number n is pieces[n - 1].")
      .def_readonly("pieces", &Fracture::pieces, "All pieces.")
      .def_readonly("seconds", &Fracture::seconds, "Seconds of the method itself.")
      .def("__len__", [](const Fracture& fracture) { return fracture.pieces.size(); })
      .def("__repr__", [](const Fracture& fracture) {
        return "<hermesh.Fracture of " + std::to_string(fracture.pieces.size()) + " pieces>";
      });

  py::class_<OptionInfo>(m, "OptionInfo", "An option of a method.")
      .def_readonly("name", &OptionInfo::name, "The keyword.")
      .def_readonly("fallback", &OptionInfo::fallback, "The value when none is given.")
      .def_readonly("help", &OptionInfo::help, "The meaning of the option.")
      .def_readonly("choices", &OptionInfo::choices, "Empty: a number from minimum to maximum.")
      .def_readonly("minimum", &OptionInfo::minimum, "Of a number.")
      .def_readonly("maximum", &OptionInfo::maximum, "Of a number.")
      .def("__repr__", [](const OptionInfo& option) { return option.name + "=" + option.fallback; });
  py::class_<MethodInfo>(m, "MethodInfo", "A method, and the guarantees of an extractor for every input.")
      .def_readonly("name", &MethodInfo::name, "Value of `extractor` or `voxelizer`.")
      .def_readonly("summary", &MethodInfo::summary, "One line.")
      .def_readonly("closed", &MethodInfo::closed, "No edge has only one polygon.")
      .def_readonly("manifold", &MethodInfo::manifold,
                    "No edge has more than two polygons, and the polygons of a point are one fan.")
      .def_readonly("oriented", &MethodInfo::oriented, "Adjacent polygons have the same orientation.")
      .def_readonly("free_of_self_intersection", &MethodInfo::free_of_self_intersection,
                    "No two triangles intersect.")
      .def_readonly("options", &MethodInfo::options, "Those of the method itself.")
      .def("__repr__", [](const MethodInfo& method) { return method.name + ": " + method.summary; });
}

// ---- Functions.

Boolean boolean_of(const std::string& operation) {
  if (operation == "union") return Boolean::union_of;
  if (operation == "intersection") return Boolean::intersection;
  if (operation == "difference") return Boolean::difference;
  throw Error("the operation is union, intersection or difference, not '" + operation + "'");
}

void bind_functions(py::module_& m) {
  m.def("version", &version);
  m.def("extractors", &extractors, R"(Returns the available extractors.

Returns
-------
list of MethodInfo
    With their options and guarantees.

Examples
--------
>>> methods = {method.name: method for method in hermesh.extractors()}
>>> [name for name, method in methods.items() if method.free_of_self_intersection]
['manifold-dual-contouring', 'certified-octree']
>>> [option.fallback for option in methods["manifold-dual-contouring"].options if option.name == "tolerance"]
['0.1']
)");
  m.def("voxelizers", &voxelizers, R"(Returns the available voxelizers.

Returns
-------
list of MethodInfo
    With their options.

Examples
--------
>>> "hermesh" in [method.name for method in hermesh.voxelizers()]
True
)");
  m.def("read_mesh", [](const std::filesystem::path& path, bool attributes, Watch& watch) {
    return watched(watch, [&](Context& context) { return read_mesh(path, context, attributes); });
  });
  m.def("write_mesh", [](const std::filesystem::path& path, const Mesh& mesh, Watch& watch) {
    watched(watch, [&](Context& context) { return write_mesh(path, mesh, context), true; });
  });
  m.def("read_vdb", [](const std::filesystem::path& path, const std::string& grid, Watch& watch) {
    return watched(watch, [&](Context& context) { return read_vdb(path, context, grid); });
  });
  m.def("grid_names", &grid_names, py::arg("path"), R"(Returns the names of the grids of a .vdb file.

Parameters
----------
path : path-like
    The file.

Returns
-------
list of str
    In the order of the file.

Raises
------
Error
    If the file is missing or damaged.

Examples
--------
>>> hermesh.voxelize(cube, resolution=20).write("cube.vdb")
>>> hermesh.grid_names("cube.vdb")
['sdf']
)");
  m.def("write_vdb", [](const std::filesystem::path& path, const std::vector<Volume>& volumes, Watch& watch) {
    watched(watch, [&](Context& context) { return write_vdb(path, volumes, context), true; });
  });
  m.def("import_volume", [](const std::filesystem::path& path, std::optional<std::int64_t> frame,
                            std::optional<std::array<std::int64_t, 3>> dims, const std::string& type,
                            std::optional<std::array<double, 3>> spacing, std::optional<std::uint64_t> offset,
                            std::optional<float> replace_nan, Watch& watch) {
    ImportOptions options{.replace_nan = replace_nan, .frame = frame};
    if (dims)
      options.raw = RawSamples{.dims = *dims,
                               .type = type,
                               .spacing = spacing.value_or(std::array<double, 3>{1, 1, 1}),
                               .offset = offset.value_or(0)};
    else if (!type.empty() || spacing || offset)
      throw Error("type, spacing and offset concern raw samples: give dims, too");
    return watched(watch, [&](Context& context) { return import_volume(path, options, context); });
  });
  m.def("voxelize", watching<const Mesh&, const VoxelizeOptions&>(&voxelize));
  m.def("voxelize_grids", [](const Mesh& mesh, const std::string& grids, const VoxelizeOptions& options,
                             bool fog_exterior, Watch& watch) {
    return watched(
        watch, [&](Context& context) { return voxelize_grids(mesh, grids, options, context, fog_exterior); });
  });
  m.def("extract",
        [](const Volume& volume, const ExtractOptions& options, std::optional<Mesh> source, Watch& watch) {
          return watched(watch, [&](Context& context) {
            return extract(volume, options, context, source ? &*source : nullptr);
          });
        });
  m.def("remesh", watching<const Mesh&, const VoxelizeOptions&, const ExtractOptions&>(&remesh));
  m.def("remesh_within", [](const Mesh& mesh, std::optional<double> error,
                            std::optional<std::size_t> triangles, const std::string& signs, bool over_holes,
                            double smallest_voxel, double limit_points, bool written_in_single, Thin thin,
                            bool except_thin, bool through_volume, Watch& watch) {
    const BoundedRemesh made = watched(watch, [&](Context& context) {
      return remesh_within(mesh,
                           {.error = error,
                            .triangles = triangles,
                            .signs = signs,
                            .over_holes = over_holes,
                            .smallest_voxel = smallest_voxel,
                            .most_points = limit_points,
                            .written_in_single = written_in_single,
                            .thin = thin,
                            .through_volume = through_volume,
                            .except_thin = except_thin},
                           context);
    });
    py::list exceptions;
    for (const ExceptedBall& ball : made.exceptions)
      exceptions.append(py::make_tuple(ball.position, ball.radius, ball.distance, ball.area, ball.is_hole));
    return py::make_tuple(made.mesh, made.error, made.to_polygons, made.from_polygons, made.voxel_size,
                          exceptions);
  });
  m.def("combine", [](const std::string& operation, const Mesh& a, const Mesh& b,
                      const VoxelizeOptions& voxelizing, const ExtractOptions& extracting, Watch& watch) {
    const Boolean boolean = boolean_of(operation);
    return watched(watch,
                   [&](Context& context) { return combine(boolean, a, b, voxelizing, extracting, context); });
  });
  m.def("fracture", watching<const Mesh&, const VoxelizeOptions&, const FractureOptions&>(
                        [](auto&... given) { return fracture(given...); }));
  m.def("fracture_volume",
        watching<const Volume&, const FractureOptions&>([](auto&... given) { return fracture(given...); }));
}

}  // namespace
}  // namespace hermesh::python

PYBIND11_MODULE(_core, m) {
  namespace py = pybind11;
  m.doc() = "Bindings of the public C++ functions; use the package hermesh.";
  // Both translate exceptions of all extension modules of this process, validation included.
  py::register_exception<hermesh::Error>(m, "Error", PyExc_RuntimeError).attr("__module__") = "hermesh";
  m.attr("Error").attr("__doc__") =
      "Invalid input, an option that is unknown or has no effect, or a failure, with the reason.";
  py::register_exception<hermesh::Cancelled>(m, "Cancelled", PyExc_Exception).attr("__module__") = "hermesh";
  m.attr("Cancelled").attr("__doc__") = "Raised if `cancel` of a function is set.";
  hermesh::python::bind_mesh(m);
  hermesh::python::bind_volume(m);
  hermesh::python::bind_options(m);
  hermesh::python::bind_functions(m);
}
