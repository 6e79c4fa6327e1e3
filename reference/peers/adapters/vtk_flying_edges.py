"""VTK: distances to the polygons on a lattice, vtkFlyingEdges3D, and optionally vtkQuadricDecimation:
vtk_flying_edges.py [SHARE OF TRIANGLES TO REMOVE] REQUEST

vtkImplicitPolyDataDistance is the class of VTK for signed distances to polygons (VTK examples,
ImplicitPolyDataDistance); its reference requires triangles. vtkPolyDataToImageStencil and vtkVoxelModeller give 0 and
1 only, and vtkSignedDistance takes points with normals. Distances are evaluated at every vertex of the lattice, so
this is slow. VTK takes the sign from the nearest normal; the documentation promises no topology and no distance.
The margin of the lattice is outside by definition, so that the mesh is closed. Decimation preserves
the volume ("greatly reduces errors in triangle normal direction", vtkQuadricDecimation, VolumePreservation).
"""
import sys

import adapter

MARGIN = 2.5  # voxels around the polygons: no vertex of the lattice is on their bounding box


def polydata(points, triangles):
    data = vtk.vtkPolyData()
    vertices, cells = vtk.vtkPoints(), vtk.vtkCellArray()
    vertices.SetData(support.numpy_to_vtk(points, deep=True))
    offsets = numpy.arange(0, 3 * len(triangles) + 1, 3)
    cells.SetData(support.numpy_to_vtkIdTypeArray(offsets, deep=True),
                  support.numpy_to_vtkIdTypeArray(triangles.ravel().astype(numpy.int64), deep=True))
    data.SetPoints(vertices)
    data.SetPolys(cells)
    return data


def remesh(request, points, triangles):
    voxel = adapter.length(request)
    origin = points.min(axis=0).astype(float) - MARGIN * voxel
    size = numpy.ceil((points.max(axis=0) - origin) / voxel + MARGIN).astype(int) + 1
    image = vtk.vtkImageData()
    image.SetDimensions(*map(int, size))
    image.SetOrigin(*origin)
    image.SetSpacing(voxel, voxel, voxel)
    axes = [origin[i] + voxel * numpy.arange(size[i]) for i in range(3)]
    lattice = numpy.stack(numpy.meshgrid(*axes, indexing="ij"), axis=-1).transpose(2, 1, 0, 3).reshape(-1, 3)
    distance, values = vtk.vtkImplicitPolyDataDistance(), vtk.vtkDoubleArray()
    distance.SetInput(polydata(points, triangles))
    distance.FunctionValue(support.numpy_to_vtk(lattice), values)
    field = support.vtk_to_numpy(values).reshape(size[::-1])
    for axis in range(3):
        for end in (0, -1):
            side = field.swapaxes(0, axis)[end]
            numpy.abs(side, out=side)
    image.GetPointData().SetScalars(values)
    edges = vtk.vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, 0.0)
    edges.ComputeNormalsOff()
    edges.ComputeGradientsOff()
    edges.ComputeScalarsOff()
    last = edges
    if len(sys.argv) > 2:
        last = vtk.vtkQuadricDecimation()
        last.SetInputConnection(edges.GetOutputPort())
        last.SetTargetReduction(float(sys.argv[1]))
        last.VolumePreservationOn()
    last.Update()
    mesh = last.GetOutput()
    if not mesh.GetNumberOfPolys():
        return [], []
    return (support.vtk_to_numpy(mesh.GetPoints().GetData()),
            [support.vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)[:, ::-1]])


vtk = adapter.require("vtk", "python3-vtk9")
numpy = adapter.require("numpy", "python3-numpy")
support = adapter.require("vtk.util.numpy_support", "python3-vtk9")
adapter.run(adapter.with_arrays(remesh))
