// Hermite data: solids on a lattice, and their Booleans.
#include "algorithms/hermite/solids.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {

const Solid::Data& Inside::data(const Solid& solid) {
  require(solid.data_ != nullptr, "the solid is empty");
  return *solid.data_;
}

Solid Inside::solid(Solid::Data&& data) {
  return Solid(std::make_shared<const Solid::Data>(std::move(data)));
}

Solid::Solid() = default;

Solid Solid::of(const Volume& level_set, Context& context) {
  return run(context, [&](RunContext& inner) {
    FloatHermite hermite = sample_level_set(Inside::level_set(level_set), 0.0, inner);
    return Inside::solid({level_set, std::move(hermite)});
  });
}

Solid Solid::of(const Volume& level_set, const Mesh& source, Context& context) {
  return run(context, [&](RunContext& inner) {
    PolygonMesh copy;
    PolygonSampling sampling;
    FloatHermite hermite =
        sample_polygons(Inside::level_set(level_set), 0.0, Inside::sampled(source, copy), inner, &sampling);
    if (const std::string note = missed_edges_note(sampling); !note.empty()) inner.note(note);
    return Inside::solid({level_set, std::move(hermite)});
  });
}

const Volume& Solid::level_set() const noexcept { return data_->level_set; }
std::size_t Solid::crossings() const noexcept { return data_->hermite.crossings.size(); }
std::size_t Solid::memory_bytes() const noexcept { return data_->hermite.memory_bytes(); }

std::vector<float> Solid::crossing_points() const {
  const FloatHermite& hermite = Inside::data(*this).hermite;
  const IndexToWorld& placement = hermite.placement;
  std::vector<float> places;
  places.reserve(3 * hermite.crossings.size());
  for (std::size_t leaf = 0; leaf < hermite.leaves.size(); ++leaf)
    for_each_crossing(hermite, leaf, [&](int axis, int sample, const EdgeCrossing& crossing) {
      const auto& lower = hermite.leaves[leaf].lower;
      Eigen::Vector3d index(lower[0] + (sample >> 6) - placement.base[0],
                            lower[1] + (sample >> 3 & 7) - placement.base[1],
                            lower[2] + (sample & 7) - placement.base[2]);
      index[axis] += double(crossing.offset);
      for (const double x : Eigen::Vector3d(placement.origin + placement.local(index)))
        places.push_back(float(x));
    });
  return places;
}

std::vector<float> Solid::crossing_normals() const {
  const FloatHermite& hermite = Inside::data(*this).hermite;
  // A plane's normal is transformed by the inverse transpose.
  const Eigen::Matrix3d to_world = hermite.placement.linear.inverse().transpose();
  std::vector<float> normals;
  normals.reserve(3 * hermite.crossings.size());
  for (const EdgeCrossing& crossing : hermite.crossings) {
    const Eigen::Vector3d index(crossing.normal[0], crossing.normal[1], crossing.normal[2]);
    for (const double x : Eigen::Vector3d((to_world * index).normalized())) normals.push_back(float(x));
  }
  return normals;
}

Solid combine(Boolean operation, const Solid& a, const Solid& b, Context& context) {
  return run(context, [&](RunContext& inner) {
    const auto sampled = [](const Solid& solid) {
      const auto& data = Inside::data(solid);
      return SampledSolid{Inside::level_set(data.level_set), data.hermite, {}};
    };
    CombinedSolid combined = hermesh::combine(inner_boolean(operation), sampled(a), sampled(b), inner);
    return Inside::solid({Inside::volume(combined.level_set), std::move(combined.hermite)});
  });
}

}  // namespace hermesh::v1
