// Writers of mesh files.
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cerrno>

#include "algorithms/io/atomic_file.h"
#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/stored_number.h"

namespace hermesh {

namespace {

using namespace mesh_formats;

/// Buffers bytes for zlib, which writes them with or without compression. Each of its calls may find the disk
/// full, even the last one.
class Output {
 public:
  Output(const std::filesystem::path& temporary, const std::filesystem::path& target, bool gzipped,
         RunContext& context)
      : target_(target.string()),
        context_(context),
        file_(gzopen(temporary.c_str(), gzipped ? "wb6" : "wbT")) {
    if (!file_) fail();
    gzbuffer(file_, 1 << 18);
    buffer_.reserve(capacity + 4096);
  }
  ~Output() {
    if (file_) gzclose(file_);
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void text(std::string_view text) {
    buffer_.append(text);
    if (buffer_.size() >= capacity) flush();
  }
  template <class T>
  void binary(T value) {
    const auto bytes = bytes_of_number(value);
    text({bytes.data(), bytes.size()});
  }
  void close() {
    flush();
    // The destructor must not close the file a second time, even after an Error.
    const gzFile file = std::exchange(file_, nullptr);
    errno = 0;
    if (gzclose(file) != Z_OK) fail();
  }

 private:
  static constexpr std::size_t capacity = 1 << 20;

  void flush() {
    context_.check();
    errno = 0;
    if (!buffer_.empty() && gzwrite(file_, buffer_.data(), static_cast<unsigned>(buffer_.size())) <= 0)
      fail();
    buffer_.clear();
  }
  [[noreturn]] void fail() const {
    throw Error(
        joined("cannot write ", in_quotes(target_), (errno ? std::string(": ") + std::strerror(errno) : "")));
  }

  std::string target_;
  RunContext& context_;
  gzFile file_;
  std::string buffer_;
};

void write_numbers(Output& out, std::string_view lead, const Eigen::Vector3d& numbers) {
  out.text(lead);
  for (const double x : numbers) {
    out.text(" ");
    out.text(NumberText(x));
  }
  out.text("\n");
}

/// Returns the nearest point in single precision. Volatile because GCC 12 drops the rounding from a vector's
/// `.cast<float>().cast<double>()` when it vectorizes straight-line code.
Eigen::Vector3d rounded_to_single(const Eigen::Vector3d& point) {
  volatile float x = static_cast<float>(point.x()), y = static_cast<float>(point.y()),
                 z = static_cast<float>(point.z());
  return {x, y, z};
}

/// An attribute as PLY's properties, by the names under which read_mesh_file() finds it again.
struct PlyAttribute {
  const MeshAttribute& attribute;
  std::vector<std::string> properties;
  bool bytes = false;  ///< for colours, as other programs expect them
};

std::vector<std::string> ply_properties(const MeshAttribute& attribute) {
  const auto is = [&](const char* name, int least, int most) {
    return attribute.name == name && attribute.components >= least && attribute.components <= most;
  };
  std::vector<std::string> names;
  if (is("normal", 3, 3)) names = {"nx", "ny", "nz"};
  if (is("colour", 3, 4)) names = {"red", "green", "blue", "alpha"};
  if (is("uv", 2, 2)) names = {"u", "v"};
  names.resize(static_cast<std::size_t>(attribute.components));
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!names[i].empty()) continue;
    names[i] = attribute.name + (attribute.components == 1 ? "" : "_" + std::string(1, "xyzw"[i]));
    // A blank would end the name in the header.
    std::ranges::replace_if(names[i], is_space, '_');
  }
  return names;
}

/// The attributes of a file by element. For corners, other programs read texture coordinates only.
struct PlyAttributes {
  std::vector<PlyAttribute> points, polygons;
  const MeshAttribute* corner_uv = nullptr;
};

PlyAttributes ply_attributes(const MeshFile& mesh, const std::string& file, RunContext& context) {
  PlyAttributes result;
  const std::size_t polygons = mesh.triangles.size() + mesh.quads.size();
  const std::array<std::size_t, 3> elements = {mesh.points.size(),
                                               3 * mesh.triangles.size() + 4 * mesh.quads.size(), polygons};
  for (const MeshAttribute& attribute : mesh.attributes) {
    const std::size_t values = std::visit([](const auto& all) { return all.size(); }, attribute.values);
    // A wrong length means that the mesh has changed without the attribute.
    const bool fits = values == elements[static_cast<std::size_t>(attribute.domain)] *
                                    static_cast<std::size_t>(attribute.components);
    const bool uv = attribute.name == "uv" && attribute.components == 2 && attribute.values.index() == 0;
    if (!fits || (attribute.domain == AttributeDomain::corner && !uv)) {
      context.note(joined(in_quotes(file), ": a PLY cannot store the attribute ", attribute.name,
                          ", which was left out"));
      continue;
    }
    // Only colours as floats from 0 to 1 become bytes.
    const bool bytes =
        attribute.name == "colour" && attribute.components >= 3 && attribute.values.index() == 0;
    if (attribute.domain == AttributeDomain::corner)
      result.corner_uv = &attribute;
    else
      (attribute.domain == AttributeDomain::point ? result.points : result.polygons)
          .push_back({attribute, ply_properties(attribute), bytes});
  }
  return result;
}

void write_ply_value(Output& out, const PlyAttribute& from, std::size_t i) {
  if (from.attribute.values.index() == 1) return out.binary(std::get<1>(from.attribute.values)[i]);
  const float value = std::get<0>(from.attribute.values)[i];
  if (!from.bytes) return out.binary(value);
  // To the nearest of 256 levels, as read_mesh_file() divides by 255.
  out.binary(static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f))));
}

