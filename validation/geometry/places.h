// Collecting the places of the first offenders, in an order that does not depend on the number of threads.
#pragma once

#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Adds a place unless there are kMaxPlaces already.
inline void add_place(Places& places, const Eigen::Vector3d& point, std::int64_t first,
                      std::int64_t second = -1) {
  if (places.points.size() >= kMaxPlaces) return;
  places.points.push_back(point);
  places.polygons.push_back({first, second});
}

/// Appends the places of `later` behind those of `places`, up to kMaxPlaces in all.
inline void append_places(Places& places, const Places& later) {
  for (std::size_t i = 0; i < later.points.size(); ++i)
    add_place(places, later.points[i], later.polygons[i][0], later.polygons[i][1]);
}

}  // namespace hermesh::validation
