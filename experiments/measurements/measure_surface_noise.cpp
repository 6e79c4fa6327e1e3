// Figure 9.11 of the thesis: the noise of a surface after adaptive extraction, by wavelength.
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Lower ends of the bands of wavelengths, voxels; each reaches up to twice its lower end, the last to the
/// window's width.
constexpr std::array<int, 5> kBands = {2, 4, 8, 16, 32};
/// Wavelengths of the noise, voxels: about the distance of the particles of a fluid, which are a few voxels
/// wide.
constexpr double kShortest = 4.0, kLongest = 16.0;
/// Root mean squares of the noise, voxels.
constexpr std::array<double, 3> kNoises = {0.03, 0.1, 0.3};

struct SmoothingWay {
  std::string label, extractor;
  GivenOptions options;
};
/// Adaptive dual contouring of the thesis, ours, and OpenVDB's. Hermite data are floats, since the thesis's
/// ten bytes lose crossings with normals along +z, which are common here.
std::vector<SmoothingWay> smoothing_ways() {
  std::vector<SmoothingWay> result;
  for (const double threshold : {0.0, 0.05, 0.1, 0.25, 0.5, 2.0, 8.0})
    result.push_back(
        {"adaptive, E " + readable(threshold),
         "adaptive-dual-contouring",
         {{"threshold", readable(threshold)}, {"hermite", "level-set"}, {"representation", "sparse-float"}}});
  for (const double tolerance : {0.1, 0.25, 0.5})
    result.push_back({"manifold, " + readable(tolerance),
                      "manifold-dual-contouring",
                      {{"tolerance", readable(tolerance)}, {"hermite", "level-set"}}});
  for (const double adaptivity : {0.0, 0.1, 0.5, 1.0})
    result.push_back({"openvdb, " + readable(adaptivity), "openvdb", {{"adaptivity", readable(adaptivity)}}});
  return result;
}

/// A wave over the window: height amplitude · cos(2π (u x + v y) / width + phase), with u and v whole
/// numbers, so that it is periodic there.
struct Wave {
  int u, v;
  double amplitude, phase;
};

/// Heights over the plane, in voxels: a smooth swell, and noise whose power is spread evenly over its wave
/// numbers.
class Surface {
 public:
  Surface(int width, double noise_rms, double swell, std::uint64_t seed) : width_(width) {
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
    swell_ = {{1, 0, swell, 0.4}, {1, 1, 0.6 * swell, 2.1}, {0, 2, 0.4 * swell, 4.0}};
    const int most = int(width / kShortest);
    for (int u = 0; u <= most; ++u)
      for (int v = u == 0 ? 1 : -most; v <= most; ++v) {  // one of each pair of opposite wave vectors
        const double length = width / std::hypot(u, v);
        if (length >= kShortest && length < kLongest)
          noise_.push_back({u, v, 1.0, 2.0 * std::numbers::pi * uniform()});
      }
    // A cosine of amplitude a has a root mean square of a / √2, and waves of different numbers add up in
    // squares.
    for (Wave& wave : noise_) wave.amplitude = noise_rms * std::sqrt(2.0 / double(noise_.size()));
  }
  double smooth(double x, double y) const { return sum(swell_, x, y); }
  double noise(double x, double y) const { return sum(noise_, x, y); }

 private:
  double sum(const std::vector<Wave>& waves, double x, double y) const {
    double height = 0.0;
    for (const Wave& wave : waves)
      height +=
          wave.amplitude * std::cos(2.0 * std::numbers::pi * (wave.u * x + wave.v * y) / width_ + wave.phase);
    return height;
  }
  int width_;
  std::vector<Wave> swell_, noise_;
};