void declare_ply_properties(Output& out, const std::vector<PlyAttribute>& attributes) {
  for (const PlyAttribute& each : attributes)
    for (const std::string& name : each.properties)
      out.text(std::string("property ") +
               (each.bytes                           ? "uchar "
                : each.attribute.values.index() == 1 ? "int "
                                                     : "float ") +
               name + "\n");
}

void write_ply_values(Output& out, const std::vector<PlyAttribute>& attributes, std::size_t element) {
  for (const PlyAttribute& each : attributes)
    for (std::size_t j = 0; j < each.properties.size(); ++j)
      write_ply_value(out, each, element * each.properties.size() + j);
}

/// Calls `work` with each triangle, then each quad, the order of attributes of polygons and corners.
template <class Work>
void for_each_polygon(const MeshFile& mesh, Work&& work) {
  for (const Triangle& triangle : mesh.triangles) work(triangle);
  for (const Quad& quad : mesh.quads) work(quad);
}

void write_ply(Output& out, const MeshFile& mesh, const PlyAttributes& attributes) {
  // Single precision for all points, if no point loses a bit.
  const bool single = std::ranges::all_of(
      mesh.points, [](const Eigen::Vector3d& point) { return point == rounded_to_single(point); });
  const std::string type = single ? "float" : "double";
  out.text("ply\nformat binary_little_endian 1.0\n");
  if (mesh.origin) write_numbers(out, "comment origin", *mesh.origin);
  out.text("element vertex " + std::to_string(mesh.points.size()) + "\n");
  for (const char* axis : {" x\n", " y\n", " z\n"}) out.text("property " + type + axis);
  declare_ply_properties(out, attributes.points);
  out.text("element face " + std::to_string(mesh.triangles.size() + mesh.quads.size()) + "\n");
  // Most programs read signed indices only.
  out.text(mesh.points.size() <= 0x7fffffff ? "property list uchar int vertex_indices\n"
                                            : "property list uchar uint vertex_indices\n");
  declare_ply_properties(out, attributes.polygons);
  if (attributes.corner_uv) out.text("property list uchar float texcoord\n");
  out.text("end_header\n");
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    for (const double x : mesh.points[i]) single ? out.binary(static_cast<float>(x)) : out.binary(x);
    write_ply_values(out, attributes.points, i);
  }
  std::size_t number = 0, uv = 0;
  for_each_polygon(mesh, [&](const auto& polygon) {
    out.binary(static_cast<std::uint8_t>(polygon.size()));
    for (const std::uint32_t corner : polygon) out.binary(corner);
    write_ply_values(out, attributes.polygons, number++);
    if (!attributes.corner_uv) return;
    out.binary(static_cast<std::uint8_t>(2 * polygon.size()));
    for (std::size_t i = 0; i < 2 * polygon.size(); ++i)
      out.binary(std::get<0>(attributes.corner_uv->values)[uv++]);
  });
}

