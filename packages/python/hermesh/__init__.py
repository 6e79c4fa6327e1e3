"""Polygons to sparse volumes and back.

Options have the names, defaults and ranges of the program `hermesh`, with `_` for `-`, and results have the
bytes that it writes for the same options, at any number of threads. Other keywords are options of the method
(`-o` of the program), such as `tolerance` below; `extractors()` and `voxelizers()` list them.

A mesh parameter accepts a `Mesh`, the path of a file, an object with `.vertices` and `.faces` (trimesh) or
with `.points` and `.cells_dict` (meshio), or a tuple (points, polygons) or (points, triangles, quads) of
arrays.

Each function takes

progress
    a callable of the name of a stage and its completed share, 0 to 1; an exception that it raises ends the
    work
cancel
    an object with is_set(), such as a threading.Event: the work ends with `Cancelled` when it is set
threads
    maximum number of threads (default: all of the machine)
log
    a `Log`, which receives notes, times and statistics; without one the notes are warnings of the category
    `Note`

Ctrl-C ends the work. Other Python threads run meanwhile.

Examples
--------
A cube of quads, which the examples of the functions use, too:

>>> import numpy as np
>>> import hermesh
>>> points = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)
>>> quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
>>> cube = points, quads

A mesh of few triangles, whose arrays are numpy arrays without a copy:

>>> mesh = hermesh.remesh(cube, resolution=20, tolerance=0.05)
>>> mesh
<hermesh.Mesh of 8 points, 12 triangles, 0 quads>
>>> mesh.points.shape, mesh.points.dtype
((8, 3), dtype('float32'))
"""

from __future__ import annotations

import os
import re
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, Union

import numpy as np

from . import _core
from ._core import (Cancelled, Error, Fracture, Frustum, Mesh, MethodInfo, OptionInfo, Piece, Volume,
                    extractors, grid_names, voxelizers)

__version__: str = _core.version()
__all__ = [
    "BoundedRemesh", "Cancelled", "Error", "ExceptedBall", "Fracture", "Frustum", "Log", "Mesh", "MethodInfo",
    "Note", "OptionInfo", "Piece", "Volume", "as_mesh", "combine", "extract", "extractors", "fracture",
    "from_pyopenvdb", "grid_names", "import_volume", "read_mesh", "read_vdb", "remesh", "remesh_within",
    "to_meshio", "to_pyopenvdb", "to_trimesh", "validate", "validate_fracture", "voxelize", "voxelize_grids",
    "voxelizers", "write_mesh", "write_vdb"
]
for _class in (Fracture, Frustum, Mesh, MethodInfo, OptionInfo, Piece, Volume):
    _class.__module__ = "hermesh"


class _IsSet(Protocol):

    def is_set(self) -> bool:
        ...


MeshLike = Union[Mesh, str, "os.PathLike[str]", tuple, Any]
Progress = Callable[[str, float], Any]
OptionValue = Union[str, int, float, bool]


class Note(UserWarning):
    """A warning, such as the share of a surface that is thinner than a voxel.

    Examples
    --------
    Notes can be made errors, like all warnings:

    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", hermesh.Note)
    ...     mesh = hermesh.remesh(cube, resolution=20)
    """


class Log:
    """Notes and statistics; each call with the log adds to it.

    Attributes
    ----------
    notes : list of str
        Warnings.
    stage_seconds : list of (str, float)
        Stages with their seconds, in the order of their ends.
    figures : dict of str to float
        Statistics by name, such as `lost_surface_share`.

    Examples
    --------
    >>> log = hermesh.Log()
    >>> volume = hermesh.voxelize(cube, resolution=20, log=log)
    >>> log.notes
    []
    >>> log.figures["lost_surface_share"]
    0.0
    """

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.stage_seconds: list[tuple[str, float]] = []
        self.figures: dict[str, float] = {}


_SWITCHES = "except-thin|over-holes|through-volume"
_VALUES = "auto|closed|drop|dual-contouring|flood-fill|keep|open|refuse|unsigned|winding-number"


def _in_python(message: str) -> str:
    """Returns a message with options of the command line replaced by keyword arguments."""
    named = lambda name: name.replace("-", "_")
    message = re.sub(r"(?<![\w-])-o ([a-z][a-z-]*)=([a-z-]+|[\d.]+)",
                     lambda m: f'{named(m[1])}={m[2] if m[2][0].isdigit() else repr(m[2])}', message)
    message = re.sub(f"(?<![\\w-])--({_SWITCHES})(?![\\w-])", lambda m: named(m[1]) + "=True", message)
    message = re.sub(f"(?<![\\w-])--([a-z][a-z-]*) ({_VALUES})(?![\\w-])",
                     lambda m: f"{named(m[1])}={m[2]!r}", message)
    return re.sub(r"(?<![\w-])--([a-z][a-z-]*[a-z])( VALUE| N(?= ))?", lambda m: named(m[1]), message)


class _Watching:
    """Provides the watch of a call, and passes its notes to the caller even if the call raises. Notes and
    errors name options as Python does."""

    def __init__(self, progress: Progress | None, cancel: _IsSet | None, threads: int | None,
                 log: Log | None) -> None:
        if log is not None and not isinstance(log, Log):
            raise TypeError("log must be a hermesh.Log")
        self._watch = _core.Watch(progress, cancel, threads)
        self._log = log

    def __enter__(self) -> _core.Watch:
        return self._watch

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, Error):
            error.args = tuple(_in_python(str(argument)) for argument in error.args)
        notes = [_in_python(note) for note in self._watch.notes]
        if self._log is None:
            for note in notes:
                # The line that called the public function is three frames up.
                warnings.warn(note, Note, stacklevel=3)
            return
        self._log.notes += notes
        self._log.stage_seconds += self._watch.stage_seconds
        self._log.figures.update(self._watch.figures)


