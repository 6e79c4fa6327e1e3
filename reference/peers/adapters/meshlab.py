"""MeshLab's filter Uniform Mesh Resampling, marching cubes on signed distances: meshlab.py REQUEST

Parameters are the defaults, with the cell size of the request and Multisample, of which the help of the
filter says "much slower but less artifacts". The help promises no topology and no distance, and the mesh of
open polygons is open. The program prints no time of its own.
"""
import tempfile

import adapter

SCRIPT = """<!DOCTYPE FilterScript>
<FilterScript><filter name="Uniform Mesh Resampling">
 <Param type="RichAbsPerc" name="CellSize" value="{!r}" min="0" max="1e9"/>
 <Param type="RichAbsPerc" name="Offset" value="0" min="-1e9" max="1e9"/>
 <Param type="RichBool" name="mergeCloseVert" value="false"/>
 <Param type="RichBool" name="discretize" value="false"/>
 <Param type="RichBool" name="multisample" value="true"/>
 <Param type="RichBool" name="absDist" value="false"/>
</filter></FilterScript>
"""


def work(request):
    program = adapter.program("meshlabserver", "install the package meshlab")
    display = adapter.program("xvfb-run", "install the packages xvfb and xauth: meshlabserver needs OpenGL")
    with tempfile.NamedTemporaryFile("w", suffix=".mlx") as script:
        script.write(SCRIPT.format(adapter.length(request)))
        script.flush()
        return adapter.with_files(request, [display, "-a", program, "-i", "IN.ply", "-o", "OUT.obj",
                                            "-s", script.name])


adapter.run(work)
