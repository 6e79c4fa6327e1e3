// What a public solid holds.
#pragma once

#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {

struct HERMESH_INNER Solid::Data {
  Volume level_set;
  FloatHermite hermite;
};

inline hermesh::Boolean inner_boolean(Boolean operation) {
  switch (operation) {
    case Boolean::union_of:
      return hermesh::Boolean::unite;
    case Boolean::intersection:
      return hermesh::Boolean::intersect;
    case Boolean::difference:
      break;
  }
  return hermesh::Boolean::subtract;
}

}  // namespace hermesh::v1