/// Returns a closed, oriented block with the surface as its top, on a grid of side × side points from `start`
/// on.
PolygonMesh block_under(const std::vector<double>& heights, int side, double spacing, double start,
                        double depth) {
  PolygonMesh mesh;
  const auto top = [&](int i, int j) { return std::uint32_t(i * side + j); };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      mesh.points.emplace_back(float(start + i * spacing), float(start + j * spacing),
                               float(heights[std::size_t(i) * std::size_t(side) + std::size_t(j)]));
  for (int i = 0; i + 1 < side; ++i)
    for (int j = 0; j + 1 < side; ++j) {
      mesh.triangles.push_back({top(i, j), top(i + 1, j), top(i + 1, j + 1)});
      mesh.triangles.push_back({top(i, j), top(i + 1, j + 1), top(i, j + 1)});
    }
  std::vector<std::uint32_t> rim;  // counter-clockwise, seen from above
  for (int i = 0; i + 1 < side; ++i) rim.push_back(top(i, 0));
  for (int j = 0; j + 1 < side; ++j) rim.push_back(top(side - 1, j));
  for (int i = side - 1; i > 0; --i) rim.push_back(top(i, side - 1));
  for (int j = side - 1; j > 0; --j) rim.push_back(top(0, j));
  const auto first = std::uint32_t(mesh.points.size());
  for (const std::uint32_t point : rim) {
    const Eigen::Vector3f above = mesh.points[point];
    mesh.points.emplace_back(above.x(), above.y(), float(-depth));
  }
  const auto centre = std::uint32_t(mesh.points.size());
  const auto middle = float(start + 0.5 * (side - 1) * spacing);
  mesh.points.emplace_back(middle, middle, float(-depth));
  for (std::uint32_t i = 0; i < rim.size(); ++i) {
    const std::uint32_t next = (i + 1) % std::uint32_t(rim.size());
    mesh.triangles.push_back({rim[i], first + i, first + next});
    mesh.triangles.push_back({rim[i], first + next, rim[next]});
    mesh.triangles.push_back({centre, first + next, first + i});
  }
  return mesh;
}

/// Returns the heights of a mesh's top over the samples (i, j) of the window; NaN without one.
std::vector<double> heights_of(const PolygonMesh& mesh, int width, double floor) {
  std::vector<double> heights(std::size_t(width) * std::size_t(width),
                              std::numeric_limits<double>::quiet_NaN());
  for (const Triangle& t : triangulated(mesh)) {
    const Vector3d a = mesh.world(t[0]), b = mesh.world(t[1]), c = mesh.world(t[2]);
    const double area = (b - a).head<2>().x() * (c - a).y() - (b - a).y() * (c - a).x();
    if (area <= 0.0 || std::min({a.z(), b.z(), c.z()}) < floor) continue;
    const Vector3d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    for (int i = std::max(0, int(std::ceil(low.x()))); i <= std::min(width - 1, int(std::floor(high.x())));
         ++i)
      for (int j = std::max(0, int(std::ceil(low.y()))); j <= std::min(width - 1, int(std::floor(high.y())));
           ++j) {
        const auto side = [&](const Vector3d& p, const Vector3d& q) {
          return (q.x() - p.x()) * (j - p.y()) - (q.y() - p.y()) * (i - p.x());
        };
        const double wc = side(a, b) / area, wa = side(b, c) / area, wb = side(c, a) / area;
        if (std::min({wa, wb, wc}) < -1e-9) continue;
        double& height = heights[std::size_t(i) * std::size_t(width) + std::size_t(j)];
        const double here = wa * a.z() + wb * b.z() + wc * c.z();
        if (!(height > here)) height = here;
      }
  }
  return heights;
}

/// Transforms a power of two of numbers in place (Cooley and Tukey).
void transform(std::vector<std::complex<double>>& values) {
  const std::size_t n = values.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(values[i], values[j]);
  }
  for (std::size_t length = 2; length <= n; length *= 2)
    for (std::size_t begin = 0; begin < n; begin += length)
      for (std::size_t k = 0; k < length / 2; ++k) {
        const std::complex<double> turn =
            std::polar(1.0, -2.0 * std::numbers::pi * double(k) / double(length));
        const std::complex<double> even = values[begin + k], odd = turn * values[begin + k + length / 2];
        values[begin + k] = even + odd;
        values[begin + k + length / 2] = even - odd;
      }
}

