"""Triangles of glTF 2.0 and 3MF files. Files with features that are not read here raise an error."""

import base64
import io
import json
import urllib.parse
import zipfile
from xml.etree import ElementTree

import numpy
from scipy.spatial.transform import Rotation

_NUMBERS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def gltf(data, folder):
    """Returns the corners (n, 3, 3) of the triangles of the scene; buffers are files in `folder`."""
    binary = b""
    if data[:4] == b"glTF":  # a header of 12 bytes, and two chunks with headers of 8 bytes
        length = int.from_bytes(data[12:16], "little")
        binary, data = data[20 + length + 8:], data[20:20 + length]
    document = json.loads(data)
    if required := document.get("extensionsRequired"):
        raise ValueError(f"the extensions {', '.join(required)} are not read here")

    def buffer(number):
        uri = document["buffers"][number].get("uri")
        if uri is None:
            return binary
        return base64.b64decode(uri.partition(",")[2]) if uri.startswith("data:") else \
            (folder / urllib.parse.unquote(uri)).read_bytes()

    def values(number, width):
        accessor = document["accessors"][number]
        if "sparse" in accessor or accessor.get("normalized"):
            raise ValueError("sparse and normalized accessors are not read here")
        view = document["bufferViews"][accessor["bufferView"]]
        kind = numpy.dtype(_NUMBERS[accessor["componentType"]])
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride = view.get("byteStride", width * kind.itemsize)
        return numpy.ndarray((accessor["count"], width), kind, buffer(view["buffer"]), start,
                             (stride, kind.itemsize))

    def triangles(primitive):
        points = values(primitive["attributes"]["POSITION"], 3).astype(float)
        order = values(primitive["indices"], 1)[:, 0].astype(int) if "indices" in primitive \
            else numpy.arange(len(points))
        mode, middle = primitive.get("mode", _TRIANGLES), order[1:-1]
        return points[{_TRIANGLES: lambda: order.reshape(-1, 3),
                       _STRIP: lambda: numpy.column_stack([order[:-2], middle, order[2:]]),
                       _FAN: lambda: numpy.column_stack([0 * middle + order[0], middle, order[2:]])
                       }.get(mode, lambda: numpy.empty((0, 3), int))()]

    def walk(number, matrix):
        node, local = document["nodes"][number], numpy.eye(4)
        local[:3, :3] = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix() \
            * node.get("scale", [1, 1, 1])
        local[:3, 3] = node.get("translation", [0, 0, 0])
        matrix = matrix @ (numpy.reshape(node["matrix"], (4, 4)).T if "matrix" in node else local)
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            yield triangles(primitive) @ matrix[:3, :3].T + matrix[:3, 3]
        for child in node.get("children", []):
            yield from walk(child, matrix)

    nodes = range(len(document.get("nodes", [])))
    roots = set(nodes).difference(*(document["nodes"][n].get("children", []) for n in nodes))
    if "scenes" in document:
        roots = document["scenes"][document.get("scene", 0)].get("nodes", [])
    with numpy.errstate(invalid="ignore"):  # the caller checks that coordinates are finite
        return numpy.concatenate([part for root in sorted(roots) for part in walk(root, numpy.eye(4))])


def three_mf(data, _):
    """Returns the corners (n, 3, 3) of the triangles of the items to build."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        models = {name: ElementTree.fromstring(archive.read(name)) for name in archive.namelist()
                  if name.endswith(".model")}
    objects = {(name, item.get("id")): item for name, model in models.items()
               for item in model.iterfind("{*}resources/{*}object")}

    def place(name, use, matrix):
        """Yields the triangles of an item or a component: points are rows that a matrix (4, 4) transforms."""
        if "transform" in use.attrib:
            own = numpy.eye(4)
            own[:, :3] = numpy.reshape([float(word) for word in use.get("transform").split()], (4, 3))
            matrix = own @ matrix
        path = next((value for key, value in use.attrib.items() if key.endswith("}path")), name)
        name = path.lstrip("/")
        body = objects[name, use.get("objectid")]
        points = [[float(v.get(axis)) for axis in "xyz"]
                  for v in body.iterfind("{*}mesh/{*}vertices/{*}vertex")]
        corners = [[int(t.get(key)) for key in ("v1", "v2", "v3")]
                   for t in body.iterfind("{*}mesh/{*}triangles/{*}triangle")]
        if corners:
            yield (numpy.array(points) @ matrix[:3, :3] + matrix[3, :3])[corners]
        for component in body.iterfind("{*}components/{*}component"):
            yield from place(name, component, matrix)

    return numpy.concatenate([part for name, model in models.items()
                              for item in model.iterfind("{*}build/{*}item")
                              for part in place(name, item, numpy.eye(4))])
