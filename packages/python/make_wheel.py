#!/usr/bin/env python3
"""Packs the built package as a wheel: the target hermesh_wheel calls it. Standard library alone.

The wheel contains the package and, next to it, hermesh's own libraries. The distribution's libraries
(OpenVDB, TBB, OpenMesh, ...) must be installed, so a wheel is for the release of Debian that it was built on.
The same files give the same bytes.
"""

import argparse
import base64
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile


def name_of(version: str) -> str:
    return f"hermesh-{version}-{tag}.whl"


platform = re.sub("[^A-Za-z0-9]", "_", sysconfig.get_platform())
tag = "cp" + sysconfig.get_config_var("py_version_nodot")
tag = f"{tag}-{tag}-{platform}"
if sys.argv[1:2] == ["--print-name"]:
    print(name_of(sys.argv[2]))
    sys.exit()

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--version", required=True)
parser.add_argument("--package", required=True, type=pathlib.Path, help="folder of the built package")
parser.add_argument("--library", required=True, action="append", type=pathlib.Path,
                    help="shared library that comes along")
parser.add_argument("--soname", required=True, action="append",
                    help="what each is called by those that need it")
parser.add_argument("--licence", required=True, type=pathlib.Path)
parser.add_argument("--cmake", required=True)
parser.add_argument("--out", required=True, type=pathlib.Path, help="the wheel")
arguments = parser.parse_args()

validates = any(arguments.package.glob("_validation.*.so"))
licence = "Apache-2.0" + (" AND GPL-3.0-or-later" if validates else "")
info = f"hermesh-{arguments.version}.dist-info"
files: dict[str, bytes] = {
    f"{info}/METADATA": f"""Metadata-Version: 2.1
Name: hermesh
Version: {arguments.version}
Summary: Polygons to sparse volumes and back
License: {licence}
Requires-Python: >=3.9
Requires-Dist: numpy
""".encode(),
    f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: hermesh make_wheel\nRoot-Is-Purelib: false\nTag: "
                     f"{tag}\n".encode(),
    f"{info}/LICENSE": arguments.licence.read_bytes(),
}

with tempfile.TemporaryDirectory() as folder:
    held = pathlib.Path(folder)
    for path in sorted(arguments.package.iterdir()):
        if path.is_file():
            shutil.copy(path, held / path.name)
    for library, soname in zip(arguments.library, arguments.soname):
        shutil.copy(library, held / soname)
    for path in sorted(held.iterdir()):
        if ".so" not in path.name:
            continue
        subprocess.run(["strip", "--strip-unneeded", path], check=True)
        # Those that need others have a path to the build's folder, in whose place a shorter one fits.
        entries = subprocess.run(["readelf", "-d", path], check=True, capture_output=True, text=True).stdout
        if "RUNPATH" not in entries and "RPATH" not in entries:
            continue
        script = held / "set_path.cmake"
        script.write_text(f'file(RPATH_SET FILE "{path}" NEW_RPATH "$ORIGIN")\n'.replace("$", "\\$"))
        subprocess.run([arguments.cmake, "-P", script], check=True)
        script.unlink()
    for path in sorted(held.iterdir()):
        files["hermesh/" + path.name] = path.read_bytes()

record = ""
for name, data in files.items():
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    record += f"{name},sha256={digest},{len(data)}\n"
files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()

arguments.out.parent.mkdir(parents=True, exist_ok=True)
wheel = arguments.out
with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
    for name, data in files.items():
        entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
        entry.compress_type = zipfile.ZIP_DEFLATED
        entry.external_attr = 0o644 << 16
        archive.writestr(entry, data)
print(f"{wheel}: {wheel.stat().st_size} bytes")
