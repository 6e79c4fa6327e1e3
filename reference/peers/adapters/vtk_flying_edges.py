"""VTK, distances on a lattice and flying edges: vtk_flying_edges.py [SHARE OF TRIANGLES TO REMOVE] REQUEST

vtkImplicitPolyDataDistance is VTK's class for signed distances to triangles (VTK examples,
ImplicitPolyDataDistance); vtkPolyDataToImageStencil and vtkVoxelModeller give 0 and 1 only, and
vtkSignedDistance takes points with normals. It is evaluated at all vertices of the lattice, which is slow.
Its sign is that of the nearest normal, so the mesh of open polygons is open at the end of the lattice.
Unneeded output of vtkFlyingEdges3D is off ("fairly expensive", ComputeNormals). vtkQuadricDecimation
preserves the volume ("greatly reduces errors in triangle normal direction", VolumePreservation). The
documentation promises no topology and no distance. Triangles are flipped, because vtkFlyingEdges3D expects
larger values inside.
"""
import sys

import adapter

MARGIN = 2.5  # voxels around the polygons: no vertex of the lattice is on their bounding box


def to_vtk(points, triangles):
    vertices, cells, data = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
    vertices.SetData(support.numpy_to_vtk(points, deep=True))
    cells.SetData(3, support.numpy_to_vtkIdTypeArray(triangles.ravel().astype(numpy.int64), deep=True))
    data.SetPoints(vertices)
    data.SetPolys(cells)
    return data


def sample(voxel, points, triangles):
    """Returns an image of the signed distances."""
    lower = points.min(axis=0).astype(float) - MARGIN * voxel
    size = numpy.ceil((points.max(axis=0) - lower) / voxel + MARGIN).astype(int) + 1
    image = vtk.vtkImageData()
    image.SetDimensions(*map(int, size))
    image.SetOrigin(*lower)
    image.SetSpacing(voxel, voxel, voxel)
    indices = numpy.indices(size[::-1]).reshape(3, -1)[::-1].T  # x runs fastest
    distance, values = vtk.vtkImplicitPolyDataDistance(), vtk.vtkDoubleArray()
    distance.SetInput(to_vtk(points, triangles))
    distance.FunctionValue(support.numpy_to_vtk(lower + voxel * indices, deep=True), values)
    image.GetPointData().SetScalars(values)
    return image


def remesh(request, points, triangles):
    last = vtk.vtkFlyingEdges3D()
    last.SetInputData(sample(adapter.length(request), points, triangles))
    last.SetValue(0, 0.0)
    last.ComputeNormalsOff()
    last.ComputeGradientsOff()
    last.ComputeScalarsOff()
    if len(sys.argv) > 2:
        edges, last = last, vtk.vtkQuadricDecimation()
        last.SetInputConnection(edges.GetOutputPort())
        last.SetTargetReduction(float(sys.argv[1]))
        last.VolumePreservationOn()
    last.Update()
    mesh = last.GetOutput()
    if not mesh.GetNumberOfPolys():
        return [], []
    corners = support.vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return support.vtk_to_numpy(mesh.GetPoints().GetData()), [corners[:, ::-1]]


vtk = adapter.require("vtk", "python3-vtk9")
support = adapter.require("vtk.util.numpy_support", "python3-vtk9")
numpy = adapter.require("numpy", "python3-numpy")
adapter.run(adapter.with_arrays(remesh))