/// Root mean square by bands of wavelengths, and of all; without the mean. By Parseval's theorem the squares
/// of the bands add up to that of all, except for wavelengths below the shortest band.
struct Roughness {
  std::array<double, kBands.size()> bands{};
  double all = 0.0;
};
Roughness roughness_of(const std::vector<double>& heights, int width) {
  const auto n = std::size_t(width);
  std::vector<std::complex<double>> spectrum(heights.begin(), heights.end()), line(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::copy_n(&spectrum[i * n], n, line.begin());
    transform(line);
    std::copy_n(line.begin(), n, &spectrum[i * n]);
  }
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) line[i] = spectrum[i * n + j];
    transform(line);
    for (std::size_t i = 0; i < n; ++i) spectrum[i * n + j] = line[i];
  }
  Roughness result;
  double sum = 0.0;
  std::array<double, kBands.size()> sums{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      if (i == 0 && j == 0) continue;
      const double u = double(std::min(i, n - i)), v = double(std::min(j, n - j));
      const double power = std::norm(spectrum[i * n + j]) / std::pow(double(n), 4);
      sum += power;
      const double length = double(width) / std::hypot(u, v);
      for (std::size_t band = kBands.size(); band-- > 0;)
        if (length >= kBands[band]) {
          sums[band] += power;
          break;
        }
    }
  result.all = std::sqrt(sum);
  for (std::size_t band = 0; band < kBands.size(); ++band) result.bands[band] = std::sqrt(sums[band]);
  return result;
}

class SurfaceNoiseMeasurer {
 public:
  explicit SurfaceNoiseMeasurer(const MeasurementInput& input)
      : input_(input),
        width_(int(input.parameters.number("width"))),
        surface_(width_, 0.0, input.parameters.number("swell"), input.seed) {}

  std::vector<MeasuredRow> run() {
    for (const double noise : kNoises) run(noise);
    draw();
    return std::move(rows_);
  }

 private:
  static constexpr const char* kInput = "polygons";
  static std::string label_of(const std::string& way, double noise) { return readable(noise) + ": " + way; }

  void run(double noise) {
    std::vector<SmoothingWay> all = smoothing_ways();
    std::erase_if(
        all, [&](const SmoothingWay& way) { return !input_.wants("roughness", label_of(way.label, noise)); });
    if (all.empty() && !input_.wants("roughness", label_of(kInput, noise))) return;
    surface_ = Surface(width_, noise, input_.parameters.number("swell"), input_.seed);
    const double depth = 12.0 + 2.0 * input_.parameters.number("swell");
    constexpr double kSpacing = 0.5, kMargin = 12.0;
    const int side = int((width_ + 2 * kMargin) / kSpacing) + 1;
    std::vector<double> heights;
    for (int i = 0; i < side; ++i)
      for (int j = 0; j < side; ++j) {
        const double x = -kMargin + kSpacing * i, y = -kMargin + kSpacing * j;
        heights.push_back(surface_.smooth(x, y) + surface_.noise(x, y));
      }
    const PolygonMesh block = block_under(heights, side, kSpacing, -kMargin, depth);
    floor_ = -0.5 * depth;
    box_ = bounds(block);
    truth_ = {};
    add_row(kInput, noise, block, {});
    if (all.empty()) return;
    const LevelSet level_set = voxelized(block, {.voxel_size = 1.0}, input_);
    for (const SmoothingWay& way : all) {
      input_.context.progress(way.label, 0.0);
      RunContext child = child_context(input_.context, false);
      const ExtractRecipe recipe{.chosen = choose(input_.tables.extractors, way.extractor, way.options)};
      add_row(way.label, noise, extract(level_set, nullptr, recipe, child).mesh, way.options);
    }
  }

