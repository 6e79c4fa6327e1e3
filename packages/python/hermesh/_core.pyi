"""Types of the bindings of the public C++ functions."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Error(RuntimeError):
    ...


class Cancelled(Exception):
    ...


class Mesh:

    def __init__(self, points: ArrayLike, triangles: ArrayLike | None = ..., quads: ArrayLike | None = ..., *,
                 point_attributes: Mapping[str, ArrayLike] = ...,
                 corner_attributes: Mapping[str, ArrayLike] = ...,
                 polygon_attributes: Mapping[str, ArrayLike] = ...,
                 labels: Mapping[str, Sequence[str]] = ...) -> None:
        ...

    def with_attributes(self, *, point_attributes: Mapping[str, ArrayLike] = ...,
                        corner_attributes: Mapping[str, ArrayLike] = ...,
                        polygon_attributes: Mapping[str, ArrayLike] = ...,
                        labels: Mapping[str, Sequence[str]] = ...) -> Mesh:
        ...

    @property
    def points(self) -> NDArray[np.float32]:
        ...

    @property
    def origin(self) -> tuple[float, float, float]:
        ...

    def world_points(self) -> NDArray[np.float64]:
        ...

    @property
    def triangles(self) -> NDArray[np.uint32]:
        ...

    @property
    def quads(self) -> NDArray[np.uint32]:
        ...

    def triangulated(self) -> NDArray[np.uint32]:
        ...

    @property
    def point_attributes(self) -> dict[str, NDArray[Any]]:
        ...

    @property
    def corner_attributes(self) -> dict[str, NDArray[Any]]:
        ...

    @property
    def polygon_attributes(self) -> dict[str, NDArray[Any]]:
        ...

    @property
    def labels(self) -> dict[str, list[str]]:
        ...

    def write(self, path: str | os.PathLike[str], **watching: Any) -> None:
        ...


class Volume:

    @staticmethod
    def from_numpy(values: ArrayLike, *, lower: Sequence[int] = ..., voxel_size: float = ...,
                   origin: Sequence[float] = ..., placement: ArrayLike | None = ..., level_set: bool = ...,
                   background: float | None = ..., name: str = ...) -> Volume:
        ...

    def to_numpy(self, lower: Sequence[int] | None = ...,
                 dims: Sequence[int] | None = ...) -> NDArray[np.float32]:
        ...

    def sample(self, places: ArrayLike) -> NDArray[np.float32]:
        ...

    @property
    def name(self) -> str:
        ...

    def with_name(self, name: str) -> Volume:
        ...

    @property
    def value_type(self) -> str:
        ...

    @property
    def is_level_set(self) -> bool:
        ...

    @property
    def placement(self) -> NDArray[np.float64]:
        ...

    @property
    def voxel_size(self) -> float:
        ...

    @property
    def background(self) -> float:
        ...

    @property
    def value_range(self) -> tuple[float, float]:
        ...

    @property
    def active_voxels(self) -> int:
        ...

    @property
    def memory_bytes(self) -> int:
        ...

    @property
    def lower(self) -> tuple[int, int, int]:
        ...

    @property
    def dims(self) -> tuple[int, int, int]:
        ...

    def write(self, path: str | os.PathLike[str], **watching: Any) -> None:
        ...


class Watch:
    notes: list[str]
    stage_seconds: list[tuple[str, float]]
    figures: list[tuple[str, float]]

    def __init__(self, progress: Callable[[str, float], Any] | None, cancel: Any,
                 threads: int | None) -> None:
        ...


class Frustum:
    position: list[float]
    look_at: list[float]
    up: list[float]
    angle: float
    aspect: float
    near: float
    far: float

    def __init__(self, *, position: Sequence[float] = ..., look_at: Sequence[float] = ...,
                 up: Sequence[float] = ..., angle: float = ..., aspect: float = ..., near: float = ...,
                 far: float = ...) -> None:
        ...


class Thin:
    keep: Thin
    drop: Thin
    refuse: Thin
    name: str
    value: int


class VoxelizeOptions:
    resolution: int | None
    voxel_size: float | None
    like: Volume
    exterior_band: float
    interior_band: float
    voxelizer: str
    options: dict[str, str]
    thin: Thin | None


class ExtractOptions:
    extractor: str
    options: dict[str, str]
    isovalue: float
    ends: str
    mask: Volume
    frustum: Frustum | None
    frustum_resolution: int
    outside: str
    tolerance_grid: Volume
    written_in_single: bool


class CutterMesh:

    def __init__(self, name: str, mesh: Mesh, copies: int) -> None:
        ...


class FractureOptions:
    cutters: str
    meshes: list[CutterMesh]
    seed: int
    roughness: float
    impact: list[float] | None
    impact_radius: float | None
    density: Volume
    mesh_scale: float
    method: str
    tolerance: float
    rule: str
    min_volume: float
    split: bool
    hermite: str


class Piece:
    name: str
    mesh: Mesh
    volume: float
    area: float
    centre_of_mass: list[float]
    neighbours: dict[int, tuple[int, float]]

    @property
    def inertia(self) -> NDArray[np.float64]:
        ...


class Fracture:
    pieces: list[Piece]
    seconds: float

    def __len__(self) -> int:
        ...


class OptionInfo:
    name: str
    fallback: str
    help: str
    choices: list[str]
    minimum: float
    maximum: float


class MethodInfo:
    name: str
    summary: str
    closed: bool
    manifold: bool
    oriented: bool
    free_of_self_intersection: bool
    options: list[OptionInfo]


def version() -> str:
    ...


def extractors() -> list[MethodInfo]:
    ...


def voxelizers() -> list[MethodInfo]:
    ...


def grid_names(path: str | os.PathLike[str]) -> list[str]:
    ...


def read_mesh(path: str, attributes: bool, watch: Watch, /) -> Mesh:
    ...


def write_mesh(path: str, mesh: Mesh, watch: Watch, /) -> None:
    ...


def read_vdb(path: str, grid: str, watch: Watch, /) -> Volume:
    ...


def write_vdb(path: str, volumes: Sequence[Volume], watch: Watch, /) -> None:
    ...


def import_volume(path: str, frame: int | None, dims: Sequence[int] | None, type: str,
                  spacing: Sequence[float] | None, offset: int | None, replace_nan: float | None,
                  watch: Watch, /) -> Volume:
    ...


def voxelize(mesh: Mesh, options: VoxelizeOptions, watch: Watch, /) -> Volume:
    ...


def voxelize_grids(mesh: Mesh, grids: str, options: VoxelizeOptions, fog_exterior: bool, watch: Watch,
                   /) -> list[Volume]:
    ...


def extract(volume: Volume, options: ExtractOptions, source: Mesh | None, watch: Watch, /) -> Mesh:
    ...


def remesh(mesh: Mesh, voxelizing: VoxelizeOptions, extracting: ExtractOptions, watch: Watch, /) -> Mesh:
    ...


def remesh_within(mesh: Mesh, error: float | None, triangles: int | None, signs: str, over_holes: bool,
                  smallest_voxel: float, limit_points: float, written_in_single: bool, thin: Thin,
                  except_thin: bool, through_volume: bool, watch: Watch, /) -> tuple[
                      Mesh, float, float, float, float, list[tuple[list[float], float, float, float, bool]]]:
    ...


def combine(operation: str, a: Mesh, b: Mesh, voxelizing: VoxelizeOptions, extracting: ExtractOptions,
            watch: Watch, /) -> Mesh:
    ...


def fracture(mesh: Mesh, voxelizing: VoxelizeOptions, options: FractureOptions, watch: Watch, /) -> Fracture:
    ...


def fracture_volume(volume: Volume, options: FractureOptions, watch: Watch, /) -> Fracture:
    ...
