"""Two meshes of one part are compared with it: triangles, certified distances, topology."""

import shapes

import hermesh

path = shapes.model("fandisk.obj")
if path:
    part = hermesh.read_mesh(path)
else:
    # A block with a groove, cut out of it by a torus.
    block = shapes.box((-1.2, -1.2, -0.5), (1.2, 1.2, 0.0))
    part = hermesh.combine("difference", block, shapes.torus(0.8, 0.25), resolution=200, tolerance=0.02)

size = max(part.points.max(axis=0) - part.points.min(axis=0))
meshes = {
    "marching cubes": hermesh.remesh(part, resolution=100, extractor="marching-cubes"),
    "manifold dual contouring": hermesh.remesh(part, resolution=100, tolerance=0.1),
}
print(f"{'mesh':26} triangles  to the part [voxels]  from the part [voxels]  watertight  solid")
for name, mesh in meshes.items():
    report = hermesh.validate(mesh, reference=part, certify=True, samples=50_000)
    to, back = report.certified_to_reference, report.certified_from_reference
    voxel = size / 100
    print(f"{name:26} {len(mesh.triangulated()):9}  {to.lower / voxel:.3f} to {to.upper / voxel:.3f}"
          f"         {back.lower / voxel:.3f} to {back.upper / voxel:.3f}           "
          f"{str(report.watertight):10}  {report.solid}")

# Without models it prints
#   mesh                       triangles  to the part [voxels]  from the part [voxels]  watertight  solid
#   marching cubes                 67332  0.664 to 0.672         1.155 to 1.170           True        same
#   manifold dual contouring        1164  0.111 to 0.125         0.112 to 0.126           True        same

# With that of $HERMESH_DATA it prints
#   mesh                       triangles  to the part [voxels]  from the part [voxels]  watertight  solid
#   marching cubes                 51080  0.579 to 0.584         0.858 to 0.873           True        same
#   manifold dual contouring         496  0.180 to 0.192         0.098 to 0.113           True        same
