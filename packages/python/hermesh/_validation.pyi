"""Types of the bindings of the judges."""

from collections.abc import Sequence
from typing import Any

from ._core import Mesh, Watch


class SurfaceDistances:
    max: float
    mean: float
    rms: float
    worst: list[float]


class HausdorffBracket:
    lower: float
    upper: float


class DefectPlace:
    point: list[float]
    polygons: list[int]


class Defect:
    name: str
    count: int
    places: list[DefectPlace]


class Report:
    points: int
    triangles: int
    quads: int
    boundary_edges: int
    non_manifold_edges: int
    non_manifold_vertices: int
    inconsistent_edges: int
    degenerate_polygons: int
    duplicate_polygons: int
    isolated_points: int
    components: int
    euler_characteristic: int
    genus: float | None
    self_intersecting_pairs: int | None
    volume: float
    area: float
    smallest_angle: float
    worst_aspect: float
    to_reference: SurfaceDistances | None
    from_reference: SurfaceDistances | None
    certified_to_reference: HausdorffBracket | None
    certified_from_reference: HausdorffBracket | None
    solid: str | None
    defects: list[Defect]
    sentences: list[str]
    json: str
    closed: bool
    manifold: bool
    oriented: bool
    watertight: bool

    def to_dict(self) -> dict[str, Any]:
        ...


class FractureReport:
    consistent: bool
    pieces: int
    triangles: int
    seam_triangles: int
    unmatched_cut: int
    intersecting_pairs: int
    broken_pieces: int
    pieces_volume: float
    sentences: list[str]


def validate(mesh: Mesh, reference: Mesh | None, features: Mesh | None, self_intersections: bool,
             libraries: bool, certify: bool, samples: int, dihedral: float, voxel_size: float, watch: Watch,
             /) -> Report:
    ...


def validate_fracture(pieces: Sequence[Mesh], watch: Watch, /) -> FractureReport:
    ...