// Text is read in double precision, so points are written as doubles: the few digits that identify a float
// are another double.

void write_obj(Output& out, const MeshFile& mesh, const NamedAttributes& attributes) {
  if (mesh.origin) write_numbers(out, "# origin", *mesh.origin);
  const auto values = [](const MeshAttribute* attribute) -> const float* {
    return attribute ? std::get<0>(attribute->values).data() : nullptr;
  };
  const auto lines = [&](std::string_view lead, const float* from, std::size_t elements, std::size_t n) {
    for (std::size_t i = 0; from && i < elements; ++i) {
      out.text(lead);
      for (std::size_t k = 0; k < n; ++k) out.text(" "), out.text(NumberText(from[n * i + k]));
      out.text("\n");
    }
  };
  const float* colour = values(attributes.colour);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (!colour) {
      write_numbers(out, "v", mesh.points[i]);
      continue;
    }
    out.text("v");
    for (const double x : mesh.points[i]) out.text(" "), out.text(NumberText(x));
    for (std::size_t k = 0; k < 3; ++k) out.text(" "), out.text(NumberText(colour[3 * i + k]));
    out.text("\n");
  }
  const bool uv_of_corners = attributes.uv && attributes.uv->domain == AttributeDomain::corner;
  if (attributes.uv) lines("vt", values(attributes.uv), std::get<0>(attributes.uv->values).size() / 2, 2);
  lines("vn", values(attributes.normal), mesh.points.size(), 3);
  std::size_t number = 0, corners = 0;
  std::int32_t material = -2;
  for_each_polygon(mesh, [&](const auto& polygon) {
    if (attributes.material) {
      const std::int32_t own = std::get<1>(attributes.material->values)[number];
      const std::vector<std::string>& labels = attributes.material->labels;
      if (own != material)
        out.text(
            "usemtl " +
            (own >= 0 && std::size_t(own) < labels.size() ? labels[std::size_t(own)] : std::string("none")) +
            "\n");
      material = own;
    }
    ++number;
    out.text("f");
    for (const std::uint32_t corner : polygon) {
      // OBJ counts from 1.
      out.text(" ");
      out.text(NumberText(std::uint64_t(corner) + 1));
      ++corners;
      if (attributes.uv || attributes.normal) out.text("/");
      if (attributes.uv) out.text(NumberText(uv_of_corners ? corners : std::uint64_t(corner) + 1));
      if (attributes.normal) out.text("/"), out.text(NumberText(std::uint64_t(corner) + 1));
    }
    out.text("\n");
  });
}

void write_off(Output& out, const MeshFile& mesh) {
  out.text("OFF\n");
  if (mesh.origin) write_numbers(out, "# origin", *mesh.origin);
  out.text(std::to_string(mesh.points.size()) + " " +
           std::to_string(mesh.triangles.size() + mesh.quads.size()) + " 0\n");
  for (const Eigen::Vector3d& point : mesh.points)
    for (int axis = 0; axis < 3; ++axis) {
      out.text(NumberText(point[axis]));
      out.text(axis < 2 ? " " : "\n");
    }
  for_each_polygon(mesh, [&](const auto& polygon) {
    out.text(NumberText(polygon.size()));
    for (const std::uint32_t corner : polygon) {
      out.text(" ");
      out.text(NumberText(corner));
    }
    out.text("\n");
  });
}

