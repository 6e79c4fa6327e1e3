// Embree 3 or 4, whichever CMake found: their headers and the two questions asked of them. Version 4 gives
// its intersection functions what version 3 took from a context as arguments, which may be left out.
#pragma once

#if HERMESH_EMBREE_MAJOR == 4
#include <embree4/rtcore.h>
#elif HERMESH_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#else
#error "experiments/CMakeLists.txt says for which sources HERMESH_EMBREE_MAJOR is defined"
#endif

namespace hermesh {

/// Finds the first thing that the ray meets.
inline void find_first_hit(RTCScene scene, RTCRayHit& hit) {
#if HERMESH_EMBREE_MAJOR == 4
  rtcIntersect1(scene, &hit);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &hit);
#endif
}

/// Makes the ray's tfar negative if it meets anything.
inline void find_any_hit(RTCScene scene, RTCRay& ray) {
#if HERMESH_EMBREE_MAJOR == 4
  rtcOccluded1(scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

}  // namespace hermesh
