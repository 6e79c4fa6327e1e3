#include "experiments/pictures/ray_scene.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#if HERMESH_EMBREE_MAJOR == 4
#include <embree4/rtcore.h>
#elif HERMESH_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#else
#error "experiments/CMakeLists.txt says for which sources HERMESH_EMBREE_MAJOR is defined"
#endif

namespace hermesh {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kSamplesPerAxis = 2;
constexpr int kOcclusionRays = 4;  // a sample, 16 a pixel: smooth enough at 400 pixels, seconds for a sheet
constexpr float kEdgePixels = 0.55f;  // half width of a drawn edge
const Vector3f kBackgroundTop(0.955f, 0.963f, 0.972f), kBackgroundBottom(0.87f, 0.885f, 0.905f);
const Vector3f kFront(0.80f, 0.775f, 0.735f), kBack(0.78f, 0.30f, 0.24f), kEdge(0.07f, 0.10f, 0.17f);

// Embree 4 takes as optional arguments the parameters that Embree 3 took from a context.

void find_first_hit(RTCScene scene, RTCRayHit& hit) {
#if HERMESH_EMBREE_MAJOR == 4
  rtcIntersect1(scene, &hit);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &hit);
#endif
}

/// Makes the ray's tfar negative if it hits anything.
void find_any_hit(RTCScene scene, RTCRay& ray) {
#if HERMESH_EMBREE_MAJOR == 4
  rtcOccluded1(scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

RTCRay ray_from(const Vector3f& start, const Vector3f& direction, float distance) {
  RTCRay ray{};
  ray.org_x = start.x(), ray.org_y = start.y(), ray.org_z = start.z();
  ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
  ray.tfar = distance;
  ray.mask = ~0u;
  return ray;
}

/// Returns the first hit of a ray, if there is one.
std::optional<RTCRayHit> first_hit(RTCScene scene, const Vector3f& start, const Vector3f& direction) {
  RTCRayHit hit{};
  hit.ray = ray_from(start, direction, std::numeric_limits<float>::infinity());
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  find_first_hit(scene, hit);
  if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return hit;
}

std::uint32_t hashed(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

float unit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

float to_srgb(float linear) {
  const float c = std::clamp(linear, 0.0f, 1.0f);
  return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1.0f / 2.4f) - 0.055f;
}

Vector3f to_linear(const Vector3f& srgb) {
  return srgb.unaryExpr(
      [](float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); });
}

std::uint32_t packed(const Vector3f& linear) {
  const auto byte = [](float c) { return static_cast<std::uint32_t>(to_srgb(c) * 255.0f + 0.5f); };
  return 0xff000000u | byte(linear.x()) << 16 | byte(linear.y()) << 8 | byte(linear.z());
}

}  // namespace

struct RayScene::Machinery {
  explicit Machinery(const PolygonMesh& m) : mesh(m), device(rtcNewDevice(nullptr)) {
    if (!device) throw Error("Embree could not be started; the pictures need a CPU with SSE2");
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT);
    if (!mesh.empty()) add_triangles();
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) == RTC_ERROR_NONE) return;
    release();
    throw Error("the picture of a mesh with " + std::to_string(corners.size()) +
                " triangles needs more memory than there is");
  }
  ~Machinery() { release(); }

  void add_triangles() {
    corners = triangulated(mesh);
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree reads 16 bytes per point, so its own buffer of points is padded; the corners are shared.
    float* points = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.points.size()));
    if (points) std::copy_n(mesh.points.front().data(), 3 * mesh.points.size(), points);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, corners.data(), 0,
                               sizeof(Triangle), corners.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  void release() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
    scene = nullptr;
    device = nullptr;
  }

  const PolygonMesh& mesh;
  std::vector<Triangle> corners;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

RayScene::RayScene(const PolygonMesh& mesh) : machinery_(std::make_unique<Machinery>(mesh)) {}
RayScene::~RayScene() = default;

Camera make_camera(double azimuth, double elevation) {
  const double a = azimuth * std::numbers::pi / 180.0,
               e = std::clamp(elevation, -89.0, 89.0) * std::numbers::pi / 180.0;
  Camera camera;
  camera.towards = Eigen::Vector3d(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a));
  camera.right = Eigen::Vector3d::UnitY().cross(camera.towards).normalized();
  camera.up = camera.towards.cross(camera.right);
  return camera;
}

