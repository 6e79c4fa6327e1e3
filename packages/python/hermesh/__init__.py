"""Polygons to sparse volumes and back.

    import hermesh
    mesh = hermesh.remesh("scan.ply", resolution=400, tolerance=0.05)
    mesh.points, mesh.triangles, mesh.quads        # numpy arrays, not copies

Options have the names, defaults and ranges of the program `hermesh`, with `_` for `-`, and results have the
bytes that it writes for the same options, at any number of threads. Other keywords are options of the method
(`-o` of the program), such as `tolerance` above; `extractors()` and `voxelizers()` list them.

A mesh parameter accepts a `Mesh`, the path of a file, an object with `.vertices` and `.faces` (trimesh) or
with `.points` and `.cells_dict` (meshio), or a tuple (points, polygons) or (points, triangles, quads) of
arrays.

Each function takes
    progress  a callable of the name of a stage and its completed share, 0 to 1; an exception that it raises
              ends the work
    cancel    an object with is_set(), such as a threading.Event: the work ends with `Cancelled` when it is
              set
    threads   maximum number of threads (default: all of the machine)
    log       a `Log`, which receives notes, times and statistics; without one the notes are warnings of
              the category `Note`
Ctrl-C ends the work. Other Python threads run meanwhile.
"""

from __future__ import annotations

import os
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
    """A warning, such as the share of a surface that is thinner than a voxel."""


class Log:
    """Notes and statistics; each call with the log adds to it.

    notes: warnings. stage_seconds: (stage, seconds) in the order of their ends. figures: name to number, such
    as `lost_surface_share`.
    """

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.stage_seconds: list[tuple[str, float]] = []
        self.figures: dict[str, float] = {}


class _Watching:
    """Provides the watch of a call, and passes its notes to the caller even if the call raises."""

    def __init__(self, progress: Progress | None, cancel: _IsSet | None, threads: int | None,
                 log: Log | None) -> None:
        if log is not None and not isinstance(log, Log):
            raise TypeError("log must be a hermesh.Log")
        self._watch = _core.Watch(progress, cancel, threads)
        self._log = log

    def __enter__(self) -> _core.Watch:
        return self._watch

    def __exit__(self, *_: object) -> None:
        if self._log is None:
            for note in self._watch.notes:
                # The line that called the public function is three frames up.
                warnings.warn(note, Note, stacklevel=3)
            return
        self._log.notes += self._watch.notes
        self._log.stage_seconds += self._watch.stage_seconds
        self._log.figures.update(self._watch.figures)


# ---- Meshes of all kinds.