# ---- Meshes of all kinds.


def as_mesh(mesh: MeshLike, *, attributes: bool = False) -> Mesh:
    """Converts a mesh parameter to a `Mesh`.

    Parameters
    ----------
    mesh : MeshLike
        A `Mesh`, a path, an object of trimesh or meshio, or a tuple of arrays; see the module `hermesh`.
    attributes : bool, default False
        True to convert the attributes of files and of objects of trimesh and meshio, too.

    Returns
    -------
    Mesh
        The argument itself if it is a `Mesh`.

    Raises
    ------
    Error
        If the mesh is invalid.
    TypeError
        If the object is of another kind.

    Examples
    --------
    >>> hermesh.as_mesh(cube)
    <hermesh.Mesh of 8 points, 0 triangles, 6 quads>
    """
    if isinstance(mesh, Mesh):
        return mesh
    if isinstance(mesh, (str, os.PathLike)):
        return read_mesh(mesh, attributes=attributes)
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return _of_polygons(*mesh)
    if isinstance(mesh, tuple) and len(mesh) == 3:
        return Mesh(*mesh)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        of_points = _usable(getattr(mesh, "vertex_attributes", {})) if attributes else {}
        of_polygons = _usable(getattr(mesh, "face_attributes", {})) if attributes else {}
        return _of_polygons(mesh.vertices, mesh.faces, point_attributes=of_points,
                            polygon_attributes=of_polygons)
    if hasattr(mesh, "points") and hasattr(mesh, "cells_dict"):
        return _of_meshio(mesh, attributes)
    raise TypeError("a mesh is a hermesh.Mesh, the path of a file, a tuple of arrays, or an object with "
                    "vertices and faces or "
                    f"with points and cells_dict, not {type(mesh).__name__}")


def _of_polygons(points: Any, polygons: Any, **attributes: Any) -> Mesh:
    polygons = np.asarray(polygons)
    if polygons.ndim == 2 and polygons.shape[1] == 4:
        return Mesh(points, None, polygons, **attributes)
    return Mesh(points, polygons, None, **attributes)