namespace {

/// Returns a distance from the centre of the view that is outside the box of the mesh.
double reach_of(const PolygonMesh& mesh, const View& view) {
  const Bounds box = bounds(mesh);
  return box.empty() ? 1.0 : box.size().norm() + (0.5 * (box.lower + box.upper) - view.centre).norm();
}

/// The scene, camera and lights of an image, in single precision relative to the mesh's origin.
struct Painter {
  RTCScene scene;
  const PolygonMesh& mesh;
  const std::vector<Triangle>& corners;
  Vector3f right, up, towards, centre, key_light;
  float pixel, occlusion_radius, far_away;
  const View& view;

  Vector3f background(float row) const {
    return to_linear(kBackgroundTop +
                     (kBackgroundBottom - kBackgroundTop) * (row / static_cast<float>(view.height)));
  }

  bool blocked(const Vector3f& from, const Vector3f& direction, float distance) const {
    RTCRay ray = ray_from(from, direction, distance);
    find_any_hit(scene, ray);
    return ray.tfar < 0.0f;
  }

  /// Returns the share of the sky visible from a point with this normal, by cosine-weighted rays; `seed`
  /// turns their pattern.
  float open_sky(const Vector3f& position, const Vector3f& normal, std::uint32_t seed) const {
    const Vector3f tangent = normal.unitOrthogonal(), bitangent = normal.cross(tangent);
    int open = 0;
    for (int i = 0; i < kOcclusionRays; ++i) {
      const std::uint32_t bits = hashed(seed + static_cast<std::uint32_t>(i) * 0x9e3779b9u);
      const float radius2 = (static_cast<float>(i) + unit(bits)) / kOcclusionRays;
      const float angle = 2.0f * std::numbers::pi_v<float> * unit(hashed(bits));
      const Vector3f direction =
          std::sqrt(radius2) * (std::cos(angle) * tangent + std::sin(angle) * bitangent) +
          std::sqrt(1.0f - radius2) * normal;
      if (!blocked(position, direction, occlusion_radius)) ++open;
    }
    return static_cast<float>(open) / kOcclusionRays;
  }

  /// Returns the coverage of a hit by an edge, 0 to 1. Distances to the edges are measured on the screen,
  /// where a parallel projection preserves barycentric coordinates; the diagonal of a quad is left out, and
  /// edges fade if polygons are smaller than a few pixels, so that a dense mesh does not turn black.
  float edge_cover(std::uint32_t triangle, float u, float v) const {
    std::array<Vector2f, 3> screen;
    for (int i = 0; i < 3; ++i) {
      const Vector3f p = mesh.points[corners[triangle][i]];
      screen[i] = Vector2f(p.dot(right), p.dot(up)) / pixel;
    }
    const Vector2f ab = screen[1] - screen[0], ac = screen[2] - screen[0];
    const float area2 = std::abs(ab.x() * ac.y() - ab.y() * ac.x());
    const std::array<float, 3> weight{1.0f - u - v, u, v};
    const bool of_quad = triangle >= mesh.triangles.size();
    // Triangles abc and acd of a quad: the diagonal lies opposite b in the first and opposite d in the
    // second.
    const int diagonal = !of_quad ? -1 : (triangle - mesh.triangles.size()) % 2 == 0 ? 1 : 2;
    float nearest = std::numeric_limits<float>::infinity(), longest = 0.0f;
    for (int i = 0; i < 3; ++i) {
      const float length = (screen[(i + 1) % 3] - screen[(i + 2) % 3]).norm();
      longest = std::max(longest, length);
      if (i != diagonal && length > 0.0f) nearest = std::min(nearest, weight[i] * area2 / length);
    }
    const float fade = smooth_step(3.0f, 16.0f, longest);
    return fade * (1.0f - smooth_step(kEdgePixels, kEdgePixels + 0.7f, nearest));
  }

