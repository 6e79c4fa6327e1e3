"""The bone of a CT as a mesh: bone_from_ct.py [OUT.stl]"""

import pathlib
import sys
import tempfile

import numpy as np
import shapes

import hermesh

path = shapes.model("cranium_ct_256x256x108_int16le.raw.gz")
if path:
    scan = hermesh.import_volume(path, dims=(256, 256, 108), type="int16",
                                 spacing=(0.9570312, 0.9570312, 1.5))
else:
    # A head of soft tissue (40 HU) with a skull (1200 HU) of 6 mm around a brain, in air (-1000 HU), as
    # scanners write it.
    spacing = (2.0, 2.0, 2.5)
    z, y, x = np.meshgrid(*(np.arange(n) for n in (80, 110, 100)), indexing="ij")
    radius = np.sqrt(((x - 50) * 2.0 / 80)**2 + ((y - 55) * 2.0 / 95)**2 + ((z - 40) * 2.5 / 85)**2)
    values = np.where(radius < 1, 40, -1000).astype(float)
    values += 1160 * np.clip((0.045 - np.abs(radius - 0.88)) / 0.02 + 0.5, 0, 1)  # blurred as a scanner does
    with tempfile.TemporaryDirectory() as folder:
        raw = pathlib.Path(folder, "head.raw")
        raw.write_bytes(values.astype("<i2").tobytes())
        scan = hermesh.import_volume(raw, dims=(100, 110, 80), type="int16", spacing=spacing)

low, high = scan.value_range
print(f"scan: {' x '.join(map(str, scan.dims))} samples, {low:.0f} to {high:.0f} HU")

# Samples above the isovalue are inside; where the bone reaches the end of the scan it gets a flat cap.
log = hermesh.Log()
bone = hermesh.extract(scan, isovalue=300, extractor="manifold-dual-contouring", tolerance=0.1,
                       written_in_single=True, log=log)
report = hermesh.validate(bone)
print(f"bone: {len(bone.triangulated())} triangles, {report.components} surfaces, {report.volume / 1000:.1f} "
      f"cm³")
print(f"watertight: {report.watertight}")
for note in log.notes:
    print("note:", note)
if len(sys.argv) > 1:
    bone.write(sys.argv[1])

# Without models it prints
#   scan: 100 x 110 x 80 samples, -1000 to 1200 HU
#   bone: 10966 triangles, 2 surfaces, 667.5 cm³
#   watertight: True

# With that of $HERMESH_DATA it prints
#   scan: 256 x 256 x 108 samples, -1024 to 2986 HU
#   bone: 108664 triangles, 207 surfaces, 610.7 cm³
#   watertight: True
#   note: the surface runs into the end of the data (-y, -z) and was closed half a voxel beyond its last samples; see --ends