def _usable(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the arrays that can be attributes: numbers, one to four for each element."""
    usable = {}
    for name, array in arrays.items():
        array = np.asarray(array)
        if array.dtype.kind in "fiu" and (array.ndim == 1 or (array.ndim == 2 and 1 <= array.shape[1] <= 4)):
            usable[str(name)] = array
        else:
            warnings.warn(f"the attribute '{name}' is left out: it does not hold one to four numbers for "
                          f"each element", Note, 3)
    return usable


def _of_meshio(mesh: Any, attributes: bool) -> Mesh:
    cells = mesh.cells_dict
    others = [kind for kind in cells if kind not in ("triangle", "quad", "vertex", "line")]
    if others:
        raise Error(f"cells of the kind {others[0]} are no polygons of a surface; give triangles and quads")
    of_points = _usable(mesh.point_data) if attributes else {}
    return Mesh(mesh.points, cells.get("triangle"), cells.get("quad"), point_attributes=of_points)


def to_trimesh(mesh: Mesh) -> Any:
    """Converts a mesh to a trimesh.Trimesh in world units; needs the package trimesh.

    Parameters
    ----------
    mesh : Mesh
        Its quads are split along their intended diagonals.

    Returns
    -------
    trimesh.Trimesh
        With the same vertices; trimesh does not merge or reorder them.
    """
    import trimesh
    return trimesh.Trimesh(mesh.world_points(), mesh.triangulated(), process=False)


def to_meshio(mesh: Mesh) -> Any:
    """Converts a mesh to a meshio.Mesh in world units; needs the package meshio.

    Parameters
    ----------
    mesh : Mesh
        Attributes of its points are converted, others not.

    Returns
    -------
    meshio.Mesh
        With cells `triangle` and `quad`.
    """
    import meshio
    cells = [(kind, array) for kind, array in (("triangle", mesh.triangles), ("quad", mesh.quads))
             if len(array)]
    return meshio.Mesh(mesh.world_points(), cells, point_data=dict(mesh.point_attributes))


def read_mesh(path: str | os.PathLike[str], *, attributes: bool = False, progress: Progress | None = None,
              cancel: _IsSet | None = None, threads: int | None = None, log: Log | None = None) -> Mesh:
    """Reads a mesh file: PLY, OBJ, OFF, STL, glTF 2.0 or 3MF, each also gzipped.

    Polygons of more than four corners are split into triangles.

    Parameters
    ----------
    path : path-like
        The extension of the name specifies the format.
    attributes : bool, default False
        True to read the attributes of PLY, OBJ, glTF and 3MF files, too.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Returns
    -------
    Mesh
        With a note for each tolerated error in the file.

    Raises
    ------
    Error
        If the file is missing, damaged, of another format, or has no polygons.

    Examples
    --------
    >>> hermesh.write_mesh("cube.ply", cube)
    >>> hermesh.read_mesh("cube.ply")
    <hermesh.Mesh of 8 points, 0 triangles, 6 quads>
    >>> hermesh.read_mesh("absent.ply")
    Traceback (most recent call last):
        ...
    hermesh.Error: 'absent.ply' cannot be read: there is no such file
    """
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.read_mesh(os.fspath(path), attributes, watch)


def write_mesh(path: str | os.PathLike[str], mesh: MeshLike, *, progress: Progress | None = None,
               cancel: _IsSet | None = None, threads: int | None = None, log: Log | None = None) -> None:
    """Writes a mesh file: PLY, OBJ, OFF, STL, glTF (.glb, .gltf) or 3MF.

    Parameters
    ----------
    path : path-like
        The extension of the name specifies the format. An existing file is replaced once the new one is
        complete.
    mesh : MeshLike
        PLY (binary) stores its attributes; STL has single precision, and a note states the loss.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Raises
    ------
    Error
        If the extension is unknown or the path cannot be written.

    Examples
    --------
    >>> hermesh.write_mesh("cube.stl", cube)
    """
    mesh = as_mesh(mesh, attributes=True)
    with _Watching(progress, cancel, threads, log) as watch:
        _core.write_mesh(os.fspath(path), mesh, watch)


# ---- Volumes' files and other programs' grids.


def read_vdb(path: str | os.PathLike[str], *, grid: str = "", progress: Progress | None = None,
             cancel: _IsSet | None = None, threads: int | None = None, log: Log | None = None) -> Volume:
    """Reads a scalar grid of a .vdb file.

    Parameters
    ----------
    path : path-like
        A file of OpenVDB.
    grid : str, optional
        The name of the grid. By default `sdf`, else the only scalar grid.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Returns
    -------
    Volume
        Half and double precision, integers, bool and masks become single precision.

    Raises
    ------
    Error
        If the file is missing or damaged, or the grid is missing or not scalar.

    Examples
    --------
    >>> hermesh.write_vdb("cube.vdb", hermesh.voxelize(cube, resolution=20))
    >>> hermesh.grid_names("cube.vdb")
    ['sdf']
    >>> hermesh.read_vdb("cube.vdb").is_level_set
    True
    """
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.read_vdb(os.fspath(path), grid, watch)


def write_vdb(path: str | os.PathLike[str], volumes: Volume | Iterable[Volume], *,
              progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
              log: Log | None = None) -> None:
    """Writes volumes as the grids of one .vdb file. The same volumes give the same bytes.

    Parameters
    ----------
    path : path-like
        An existing file is replaced once the new one is complete.
    volumes : Volume or iterable of Volume
        The grids have the names of the volumes.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Raises
    ------
    Error
        If the path cannot be written, or two volumes have the same name.

    Examples
    --------
    >>> grids = hermesh.voxelize_grids(cube, "sdf,fog", resolution=20)
    >>> hermesh.write_vdb("cube.vdb", grids)
    >>> sorted(hermesh.grid_names("cube.vdb"))
    ['fog', 'sdf']
    """
    several = [volumes] if isinstance(volumes, Volume) else list(volumes)
    with _Watching(progress, cancel, threads, log) as watch:
        _core.write_vdb(os.fspath(path), several, watch)


def to_pyopenvdb(volume: Volume) -> Any:
    """Converts a volume to a grid of the module pyopenvdb (Debian: python3-openvdb).

    The conversion is through a temporary file, because the two modules may have different OpenVDB libraries.

    Parameters
    ----------
    volume : Volume
        The grid has its name, or `volume`.

    Returns
    -------
    pyopenvdb.GridBase
        With the same values.
    """
    import pyopenvdb
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "volume.vdb")
        name = volume.name or "volume"
        write_vdb(path, volume.with_name(name))
        return pyopenvdb.read(path, name)


def from_pyopenvdb(grid: Any) -> Volume:
    """Converts a grid of the module pyopenvdb to a volume, through a temporary file.

    Parameters
    ----------
    grid : pyopenvdb.GridBase
        A scalar grid.

    Returns
    -------
    Volume
        With the name of the grid.
    """
    import pyopenvdb
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "volume.vdb")
        pyopenvdb.write(path, grids=[grid])
        return read_vdb(path, grid=grid.name)


def import_volume(path: str | os.PathLike[str], *, frame: int | None = None,
                  dims: Sequence[int] | None = None, type: str = "", spacing: Sequence[float] | None = None,
                  offset: int | None = None, replace_nan: float | None = None,
                  progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
                  log: Log | None = None) -> Volume:
    """Imports a CT or MRI volume: NIfTI-1 (.nii, .hdr, .img) or raw samples, also gzipped.

    Parameters
    ----------
    path : path-like
        The file.
    frame : int, optional
        Index of the volume in a NIfTI file, from 0. By default the first.
    dims : sequence of three int, optional
        For raw samples: their numbers along x (fastest in the file), y and z. By default the file is NIfTI-1.
    type : str, optional
        For raw samples: uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64,
        followed by le (default) or be.
    spacing : sequence of three float, default (1, 1, 1)
        For raw samples: their distances in millimetres.
    offset : int, default 0
        For raw samples: bytes before the first.
    replace_nan : float, optional
        Replaces samples that are not finite, which are an error by default.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Returns
    -------
    Volume
        Named `volume`, in millimetres, with all samples active.

    Raises
    ------
    Error
        If the file is missing, damaged, or of another kind or size than specified.

    Examples
    --------
    >>> np.arange(24, dtype=np.int16).tofile("ct.raw")
    >>> volume = hermesh.import_volume("ct.raw", dims=(2, 3, 4), type="int16", spacing=(0.5, 0.5, 2))
    >>> volume.dims, volume.value_range
    ((2, 3, 4), (0.0, 23.0))
    """
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.import_volume(os.fspath(path), frame, None if dims is None else list(dims), type,
                                   None if spacing is None else list(spacing), offset, replace_nan, watch)


# ---- Options.


def _text(value: OptionValue) -> str:
    """Returns the text of a method's option on the command line."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    raise TypeError(f"the value of an option is a text or a number, not {type(value).__name__}")


def _texts(options: Mapping[str, OptionValue] | None) -> dict[str, str]:
    return {name: _text(value) for name, value in (options or {}).items()}


def _filled(options: Any, /, **values: Any) -> Any:
    """Returns the options with these members; None keeps a default."""
    for name, value in values.items():
        if value is not None:
            setattr(options, name, value)
    return options


def _voxelizing(*, voxelizer: str, signs: str | None, voxelizer_options: Mapping[str, OptionValue] | None,
                **values: Any) -> _core.VoxelizeOptions:
    texts = _texts(voxelizer_options)
    if signs is not None:
        if "signs" in texts:
            raise Error(f"option 'signs' of {voxelizer} is given twice")
        texts["signs"] = signs
    return _filled(_core.VoxelizeOptions(), voxelizer=voxelizer, options=texts, **values)


def _thin(rule: str | None) -> _core.Thin | None:
    if rule not in (None, "keep", "drop", "refuse"):
        raise Error(f"thin is keep, drop or refuse, not '{rule}'")
    return rule and getattr(_core.Thin, rule)


def _extracting(of_method: Mapping[str, OptionValue], /, **values: Any) -> _core.ExtractOptions:
    return _filled(_core.ExtractOptions(), options=_texts(of_method), **values)


# ---- The functions.


def voxelize(mesh: MeshLike, *, resolution: int | None = None, voxel_size: float | None = None,
             like: Volume | None = None, exterior_band: float = 3.0, interior_band: float = 3.0,
             voxelizer: str = "hermesh", signs: str | None = None, progress: Progress | None = None,
             cancel: _IsSet | None = None, threads: int | None = None, log: Log | None = None,
             **voxelizer_options: OptionValue) -> Volume:
    """Converts polygons, closed or not, to a level set.

    Exactly one of `resolution`, `voxel_size` and `like` is required.

    Parameters
    ----------
    mesh : MeshLike
        Any polygons.
    resolution : int, optional
        Voxels along the longest side of the mesh.
    voxel_size : float, optional
        Edge of a voxel, world units.
    like : Volume, optional
        The result has the lattice of this volume.
    exterior_band, interior_band : float, default 3.0
        Widths of the narrow bands outside and inside, in voxels, at least 1.
    voxelizer : str, default "hermesh"
        One of `voxelizers()`.
    signs : str, default "auto"
        How the inside is found: "auto", "flood-fill", "winding-number", or "unsigned" for distances without
        sign.
    progress, cancel, threads, log : optional
        See the module `hermesh`.
    **voxelizer_options
        Options of the voxelizer.

    Returns
    -------
    Volume
        The level set `sdf`, or `udf` for `signs="unsigned"`. A note states the share of the surface that is
        lost between the samples.

    Raises
    ------
    Error
        If the mesh has no polygons or no extent, the volume does not fit in memory, or an option is unknown.

    Examples
    --------
    >>> volume = hermesh.voxelize(cube, voxel_size=0.1)
    >>> volume.name, round(volume.voxel_size, 3)
    ('sdf', 0.1)
    >>> np.round(volume.sample([[1.15, 0.5, 0.5], [0.95, 0.5, 0.5]]), 3)
    array([ 0.15, -0.05], dtype=float32)
    """
    options = _voxelizing(resolution=resolution, voxel_size=voxel_size, like=like,
                          exterior_band=exterior_band, interior_band=interior_band, voxelizer=voxelizer,
                          signs=signs, voxelizer_options=voxelizer_options)
    mesh = as_mesh(mesh)
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.voxelize(mesh, options, watch)


def voxelize_grids(mesh: MeshLike, grids: str | Iterable[str], *, fog_exterior: bool = False,
                   resolution: int | None = None, voxel_size: float | None = None, like: Volume | None = None,
                   exterior_band: float = 3.0, interior_band: float = 3.0, voxelizer: str = "hermesh",
                   signs: str | None = None, progress: Progress | None = None, cancel: _IsSet | None = None,
                   threads: int | None = None, log: Log | None = None,
                   **voxelizer_options: OptionValue) -> list[Volume]:
    """Returns several volumes of one voxelization.

    Parameters
    ----------
    mesh : MeshLike
        Any polygons.
    grids : str or iterable of str
        Names, as a list or separated by commas: sdf, udf, fog, closest-point, triangle-id, attributes,
        attribute:NAME.
    fog_exterior : bool, default False
        True if the ramp of the fog covers both bands instead of the interior one.
    resolution, voxel_size, like, exterior_band, interior_band, voxelizer, signs : optional
        As in `voxelize`.
    progress, cancel, threads, log : optional
        See the module `hermesh`.
    **voxelizer_options
        Options of the voxelizer.

    Returns
    -------
    list of Volume
        In the order of the program's file, not in that of `grids`.

    Raises
    ------
    Error
        As `voxelize`, and if a name is unknown.

    Examples
    --------
    >>> [volume.name for volume in hermesh.voxelize_grids(cube, ["fog", "sdf"], resolution=20)]
    ['sdf', 'fog']
    """
    options = _voxelizing(resolution=resolution, voxel_size=voxel_size, like=like,
                          exterior_band=exterior_band, interior_band=interior_band, voxelizer=voxelizer,
                          signs=signs, voxelizer_options=voxelizer_options)
    names = grids if isinstance(grids, str) else ",".join(grids)
    mesh = as_mesh(mesh, attributes=True)
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.voxelize_grids(mesh, names, options, fog_exterior, watch)


def extract(volume: Volume, *, extractor: str = "dual-contouring", isovalue: float = 0.0,
            source: MeshLike | None = None, ends: str = "closed", mask: Volume | None = None,
            frustum: Frustum | None = None, frustum_resolution: int = 84, outside: str = "simplify",
            tolerance_grid: Volume | None = None, written_in_single: bool = False,
            progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
            log: Log | None = None, **options: OptionValue) -> Mesh:
    """Extracts the surface of a volume.

    Parameters
    ----------
    volume : Volume
        A level set, fog, or a CT or MRI.
    extractor : str, default "dual-contouring"
        One of `extractors()`.
    isovalue : float, default 0.0
        Value of the surface, in the units of the volume.
    source : MeshLike, optional
        The polygons that the volume was made from, for extractors that use exact edge crossings.
    ends : str, default "closed"
        Where the surface reaches the end of the data: "closed" with a flat cap, or "open".
    mask : Volume, optional
        Where an adaptive extractor observes its bound: where a level set is negative, or where another volume
        differs from its background. By default everywhere. Not with `frustum`.
    frustum : Frustum, optional
        The view of a camera as mask.
    frustum_resolution : int, default 84
        Voxels along the longest side of the mask of `frustum`.
    outside : str, default "simplify"
        Outside of the mask: "simplify", "nothing" (no polygons) or "everywhere" (the bound).
    tolerance_grid : Volume, optional
        Its values, none negative, scale the bound.
    written_in_single : bool, default False
        True if the mesh will be written to an STL file: guarantees then hold for the written mesh.
    progress, cancel, threads, log : optional
        See the module `hermesh`.
    **options
        Options of the extractor.

    Returns
    -------
    Mesh
        With the guarantees that `extractors()` lists.

    Raises
    ------
    Error
        If the volume has no surface at the isovalue, an option is unknown, or an option has no effect.

    Examples
    --------
    >>> volume = hermesh.voxelize(cube, resolution=20)
    >>> hermesh.extract(volume, extractor="manifold-dual-contouring", tolerance=0.1)  # doctest: +ELLIPSIS
    <hermesh.Mesh of ... points, ... triangles, 0 quads>
    >>> hermesh.extract(volume, isovalue=5)  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
        ...
    hermesh.Error: the level set has no surface at the isovalue 5
    """
    chosen = _extracting(options, extractor=extractor, isovalue=isovalue, ends=ends, mask=mask,
                         frustum=frustum, frustum_resolution=frustum_resolution, outside=outside,
                         tolerance_grid=tolerance_grid, written_in_single=written_in_single)
    polygons = None if source is None else as_mesh(source)
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.extract(volume, chosen, polygons, watch)


def remesh(mesh: MeshLike, *, resolution: int | None = None, voxel_size: float | None = None,
           error: float | None = None, triangles: int | None = None, exterior_band: float = 3.0,
           interior_band: float = 3.0, voxelizer: str = "hermesh", signs: str | None = None,
           voxelizer_options: Mapping[str, OptionValue] | None = None, thin: str | None = None,
           extractor: str = "manifold-dual-contouring", isovalue: float = 0.0, mask: Volume | None = None,
           frustum: Frustum | None = None, frustum_resolution: int = 84, outside: str = "simplify",
           tolerance_grid: Volume | None = None, written_in_single: bool = False,
           progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
           log: Log | None = None, **options: OptionValue) -> Mesh:
    """Converts polygons to a watertight mesh, through a level set with a given size of voxels.

    By default the mesh is adaptive, within `tolerance=0.1` voxels of the uniform mesh, closed, manifold and
    free of self-intersections. Exactly one of `resolution`, `voxel_size`, `error` and `triangles` is
    required.

    Parameters
    ----------
    mesh : MeshLike
        Any polygons.
    resolution : int, optional
        Voxels along the longest side of the mesh.
    voxel_size : float, optional
        Edge of a voxel, world units.
    error : float, optional
        Maximum two-sided distance from the boundary of the polygons' solid, world units, which is certified.
        The method is chosen for it, so only `signs`, `thin` and `written_in_single` have an effect.
        `remesh_within` has more options and returns the certified distances.
    triangles : int, optional
        Maximum number of triangles, with the smallest certified error found; as `error`.
    exterior_band, interior_band : float, default 3.0
        Widths of the narrow bands outside and inside, in voxels, at least 1.
    voxelizer : str, default "hermesh"
        One of `voxelizers()`.
    signs : str, default "auto"
        How the inside is found: "auto" (in the form "auto-sheets" if thin parts are kept), "flood-fill",
        "winding-number" (default with `error` and `triangles`), or "unsigned".
    voxelizer_options : dict, optional
        Options of the voxelizer.
    thin : str, default "keep"
        Walls, wires and open sheets thinner than the voxels: "keep" thickens them, with a note, "drop" loses
        them, with a note, and "refuse" raises `Error`. By default they are kept where possible, i.e. with the
        voxelizer hermesh, signs and the isovalue 0.
    extractor : str, default "manifold-dual-contouring"
        One of `extractors()`.
    isovalue : float, default 0.0
        Value of the surface, in the units of the volume.
    mask : Volume, optional
        Where an adaptive extractor observes its bound: where a level set is negative, or where another volume
        differs from its background. By default everywhere. Not with `frustum`.
    frustum : Frustum, optional
        The view of a camera as mask.
    frustum_resolution : int, default 84
        Voxels along the longest side of the mask of `frustum`.
    outside : str, default "simplify"
        Outside of the mask: "simplify", "nothing" (no polygons) or "everywhere" (the bound).
    tolerance_grid : Volume, optional
        Its values, none negative, scale the bound.
    written_in_single : bool, default False
        True if the mesh will be written to an STL file: guarantees then hold for the written mesh.
    progress, cancel, threads, log : optional
        See the module `hermesh`.
    **options
        Options of the extractor, such as `tolerance`.

    Returns
    -------
    Mesh
        With the guarantees that `extractors()` lists. With `error` or `triangles` a `Log` has the certified
        distances in `figures`.

    Raises
    ------
    Error
        As `voxelize` and `extract`, and if a requested error cannot be certified.

    See Also
    --------
    remesh_within : returns the certified distances, too.

    Examples
    --------
    >>> hermesh.remesh(cube, resolution=20)
    <hermesh.Mesh of 8 points, 12 triangles, 0 quads>
    >>> log = hermesh.Log()
    >>> hermesh.remesh(cube, error=0.01, log=log)
    <hermesh.Mesh of 8 points, 12 triangles, 0 quads>
    >>> log.figures["certified_to_polygons"] <= 0.01
    True
    >>> hermesh.remesh(cube, error=0.01, resolution=20)
    Traceback (most recent call last):
        ...
    hermesh.Error: resolution has no effect with error or triangles, which choose the method
    """
    if error is not None or triangles is not None:
        idle = [("resolution", resolution, None), ("voxel_size", voxel_size, None),
                ("exterior_band", exterior_band, 3.0), ("interior_band", interior_band, 3.0),
                ("voxelizer", voxelizer, "hermesh"), ("voxelizer_options", voxelizer_options, None),
                ("extractor", extractor, "manifold-dual-contouring"), ("isovalue", isovalue, 0.0),
                ("mask", mask, None), ("frustum", frustum, None),
                ("frustum_resolution", frustum_resolution, 84), ("outside", outside, "simplify"),
                ("tolerance_grid", tolerance_grid, None)] + [(name, True, False) for name in options]
        for name, value, default in idle:
            if value is not default and value != default:
                raise Error(f"{name} has no effect with error or triangles, which choose the method")
        mesh = as_mesh(mesh)
        with _Watching(progress, cancel, threads, log) as watch:
            return _within(watch, log, mesh, error=error, triangles=triangles, thin=thin or "keep",
                           signs=signs or "winding-number", written_in_single=written_in_single).mesh
    voxelizing = _voxelizing(resolution=resolution, voxel_size=voxel_size, exterior_band=exterior_band,
                             interior_band=interior_band, voxelizer=voxelizer, signs=signs,
                             voxelizer_options=voxelizer_options, thin=_thin(thin))
    extracting = _extracting(options, extractor=extractor, isovalue=isovalue, mask=mask, frustum=frustum,
                             frustum_resolution=frustum_resolution, outside=outside,
                             tolerance_grid=tolerance_grid, written_in_single=written_in_single)
    mesh = as_mesh(mesh)
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.remesh(mesh, voxelizing, extracting, watch)


class ExceptedBall(NamedTuple):
    """A ball within which a bound may not hold, world units.

    Attributes
    ----------
    position : list of float
        The centre.
    radius : float
        The radius.
    distance : float
        Lower bound of the distance between mesh and polygons at the position.
    area : float
        Area of the parts of polygons and mesh in the ball that are not shown to be near.
    is_hole : bool
        True if the mesh closes a hole there; otherwise a wall or gap is too thin.
    """
    position: list[float]
    radius: float
    distance: float  # lower bound of the distance between mesh and polygons at the position
    area: float  # of the parts of polygons and mesh in the ball that are not shown to be near
    is_hole: bool  # the mesh closes a hole there; otherwise a wall or gap is too thin


class BoundedRemesh(NamedTuple):
    """A mesh with its certified distances, world units.

    Attributes
    ----------
    mesh : Mesh
        The mesh.
    error : float
        The requested error or, for a maximum number of triangles, the one found.
    to_polygons : float
        Bound of the distance from the mesh to the boundary of the polygons' solid.
    from_polygons : float
        Bound of the distance from that boundary to the mesh.
    voxel_size : float
        Of the volume; 0 if none was made.
    exceptions : list of ExceptedBall
        With `except_thin`, balls outside of which the bounds hold.
    """
    mesh: Mesh
    error: float  # the requested one or, for a budget, the one found
    to_polygons: float  # bound of the distance from the mesh to the boundary of the polygons' solid
    from_polygons: float  # bound of the distance from that boundary to the mesh
    voxel_size: float  # 0: no volume was made
    exceptions: list[ExceptedBall]  # with except_thin, balls outside of which the bounds hold


def remesh_within(mesh: MeshLike, *, error: float | None = None, triangles: int | None = None,
                  signs: str = "winding-number", over_holes: bool = False, smallest_voxel: float = 0.0,
                  limit_points: float | None = None, written_in_single: bool = False, thin: str = "keep",
                  except_thin: bool = False, through_volume: bool = False,
                  progress: Progress | None = None, cancel: _IsSet | None = None,
                  threads: int | None = None, log: Log | None = None) -> BoundedRemesh:
    """Returns a mesh with a certified two-sided distance from the polygons.

    The distance is that to the boundary of the polygons' solid. The mesh is closed, manifold and free of
    self-intersections. Exactly one of `error` and `triangles` is required.

    Parameters
    ----------
    mesh : MeshLike
        Any polygons. A mesh that is closed, manifold and free of self-intersections is simplified itself,
        without a volume, unless `through_volume` is set.
    error : float, optional
        Maximum two-sided distance, world units.
    triangles : int, optional
        Maximum number of triangles, at least 4; the mesh has the smallest certified error found.
    signs : str, default "winding-number"
        How the inside is found; or "flood-fill" or "auto".
    over_holes : bool, default False
        True to allow the mesh to close holes where no polygon is near.
    smallest_voxel : float, default 0.0
        Smallest voxel size to try, world units; 0: an eighth of the error.
    limit_points : float, optional
        Maximum number of vertices of the finest mesh. By default 3e7 with `error`, 4e5 with `triangles`.
    written_in_single : bool, default False
        As in `remesh`.
    thin : str, default "keep"
        As in `remesh`; with "drop" and "refuse" a part that is too thin is an error.
    except_thin : bool, default False
        True to let the bound hold except in the balls of `exceptions`, around holes and parts that are too
        thin, with a note, instead of raising an error.
    through_volume : bool, default False
        True to make a volume of every mesh.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Returns
    -------
    BoundedRemesh
        The mesh and its certified distances.

    Raises
    ------
    Error
        If the bound cannot be reached within the limits, with the location and the reason.

    Examples
    --------
    >>> made = hermesh.remesh_within(cube, error=0.01)
    >>> made.mesh
    <hermesh.Mesh of 8 points, 12 triangles, 0 quads>
    >>> max(made.to_polygons, made.from_polygons) <= 0.01
    True
    """
    mesh = as_mesh(mesh)
    with _Watching(progress, cancel, threads, log) as watch:
        return _within(watch, log, mesh, error=error, triangles=triangles, signs=signs, over_holes=over_holes,
                       smallest_voxel=smallest_voxel, limit_points=limit_points,
                       written_in_single=written_in_single, thin=thin, except_thin=except_thin,
                       through_volume=through_volume)


def _within(watch: _core.Watch, log: Log | None, mesh: Mesh, *, error: float | None, triangles: int | None,
            signs: str, written_in_single: bool, thin: str, over_holes: bool = False,
            smallest_voxel: float = 0.0, limit_points: float | None = None, except_thin: bool = False,
            through_volume: bool = False) -> BoundedRemesh:
    *made, exceptions = _core.remesh_within(mesh, error, triangles, signs, over_holes, smallest_voxel,
                                            limit_points or 0.0, written_in_single, _thin(thin), except_thin,
                                            through_volume, watch)
    bounded = BoundedRemesh(*made, [ExceptedBall(*ball) for ball in exceptions])
    if log is not None:
        log.figures.update(error_asked=bounded.error, certified_to_polygons=bounded.to_polygons,
                           certified_from_polygons=bounded.from_polygons)
    return bounded


def combine(operation: str, a: MeshLike, b: MeshLike, *, resolution: int | None = None,
            voxel_size: float | None = None, exterior_band: float = 3.0, interior_band: float = 3.0,
            voxelizer: str = "hermesh", signs: str | None = None,
            voxelizer_options: Mapping[str, OptionValue] | None = None, thin: str | None = None,
            extractor: str = "manifold-dual-contouring", written_in_single: bool = False,
            progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
            log: Log | None = None, **options: OptionValue) -> Mesh:
    """Returns the union, intersection or difference of the solids of two meshes.

    Both are sampled on one lattice with their exact edge crossings, which preserve the curves where their
    surfaces
    intersect.

    Parameters
    ----------
    operation : str
        "union", "intersection" or "difference" (`a` without `b`).
    a, b : MeshLike
        The solids.
    resolution : int, optional
        Voxels along the longest side of the larger solid. Exactly one of this and `voxel_size` is required.
    voxel_size : float, optional
        Edge of a voxel, world units.
    exterior_band, interior_band, voxelizer, signs, voxelizer_options, thin : optional
        As in `remesh`.
    extractor : str, default "manifold-dual-contouring"
        One of `extractors()`.
    written_in_single : bool, default False
        As in `extract`.
    progress, cancel, threads, log : optional
        See the module `hermesh`.
    **options
        Options of the extractor.

    Returns
    -------
    Mesh
        With a note if parts are lost between samples.

    Raises
    ------
    Error
        If the result is empty or thinner than a voxel everywhere.

    Examples
    --------
    >>> corner = points + 0.5, quads
    >>> hermesh.combine("intersection", cube, corner, resolution=20)
    <hermesh.Mesh of 8 points, 12 triangles, 0 quads>
    """
    voxelizing = _voxelizing(resolution=resolution, voxel_size=voxel_size, exterior_band=exterior_band,
                             interior_band=interior_band, voxelizer=voxelizer, signs=signs,
                             voxelizer_options=voxelizer_options, thin=_thin(thin))
    extracting = _extracting(options, extractor=extractor, written_in_single=written_in_single)
    first, second = as_mesh(a), as_mesh(b)
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.combine(operation, first, second, voxelizing, extracting, watch)


def fracture(solid: MeshLike | Volume, cutters: str | MeshLike | Sequence[MeshLike] = "", *,
             resolution: int | None = None, voxel_size: float | None = None, copies: int = 0, seed: int = 0,
             roughness: float = 0.12, impact: Sequence[float] | None = None,
             impact_radius: float | None = None, density: Volume | None = None, mesh_scale: float = 1.0,
             method: str = "labelled", tolerance: float = 0.0, rule: str = "printed",
             min_volume: float = 27.0, split: bool = True, hermite: str = "auto", exterior_band: float = 3.0,
             interior_band: float = 3.0, voxelizer: str = "hermesh", signs: str | None = None,
             voxelizer_options: Mapping[str, OptionValue] | None = None, thin: str | None = None,
             progress: Progress | None = None, cancel: _IsSet | None = None,
             threads: int | None = None, log: Log | None = None) -> Fracture:
    """Breaks a solid into pieces that are closed and meet in shared triangles.

    Parameters
    ----------
    solid : MeshLike or Volume
        A mesh, or a level set.
    cutters : str, MeshLike or list of MeshLike
        "voronoi:N", "chunks:N" (Voronoi cells with rough walls), "planes:N", "planes:NX,NY,NZ,D;..." (N.x =
        D, world units), "mesh:FILE,..." or "mesh:FILE*N"; or meshes, which cut one after another.
    resolution, voxel_size : optional
        As in `remesh`; not for a level set, which has voxels.
    copies : int, default 0
        Copies of each mesh of the list, scattered and rotated at random; 0: each once, in place.
    seed : int, default 0
        Random seed.
    roughness : float, default 0.12
        Displacement of the walls of chunks relative to the distance of seeds, 0 to 1.
    impact : sequence of three float, optional
        Scatter densest about this point, world units.
    impact_radius : float, optional
        Distance from `impact` at which the density has halved, world units.
    density : Volume, optional
        Scatter in proportion to the values of this volume.
    mesh_scale : float, default 1.0
        Scale factor of scattered meshes.
    method : str, default "labelled"
        Or "thesis", as printed, with its `rule`.
    tolerance : float, default 0.0
        Maximum distance from the finest meshes, voxels; 0: nothing is merged.
    rule : str, default "printed"
        Of the method thesis; or "repaired".
    min_volume : float, default 27.0
        Voxels; smaller pieces join a neighbour. 0 preserves all.
    split : bool, default True
        True to split disconnected pieces.
    hermite : str, default "auto"
        Data of the solid: "auto", "exact" from polygons, or "level-set".
    exterior_band, interior_band, voxelizer, signs, voxelizer_options, thin : optional
        As in `remesh`.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Returns
    -------
    Fracture
        The pieces, with a note for each cutter without effect.

    Raises
    ------
    Error
        If an option is unknown, or the solid has no inside.

    Examples
    --------
    >>> broken = hermesh.fracture(cube, "planes:1,0,0,0.25", resolution=20)
    >>> [round(piece.volume, 3) for piece in broken.pieces]
    [0.25, 0.75]
    """
    options = _filled(_core.FractureOptions(), seed=seed, roughness=roughness,
                      impact=None if impact is None else [float(x) for x in impact],
                      impact_radius=impact_radius, density=density, mesh_scale=mesh_scale, method=method,
                      tolerance=tolerance, rule=rule, min_volume=min_volume, split=split, hermite=hermite)
    if isinstance(cutters, str):
        if copies:
            raise Error("copies are for meshes in a list; use mesh:FILE*N for a file")
        options.cutters = cutters
    else:
        several = cutters if isinstance(cutters, list) else [cutters]
        options.meshes = [_core.CutterMesh(f"cutter {i}", as_mesh(m), copies)
                          for i, m in enumerate(several, 1)]
    if isinstance(solid, Volume):
        if resolution is not None or voxel_size is not None:
            raise Error("a level set already has voxels: leave out resolution and voxel_size")
        with _Watching(progress, cancel, threads, log) as watch:
            return _core.fracture_volume(solid, options, watch)
    voxelizing = _voxelizing(resolution=resolution, voxel_size=voxel_size, exterior_band=exterior_band,
                             interior_band=interior_band, voxelizer=voxelizer, signs=signs,
                             voxelizer_options=voxelizer_options, thin=_thin(thin))
    mesh = as_mesh(solid, attributes=True)
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.fracture(mesh, voxelizing, options, watch)


def _validators() -> Any:
    try:
        from . import _validation
    except ImportError as error:
        raise Error(f"validation is not installed with this package of hermesh: {error}") from error
    return _validation


def validate(mesh: MeshLike, *, reference: MeshLike | None = None, certify: bool = False,
             features: MeshLike | None = None, dihedral: float = 30.0, samples: int = 200_000,
             voxel_size: float = 0.0, self_intersections: bool = True, libraries: bool = True,
             progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
             log: Log | None = None) -> "_validation.Report":
    """Validates a mesh: topology, self-intersections, distances.

    Validation links CGAL, so programs that call it are under GPL-3.

    Parameters
    ----------
    mesh : MeshLike
        The mesh to validate.
    reference : MeshLike, optional
        Mesh for the distances and the comparison of the solids.
    certify : bool, default False
        True to certify bounds of the Hausdorff distances to the reference.
    features : MeshLike, optional
        Mesh whose sharp edges and corners the mesh should reproduce.
    dihedral : float, default 30.0
        Least angle of a sharp edge of `features`, degrees.
    samples : int, default 200000
        Samples on each surface for the distances.
    voxel_size : float, default 0.0
        Of the volume that the mesh was made from, world units: differences within sqrt(3) voxels are
        explained. 0: unknown.
    self_intersections : bool, default True
        True to search for self-intersections.
    libraries : bool, default True
        True to let OpenMesh and CGAL repeat the counts.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Returns
    -------
    Report
        str() of it is the verdict, `watertight` and the counts are attributes, and `to_dict()` has all
        values.

    Raises
    ------
    Error
        If an option has no effect, or validation is not installed.

    Examples
    --------
    >>> report = hermesh.validate(cube)
    >>> report.watertight, report.volume
    (True, 1.0)
    >>> report = hermesh.validate((points, quads[1:]))
    >>> report.watertight, report.boundary_edges
    (False, 4)
    """
    validators = _validators()
    validated = as_mesh(mesh)
    of_reference = None if reference is None else as_mesh(reference)
    of_features = None if features is None else as_mesh(features)
    with _Watching(progress, cancel, threads, log) as watch:
        return validators.validate(validated, of_reference, of_features, self_intersections, libraries,
                                   certify, samples, dihedral,
                               voxel_size, watch)


def validate_fracture(pieces: Fracture | Iterable[MeshLike], *, progress: Progress | None = None,
                      cancel: _IsSet | None = None, threads: int | None = None,
                      log: Log | None = None) -> "_validation.FractureReport":
    """Validates all pieces of a fracture together.

    Parameters
    ----------
    pieces : Fracture or iterable of MeshLike
        The pieces.
    progress, cancel, threads, log : optional
        See the module `hermesh`.

    Returns
    -------
    FractureReport
        `consistent` is True if each piece is valid, and all fit without gap or overlap.

    Examples
    --------
    >>> broken = hermesh.fracture(cube, "planes:1,0,0,0.25", resolution=20)
    >>> hermesh.validate_fracture(broken).consistent
    True
    """
    validators = _validators()
    if isinstance(pieces, Fracture):
        meshes = [piece.mesh for piece in pieces.pieces]
    else:
        meshes = [as_mesh(piece) for piece in pieces]
    with _Watching(progress, cancel, threads, log) as watch:
        return validators.validate_fracture(meshes, watch)


def _write_mesh(self: Mesh, path: str | os.PathLike[str], **watching: Any) -> None:
    """Writes the mesh, as write_mesh() does."""
    write_mesh(path, self, **watching)


def _write_volume(self: Volume, path: str | os.PathLike[str], **watching: Any) -> None:
    """Writes the volume, as write_vdb() does."""
    write_vdb(path, self, **watching)


Mesh.write = _write_mesh
Volume.write = _write_volume
