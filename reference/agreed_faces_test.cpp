#include "reference/agreed_faces.h"

#include <gtest/gtest.h>

#include <random>

#include "reference/test_meshes.h"

namespace hermesh {
namespace agreed_faces_test {

TEST(AgreedFaces, TurnAFewFacesOfAClosedMeshAndOfAnOpenOne) {
  const PolygonMesh sphere = test::sphere(1.0, 3);
  std::mt19937 random(1);
  for (const bool open : {false, true}) {
    PolygonMesh mesh = sphere;
    if (open) mesh.triangles.resize(mesh.triangles.size() - 5);
    const PolygonMesh right = mesh;
    for (Triangle& t : mesh.triangles)
      if (random() % 5 == 0) std::swap(t[1], t[2]);
    mesh.triangles.push_back({1, 1, 2});  // has no side, and stays
    const PolygonMesh found = with_agreeing_faces(mesh);
    ASSERT_EQ(found.triangles.size(), mesh.triangles.size());
    EXPECT_EQ(found.triangles.back(), mesh.triangles.back());
    EXPECT_NEAR(test::signed_volume(found), test::signed_volume(right), 1e-12) << open;
  }
}

TEST(AgreedFaces, KeepTheWindingOfEachPatch) {
  const PolygonMesh shells = test::joined(test::sphere(1.0, 2), test::reversed(test::sphere(0.5, 2)));
  EXPECT_EQ(with_agreeing_faces(shells).triangles, shells.triangles);
}

}  // namespace agreed_faces_test
}  // namespace hermesh