/// Adds notes about the parts of this mesh that STL cannot store.
void note_losses_of_stl(const std::string& name, const MeshFile& mesh, RunContext& context) {
  std::vector<bool> used(mesh.points.size(), false);
  for_each_polygon(mesh, [&](const auto& polygon) {
    for (const std::uint32_t corner : polygon) used[corner] = true;
  });
  std::size_t unused = 0, moved = 0;
  double largest_shift = 0.0;
  // Counts points that become equal by merging before and after rounding, as a reader of STL merges them.
  std::vector<Eigen::Vector3d> before, after;
  PointMerger merge_before(before), merge_after(after);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    unused += !used[i];
    if (!used[i]) continue;
    const Eigen::Vector3d rounded = rounded_to_single(mesh.points[i]);
    if (!rounded.allFinite())
      throw Error(joined("cannot write ", in_quotes(name), ": a coordinate is too large for STL"));
    moved += rounded != mesh.points[i];
    largest_shift = std::max(largest_shift, (rounded - mesh.points[i]).norm());
    merge_before.add(mesh.points[i]);
    merge_after.add(rounded);
  }
  if (moved > 0)
    context.note(joined(in_quotes(name), ": STL has single precision only: ", moved,
                        " points moved, by at most ", three_digits(largest_shift), ", and ",
                        before.size() - after.size(), " became equal to another"));
  if (unused > 0)
    context.note(joined(in_quotes(name), ": STL holds triangles only: ", unused,
                        " points that no polygon uses were left out"));
}

void write_stl_triangle(Output& out, const std::array<Eigen::Vector3d, 3>& corners) {
  // The normal of the rounded corners, or 0 for a triangle without an area.
  const Eigen::Vector3d across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double length = across.norm();
  const bool degenerate = !(length > 0.0 && std::isfinite(length));
  for (const double x : across) out.binary(degenerate ? 0.0f : static_cast<float>(x / length));
  for (const Eigen::Vector3d& corner : corners)
    for (const double x : corner) out.binary(static_cast<float>(x));
  out.binary(std::uint16_t(0));  // attribute bytes without a standard meaning
}

void write_stl(Output& out, const MeshFile& mesh) {
  if (mesh.triangle_count() > 0xffffffff) throw Error("an STL file cannot hold more than 2^32 triangles");
  // Not "solid", which readers take for text.
  std::string header = "binary STL";
  header.resize(80, ' ');
  out.text(header);
  out.binary(static_cast<std::uint32_t>(mesh.triangle_count()));
  for_each_triangle(
      mesh, [&](auto... corners) { write_stl_triangle(out, {rounded_to_single(mesh.points[corners])...}); });
}

}  // namespace

bool states_unit(const std::filesystem::path& path) {
  const std::optional<MeshPath> named = parse_mesh_path(path);
  return named &&
         (named->format == Format::glb || named->format == Format::gltf || named->format == Format::three_mf);
}

void write_mesh(const std::filesystem::path& path, const PolygonMesh& mesh, RunContext& context,
                double metres) {
  const Stage stage(context, "write");
  const std::string name = path.string();
  const std::optional<MeshPath> named = parse_mesh_path(path);
  if (!named) throw_unknown_extension(path);
  // Coordinates are checked before there is a file.
  const MeshFile file = to_mesh_file(mesh);
  for (std::size_t i = 0; i < file.points.size(); ++i)
    if (!file.points[i].allFinite())
      throw Error(joined("cannot write ", in_quotes(name), ": point ", i, " is not finite"));
  if (named->format == Format::stl) note_losses_of_stl(name, file, context);
  // In this order, so that an Error closes the stream before it removes the file.
  AtomicFile temporary(path);
  Output out(temporary.path(), path, named->gzipped, context);
  const ByteSink sink = [&out](std::string_view bytes) { out.text(bytes); };
  switch (named->format) {
    case Format::ply:
      write_ply(out, file, ply_attributes(file, name, context));
      break;
    case Format::obj:
      write_obj(out, file,
                named_attributes(file.attributes, "colour normal uv material", "an OBJ", name, context));
      break;
    case Format::off:
      named_attributes(file.attributes, "", "an OFF", name, context);
      write_off(out, file);
      break;
    case Format::stl:
      named_attributes(file.attributes, "", "an STL", name, context);
      write_stl(out, file);
      break;
    case Format::glb:
    case Format::gltf:
      write_gltf(sink, mesh, named->format == Format::glb, name, metres > 0.0 ? metres : 1.0, context);
      break;
    case Format::three_mf:
      write_three_mf(sink, mesh, metres, name, context);
      break;
  }
  out.close();
  temporary.commit();
}

}  // namespace hermesh