def as_mesh(mesh: MeshLike, *, attributes: bool = False) -> Mesh:
    """Converts a mesh parameter to a `Mesh`; see the module.

    With `attributes` those of files, trimesh and meshio objects are converted, too. Raises Error for an
    invalid mesh of triangles and quads, and TypeError for another kind of object.
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
    """Returns a trimesh.Trimesh of the mesh in world units, with quads split along their intended diagonals.
    Needs the package trimesh."""
    import trimesh
    return trimesh.Trimesh(mesh.world_points(), mesh.triangulated(), process=False)


def to_meshio(mesh: Mesh) -> Any:
    """Returns a meshio.Mesh of the mesh in world units, with point attributes. Needs the package meshio."""
    import meshio
    cells = [(kind, array) for kind, array in (("triangle", mesh.triangles), ("quad", mesh.quads))
             if len(array)]
    return meshio.Mesh(mesh.world_points(), cells, point_data=dict(mesh.point_attributes))


def read_mesh(path: str | os.PathLike[str], *, attributes: bool = False, progress: Progress | None = None,
              cancel: _IsSet | None = None, threads: int | None = None, log: Log | None = None) -> Mesh:
    """Reads PLY, OBJ, OFF, STL, glTF 2.0 or 3MF, each also gzipped; polygons of more corners are split into
    triangles.

    With `attributes` those of PLY and OBJ are read, too. Raises Error for a file that is missing, damaged, of
    another type or without polygons. Adds a note for each tolerated fault.
    """
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.read_mesh(os.fspath(path), attributes, watch)


def write_mesh(path: str | os.PathLike[str], mesh: MeshLike, *, progress: Progress | None = None,
               cancel: _IsSet | None = None, threads: int | None = None, log: Log | None = None) -> None:
    """Writes PLY (binary, with attributes), OBJ, OFF, STL, glTF (.glb, .gltf) or 3MF, by the extension of
    the name, atomically.

    Raises Error for an unknown extension or a path that cannot be written. STL has single precision; a note
    gives the loss.
    """
    mesh = as_mesh(mesh, attributes=True)
    with _Watching(progress, cancel, threads, log) as watch:
        _core.write_mesh(os.fspath(path), mesh, watch)


# ---- Volumes' files and other programs' grids.


def read_vdb(path: str | os.PathLike[str], *, grid: str = "", progress: Progress | None = None,
             cancel: _IsSet | None = None, threads: int | None = None, log: Log | None = None) -> Volume:
    """Reads a scalar grid of a .vdb file: the named one, else `sdf`, else the only one.

    Raises Error for a file that is missing or damaged, and a grid that is missing or not scalar.
    """
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.read_vdb(os.fspath(path), grid, watch)


def write_vdb(path: str | os.PathLike[str], volumes: Volume | Iterable[Volume], *,
              progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
              log: Log | None = None) -> None:
    """Writes the volumes as the grids of one .vdb file, by their names. The same volumes give the same bytes.

    Raises Error for a path that cannot be written and for two volumes of one name.
    """
    several = [volumes] if isinstance(volumes, Volume) else list(volumes)
    with _Watching(progress, cancel, threads, log) as watch:
        _core.write_vdb(os.fspath(path), several, watch)


def to_pyopenvdb(volume: Volume) -> Any:
    """Converts the volume to a grid of the module pyopenvdb (Debian: python3-openvdb) through a file, without
    changes."""
    import pyopenvdb
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "volume.vdb")
        name = volume.name or "volume"
        write_vdb(path, volume.with_name(name))
        return pyopenvdb.read(path, name)


def from_pyopenvdb(grid: Any) -> Volume:
    """Converts a scalar grid of the module pyopenvdb to a volume through a file."""
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
    """Imports a CT or MRI (NIfTI-1: .nii, .hdr, .img), or with `dims` raw samples; all also gzipped.

    frame: index of the volume in a NIfTI file, from 0.
    dims, type, spacing, offset: of raw samples: their numbers along x (fastest in the file), y and z; uint8,
        int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64, followed by le (default) or be;
        their distances in mm; bytes before the first.
    replace_nan: the value that replaces samples that are not finite, which are otherwise an error.

    Returns the volume `volume`, in millimetres, with all samples active. Raises Error for a file that is
    missing, damaged or of another kind or size than specified.
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
    """Returns the level set `sdf` of any polygons, closed or not (`udf`, without signs, for
    signs="unsigned").

    resolution: voxels along the longest side of the mesh; or
    voxel_size: edge of a voxel, world units; or
    like: a volume; the new one shares its lattice.
    exterior_band, interior_band: widths of the bands outside and inside, in voxels, at least 1.
    voxelizer, signs, and options of the voxelizer: see voxelizers().

    Raises Error for a mesh without polygons or extent, a size that does not fit in memory, and unknown
    options. Adds a note if surface is lost between the samples.
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
    """Returns several volumes of one voxelization, in the order of the program's file: sdf, udf, fog,
    closest-point, triangle-id, attributes, attribute:NAME, separated by commas or as a list.

    fog_exterior: True if the fog's ramp covers both bands, not only the interior one. The others as in
        voxelize().
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

    extractor, and options of it: see extractors().
    isovalue: value of the surface, in the units of the volume.
    source: the polygons that the volume was made from, for extractors that use exact crossings.
    ends: where the surface reaches the end of the data: "closed" with a flat cap, or "open".
    mask: where an adaptive extractor observes its bound: where a level set is negative, where any other
        volume differs from its background; or
    frustum: the view of a camera, with frustum_resolution voxels along its longest side.
    outside: outside the mask: "simplify", "nothing" (no polygons) or "everywhere" (the bound).
    tolerance_grid: a volume whose values, none negative, scale the bound.
    written_in_single: True if the mesh goes into an STL file: guarantees then hold for the written mesh.

    Raises Error if there is no surface, for unknown options, and for options without effect.
    """
    chosen = _extracting(options, extractor=extractor, isovalue=isovalue, ends=ends, mask=mask,
                         frustum=frustum, frustum_resolution=frustum_resolution, outside=outside,
                         tolerance_grid=tolerance_grid, written_in_single=written_in_single)
    polygons = None if source is None else as_mesh(source)
    with _Watching(progress, cancel, threads, log) as watch:
        return _core.extract(volume, chosen, polygons, watch)


def remesh(mesh: MeshLike, *, resolution: int | None = None, voxel_size: float | None = None,
           exterior_band: float = 3.0, interior_band: float = 3.0, voxelizer: str = "hermesh",
           signs: str | None = None, voxelizer_options: Mapping[str, OptionValue] | None = None,
           thin: str | None = None,
           extractor: str = "manifold-dual-contouring", isovalue: float = 0.0, mask: Volume | None = None,
           frustum: Frustum | None = None, frustum_resolution: int = 84, outside: str = "simplify",
           tolerance_grid: Volume | None = None, written_in_single: bool = False,
           progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
           log: Log | None = None, **options: OptionValue) -> Mesh:
    """Converts polygons to a level set and back to a mesh: by default adaptive within tolerance=0.1 voxels,
    closed, manifold and free of self-intersection.

    resolution or voxel_size (world units), bands, voxelizer: as in voxelize(), with the voxelizer's options
    in a dict. extractor and the others: as in extract().
    thin: walls, wires and open sheets thinner than the voxels: "keep" thickens them until they appear, with a
        note, "drop" loses them, with a note, and "refuse" raises Error; None keeps them where possible, i.e.
        with the voxelizer hermesh, signs and the isovalue 0.
    """
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
    """A ball within which a bound may not hold, world units."""
    position: list[float]
    radius: float
    distance: float  # lower bound of the distance between mesh and polygons at the position
    area: float  # of the parts of polygons and mesh in the ball that are not shown to be near
    is_hole: bool  # the mesh closes a hole there; otherwise a wall or gap is too thin


class BoundedRemesh(NamedTuple):
    """A mesh with its certified distances, world units."""
    mesh: Mesh
    error: float  # the requested one or, for a budget, the one found
    to_polygons: float  # bound of the distance from the mesh to the boundary of the polygons' solid
    from_polygons: float  # bound of the distance from that boundary to the mesh
    voxel_size: float  # 0: no volume was made
    exceptions: list[ExceptedBall]  # with except_thin, balls outside of which the bounds hold


def remesh_within(mesh: MeshLike, *, error: float | None = None, triangles: int | None = None,
                  signs: str = "winding-number", over_holes: bool = False, smallest_voxel: float = 0.0,
                  limit_points: float = 3e7, written_in_single: bool = False, thin: str = "keep",
                  except_thin: bool = False, through_volume: bool = False,
                  progress: Progress | None = None, cancel: _IsSet | None = None,
                  threads: int | None = None, log: Log | None = None) -> BoundedRemesh:
    """Returns a mesh with a certified two-sided distance of at most `error` (world units) to the boundary of
    the polygons' solid, or with at most `triangles` and the smallest certified error found. Closed, manifold
    and free of self-intersection.

    over_holes allows it to close holes where no polygon is near. smallest_voxel (world units, 0 for an eighth
    of the error) and limit_points limit the work; beyond them the function raises hermesh.Error with location
    and reason. thin is as in remesh(); with "drop" and "refuse" a part that is too thin is an error.
    except_thin lets the bound hold except in the balls of `exceptions`, around such parts and holes, with a
    note, instead of raising an error. A mesh that is closed, manifold and free of self-intersection is
    simplified itself, without a volume, unless through_volume is set.
    """
    mesh = as_mesh(mesh)
    with _Watching(progress, cancel, threads, log) as watch:
        *made, exceptions = _core.remesh_within(mesh, error, triangles, signs, over_holes, smallest_voxel,
                                                limit_points, written_in_single, _thin(thin), except_thin,
                                                through_volume, watch)
    return BoundedRemesh(*made, [ExceptedBall(*ball) for ball in exceptions])


def combine(operation: str, a: MeshLike, b: MeshLike, *, resolution: int | None = None,
            voxel_size: float | None = None, exterior_band: float = 3.0, interior_band: float = 3.0,
            voxelizer: str = "hermesh", signs: str | None = None,
            voxelizer_options: Mapping[str, OptionValue] | None = None, thin: str | None = None,
            extractor: str = "manifold-dual-contouring", written_in_single: bool = False,
            progress: Progress | None = None, cancel: _IsSet | None = None, threads: int | None = None,
            log: Log | None = None, **options: OptionValue) -> Mesh:
    """Returns the "union", "intersection" or "difference" (a without b) of two meshes' solids, both on one
    lattice with their exact crossings, which preserve the curves where their surfaces intersect.

    resolution: voxels along the longest side of the larger solid; or voxel_size, world units. The others as
        in remesh().

    Raises Error for a result that is empty or everywhere thinner than a voxel. Adds a note if parts are lost
    between samples.
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
    """Breaks a solid, a mesh or a level set, into pieces that are closed and meet in shared triangles.

    cutters: "voronoi:N", "chunks:N" (Voronoi cells with rough walls), "planes:N", "planes:NX,NY,NZ,D;..."
        (N.x = D, world units), "mesh:FILE,..." or "mesh:FILE*N"; or a list of meshes, which cut one after
        another.
    copies: number of copies of each mesh of the list, scattered and rotated at random; 0: each once, in
        place.
    seed: random seed.
    roughness: displacement of the walls of chunks relative to the distance of seeds, 0 to 1.
    impact: scatter densest about this point; impact_radius: distance at which the density has halved; world
        units.
    density: scatter in proportion to the values of this volume.
    mesh_scale: scale factor of scattered meshes.
    method: "labelled", or "thesis" as printed, with its rule "printed" or "repaired".
    tolerance: maximum distance from the finest meshes, voxels; 0: nothing is merged.
    min_volume: voxels: smaller pieces join a neighbour; 0 keeps all. split: True to split disconnected
        pieces.
    hermite: data of the solid: "auto", "exact" from polygons, or "level-set".
    resolution or voxel_size, bands, voxelizer, thin: as in remesh(); not for a level set, which has voxels.

    Raises Error for unknown options, or a solid without an inside. Adds a note for each cutter without
    effect.
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

    reference: mesh for the distances and the comparison of the solids.
    certify: True to certify bounds of the Hausdorff distances to the reference.
    features: mesh whose sharp edges, of at least `dihedral` degrees, and corners the mesh should reproduce.
    samples: on each surface for the distances.
    voxel_size: world units, of the volume that the mesh was made from: differences within sqrt(3) voxels are
        explained.
    self_intersections: True to search for them. libraries: True to let OpenMesh and CGAL count, too.

    Returns a report: str() of it is the verdict, `watertight` and the counts are attributes, to_dict() has
    all values. Validation links CGAL, so programs that call it are under GPL-3. Raises Error for options
    without effect.
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
    """Validates all pieces of a fracture together: each piece, and that all fit without gap or overlap."""
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