  Vector3f sample(float x, float y, std::uint32_t seed) const {
    const Vector3f start = centre + (x - 0.5f * static_cast<float>(view.width)) * pixel * right +
                           (0.5f * static_cast<float>(view.height) - y) * pixel * up + far_away * towards;
    const auto hit = first_hit(scene, start, -towards);
    if (!hit) return background(y);
    Vector3f normal = Vector3f(hit->hit.Ng_x, hit->hit.Ng_y, hit->hit.Ng_z).normalized();
    const bool from_behind = normal.dot(towards) < 0.0f;
    if (from_behind) normal = -normal;
    const Vector3f position = start - hit->ray.tfar * towards + 1e-3f * occlusion_radius * normal;
    const float sky = open_sky(position, normal, seed);
    const float key = std::max(0.0f, normal.dot(key_light));
    const float lit =
        key > 0.0f && !blocked(position, key_light, 3.0f * occlusion_radius) ? key : 0.25f * key;
    const float fill = 0.5f + 0.5f * normal.dot(up);
    // A light at the viewer, without which faces in the shadow of another part are nearly black.
    const float head = normal.dot(towards);
    Vector3f colour =
        to_linear(from_behind ? kBack : kFront) * (0.78f * lit + sky * (0.18f + 0.27f * fill) + 0.32f * head);
    if (view.edges)
      colour += (to_linear(kEdge) - colour) * (0.7f * edge_cover(hit->hit.primID, hit->hit.u, hit->hit.v));
    return colour;
  }

  /// Returns the mean of the samples of a pixel, or the first one if the last one has the same colour, as on
  /// a flat face in the light.
  std::uint32_t pixel_colour(int column, int row) const {
    constexpr int kSamples = kSamplesPerAxis * kSamplesPerAxis;
    const auto at = [&](int i) {
      const float x =
          static_cast<float>(column) + (static_cast<float>(i % kSamplesPerAxis) + 0.5f) / kSamplesPerAxis;
      const float y =
          static_cast<float>(row) + (static_cast<float>(i / kSamplesPerAxis) + 0.5f) / kSamplesPerAxis;
      return sample(x, y, hashed(static_cast<std::uint32_t>((row * view.width + column) * 16 + i)));
    };
    const Vector3f first = at(0), last = at(kSamples - 1);
    if (first == last) return packed(first);
    Vector3f sum = first;
    for (int i = 1; i < kSamples - 1; ++i) sum += at(i);
    return packed((sum + last) / kSamples);
  }
};

}  // namespace

std::vector<Glimpse> RayScene::glimpses(const Camera& camera, const View& view, RunContext& context) const {
  const double reach = reach_of(machinery_->mesh, view);
  const double pixel = view.world_width / view.width;
  const Eigen::Vector3d centre = view.centre - machinery_->mesh.origin + reach * camera.towards;
  std::vector<Glimpse> seen(static_cast<std::size_t>(view.width) * view.height);
  tbb::parallel_for(tbb::blocked_range<int>(0, view.height), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row) {
      context.check();
      for (int column = 0; column < view.width; ++column) {
        const Vector3f start = (centre + (column + 0.5 - 0.5 * view.width) * pixel * camera.right +
                                (0.5 * view.height - row - 0.5) * pixel * camera.up)
                                   .cast<float>();
        const Vector3f ahead = (-camera.towards).cast<float>();
        const auto hit = first_hit(machinery_->scene, start, ahead);
        if (!hit) continue;
        Glimpse& glimpse = seen[static_cast<std::size_t>(row) * view.width + column];
        glimpse.hit = true;
        glimpse.normal = Vector3f(hit->hit.Ng_x, hit->hit.Ng_y, hit->hit.Ng_z).normalized();
        if (glimpse.normal.dot(ahead) > 0.0f) glimpse.normal = -glimpse.normal;
        glimpse.place = machinery_->mesh.origin + (start + hit->ray.tfar * ahead).cast<double>();
      }
    }
  });
  return seen;
}

Image RayScene::render(const Camera& camera, const View& view, RunContext& context) const {
  const PolygonMesh& mesh = machinery_->mesh;
  const Vector3f right = camera.right.cast<float>(), up = camera.up.cast<float>(),
                 towards = camera.towards.cast<float>();
  const Painter painter{machinery_->scene,
                        mesh,
                        machinery_->corners,
                        right,
                        up,
                        towards,
                        (view.centre - mesh.origin).cast<float>(),
                        (-0.45f * right + 0.75f * up + 0.65f * towards).normalized(),
                        static_cast<float>(view.world_width / view.width),
                        static_cast<float>(view.occlusion_radius),
                        static_cast<float>(reach_of(mesh, view)),
                        view};
  Image image{view.width, view.height,
              std::vector<std::uint32_t>(static_cast<std::size_t>(view.width) * view.height)};
  tbb::parallel_for(tbb::blocked_range<int>(0, view.height, 4), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row) {
      context.check();
      for (int column = 0; column < view.width; ++column)
        image.pixels[static_cast<std::size_t>(row) * view.width + column] = painter.pixel_colour(column, row);
    }
  });
  return image;
}

}  // namespace hermesh