  void add_row(const std::string& way, double noise, const PolygonMesh& mesh, const GivenOptions& options) {
    const std::string label = label_of(way, noise);
    std::vector<double> residual = heights_of(mesh, width_, floor_), noise_left = residual;
    MeasuredRow row{"roughness", label};
    std::size_t holes = 0;
    for (int i = 0; i < width_; ++i)
      for (int j = 0; j < width_; ++j) {
        const std::size_t at = std::size_t(i) * std::size_t(width_) + std::size_t(j);
        if (std::isnan(residual[at])) {
          // A fold may hide a sample; the smooth surface stands in, and the row states the number.
          ++holes;
          residual[at] = surface_.smooth(i, j);
        }
        const double height = residual[at];
        residual[at] = height - surface_.smooth(i, j);
        noise_left[at] = height - surface_.smooth(i, j) - surface_.noise(i, j);
      }
    const Roughness rough = roughness_of(residual, width_);
    row.values = {{"noise", noise}, {"points", mesh.points.size()}, {"rms", rough.all}, {"holes", holes}};
    for (std::size_t band = 0; band < kBands.size(); ++band)
      row.values["rms_from_" + std::to_string(kBands[band])] = rough.bands[band];
    // The first row is the noise of the input, shown or not.
    if (way == kInput) truth_ = rough;
    const double noisy = std::hypot(truth_.bands[1], truth_.bands[2]);
    if (noisy > 0.0) row.values["noise_kept"] = std::hypot(rough.bands[1], rough.bands[2]) / noisy;
    row.values["from_noisy"] = roughness_of(noise_left, width_).all;
    if (const auto threshold = options.find("threshold"); threshold != options.end())
      row.values["threshold"] = std::stod(threshold->second);
    if (double(holes) > 0.001 * double(residual.size()))
      row.broken.push_back("more than a thousandth of the window has no height");
    if (input_.parameters.number("pixels") > 0 && drawn(way)) {
      pictures_.push_back({label,
                           {std::to_string(mesh.points.size()) + " points",
                            readable(100.0 * row.values.value("noise_kept", 0.0)) + " % of the noise kept"},
                           [mesh] { return mesh; }});
    }
    if (const auto threshold = row.values.find("threshold");
        threshold != row.values.end() && *threshold > 0.0)
      rows_.push_back({"kept",
                       "noise of " + readable(noise) + " voxel",
                       {{"threshold", *threshold}, {"noise_kept", row.values["noise_kept"]}}});
    rows_.push_back(std::move(row));
  }

  static bool drawn(const std::string& way) {
    return way == kInput || way == "adaptive, E 0" || way == "adaptive, E 0.25" || way == "adaptive, E 2" ||
           way == "manifold, 0.25";
  }

  void draw() {
    if (pictures_.empty()) return;
    Sheet sheet;
    sheet.title = "Figure 9.11: noise of a surface, before and after adaptive extraction";
    sheet.subtitle =
        "a swell with noise, its rms in voxels first, wavelengths of 4 to 16 voxels; the window is " +
        std::to_string(width_) + " voxels wide; thresholds E in square voxels";
    sheet.viewpoint = {35.0, 62.0};
    sheet.close_up = {{0.5, 0.8, 0.5}, 0.22};
    sheet.cell_pixels = int(input_.parameters.number("pixels"));
    // In pictures y points up, here z.
    for (Picture& picture : pictures_)
      picture.load = [load = picture.load] {
        PolygonMesh mesh = load();
        for (Eigen::Vector3f& point : mesh.points) point = {point.y(), point.z(), point.x()};
        mesh.origin = Vector3d(mesh.origin.y(), mesh.origin.z(), mesh.origin.x());
        return mesh;
      };
    sheet.frame.add({box_.lower.y(), box_.lower.z(), box_.lower.x()});
    sheet.frame.add({box_.upper.y(), box_.upper.z(), box_.upper.x()});
    sheet.pictures = std::move(pictures_);
    render_sheet(input_.out / ("figure-9-11-" + std::to_string(width_) + ".png"), std::move(sheet),
                 input_.context);
  }

  const MeasurementInput& input_;
  const int width_;
  Surface surface_;
  Bounds box_;
  double floor_ = 0.0;
  Roughness truth_;
  std::vector<Picture> pictures_;
  std::vector<MeasuredRow> rows_;
};

}  // namespace

std::vector<MeasuredRow> measure_surface_noise(const MeasurementInput& input) {
  return SurfaceNoiseMeasurer(input).run();
}

}  // namespace hermesh
