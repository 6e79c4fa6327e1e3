// VTK: vtkFlyingEdges3D, vtkQuadricDecimation and vtkDecimatePro.
//   vtk_peer flying-edges VOLUME.vdb OUT.obj THREADS
//   vtk_peer quadric IN.obj OUT.obj NUMBER               a share of the triangles, or from 1 on how many stay
//   vtk_peer decimate-pro IN.obj OUT.obj TOLERANCE       world units
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <vtkCellArray.h>
#include <vtkDecimatePro.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>
#include <vtkSMPTools.h>

#include "reference/peers/peer.h"

namespace {

vtkNew<vtkPolyData> to_vtk(const peers::Mesh& mesh) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  for (const auto& p : mesh.points) points->InsertNextPoint(p.data());
  vtkNew<vtkCellArray> cells;
  for (const auto& t : mesh.triangles) {
    const vtkIdType corners[3] = {t[0], t[1], t[2]};
    cells->InsertNextCell(3, corners);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  return data;
}

peers::Mesh from_vtk(vtkPolyData* data) {
  peers::Mesh mesh;
  mesh.points.resize(std::size_t(data->GetNumberOfPoints()));
  for (std::size_t i = 0; i < mesh.points.size(); ++i) data->GetPoint(vtkIdType(i), mesh.points[i].data());
  vtkNew<vtkIdList> corners;
  data->GetPolys()->InitTraversal();
  while (data->GetPolys()->GetNextCell(corners)) {
    if (corners->GetNumberOfIds() != 3) throw std::runtime_error("VTK gave a polygon that is no triangle");
    mesh.triangles.push_back({int(corners->GetId(0)), int(corners->GetId(1)), int(corners->GetId(2))});
  }
  return mesh;
}

peers::Mesh flying_edges(const std::string& volume, int threads) {
  openvdb::initialize();
  openvdb::io::File file(volume);
  file.open();
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("sdf"));
  openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  box.expand(1);
  // VTK's x runs fastest, as in OpenVDB's LayoutXYZ.
  openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box);
  openvdb::tools::copyToDense(*grid, dense);
  const openvdb::Coord size = box.dim();
  vtkNew<vtkFloatArray> values;
  values->SetArray(dense.data(), vtkIdType(box.volume()), 1);
  vtkNew<vtkImageData> image;
  const double voxel = grid->voxelSize()[0];
  const openvdb::Vec3d origin = grid->indexToWorld(box.min());
  image->SetDimensions(size[0], size[1], size[2]);
  image->SetSpacing(voxel, voxel, voxel);
  image->SetOrigin(origin.x(), origin.y(), origin.z());
  image->GetPointData()->SetScalars(values);
  vtkSMPTools::Initialize(threads);
  vtkNew<vtkFlyingEdges3D> edges;
  edges->SetInputData(image);
  edges->SetValue(0, 0.0);
  // The class reference recommends to switch off unneeded output, because it costs time.
  edges->ComputeNormalsOff();
  edges->ComputeGradientsOff();
  edges->ComputeScalarsOff();
  peers::measured([&] { edges->Update(); });
  return from_vtk(edges->GetOutput());
}

peers::Mesh quadric(const peers::Mesh& mesh, double number) {
  const auto input = to_vtk(mesh);
  vtkNew<vtkQuadricDecimation> decimation;
  decimation->SetInputData(input);
  // VTK stops once the share that is gone reaches the target, which half a triangle keeps clear of rounding.
  const double all = double(mesh.triangles.size()), kept = double(peers::kept_triangles(mesh, number));
  decimation->SetTargetReduction(1.0 - (kept + 0.5) / all);
  decimation->VolumePreservationOn();
  peers::measured([&] { decimation->Update(); });
  return from_vtk(decimation->GetOutput());
}

peers::Mesh decimate_pro(const peers::Mesh& mesh, double tolerance) {
  const auto input = to_vtk(mesh);
  vtkNew<vtkDecimatePro> decimation;
  decimation->SetInputData(input);
  // As far as the error allows, and with the errors of earlier steps in it; topology as it was.
  decimation->SetTargetReduction(1.0);
  decimation->SetErrorIsAbsolute(1);
  decimation->SetAbsoluteError(tolerance);
  decimation->AccumulateErrorOn();
  decimation->PreserveTopologyOn();
  decimation->BoundaryVertexDeletionOff();
  peers::measured([&] { decimation->Update(); });
  return from_vtk(decimation->GetOutput());
}

}  // namespace

int main(int argc, char** argv) {
  return peers::guarded([&] {
    if (argc != 5) throw std::runtime_error("vtk_peer flying-edges|quadric|decimate-pro IN OUT NUMBER");
    const std::string method = argv[1];
    const double number = std::atof(argv[4]);
    peers::write_obj(argv[3], method == "flying-edges" ? flying_edges(argv[2], int(number))
                              : method == "quadric"    ? quadric(peers::read_obj(argv[2]), number)
                              : method == "decimate-pro"
                                  ? decimate_pro(peers::read_obj(argv[2]), number)
                                  : throw std::runtime_error("vtk_peer knows no method " + method));
  });
}
