from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, SupportsIndex, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import TypedDict, Unpack

__all__ = [
    "Error",
    "Frame",
    "Frames",
    "REASONS",
    "Result",
    "Taxonomy",
    "__version__",
    "annotate",
    "annotate_slice",
    "cluster",
    "cluster_image",
    "compare",
    "evaluate",
    "explain",
    "failures",
    "figure",
    "frames",
    "join",
    "parameters",
    "plan",
    "simulate",
    "topics",
    "triage",
]

__version__: str
REASONS: list[tuple[str, int]]

_Path: TypeAlias = str | PathLike[str]
_Preset: TypeAlias = Literal["best", "paper", "authors"]
_BirdsEye: TypeAlias = Literal["off", "size", "box", "rectangle", "hull"]
_Method: TypeAlias = Literal[
    "divide-and-merge",
    "depth-clustering",
    "scan-line-run",
    "euclidean",
    "dbscan",
    "supervoxel",
    "alpine",
    "one-per-class",
]
_Compression: TypeAlias = Literal["zstd", "lz4", "none"]
_Boxes: TypeAlias = Literal["markers", "detection3d", "autoware", "all"]
_Runtime: TypeAlias = Literal["auto", "onnxruntime", "tract"]
_Device: TypeAlias = Literal["auto", "cpu", "cuda", "tensorrt"]

class _DLPack(Protocol):
    def __dlpack__(self) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...

class _Labelled(Protocol):
    @property
    def semantic(self) -> Any: ...
    @property
    def instance(self) -> Any: ...

_Setting: TypeAlias = bool | int | float | str | Iterable[float] | Iterable[Iterable[float]]
_Array: TypeAlias = ArrayLike | _DLPack
_Point: TypeAlias = SupportsIndex | Iterable[float]
_Span: TypeAlias = tuple[int, int] | None
_Panel: TypeAlias = Literal[
    "range", "intensity", "mask", "components", "instances", "votes", "bev"
]
_Form: TypeAlias = Literal["png", "svg", "pdf"]
_Side: TypeAlias = tuple[_Array, _Array] | _Labelled

class _Parameters(TypedDict, total=False):
    """Every parameter by its keyword, as `parameters` lists them."""

    projection_rows_from: str | None
    projection_rows: int | str | None
    projection_columns: int | str | None
    projection_field_of_view: Iterable[float] | Iterable[Iterable[float]] | str | None
    projection_wrap: str | None
    smoothing: bool | str | None
    smoothing_rows: int | str | None
    smoothing_columns: int | str | None
    smoothing_radius: float | str | None
    smoothing_steps: float | str | None
    smoothing_agreement: float | str | None
    smoothing_trusted: float | str | None
    smoothing_own_votes: float | str | None
    smoothing_rounds: int | str | None
    bleed: bool | str | None
    bleed_share: float | str | None
    bleed_cell: float | str | None
    bleed_sure: float | str | None
    segment_vote: bool | str | None
    segment_vote_points: float | str | None
    segment_vote_body: float | str | None
    vehicle_strips: bool | str | None
    vehicle_strips_height: float | str | None
    vehicle_strips_ratio: float | str | None
    ground_max_slope: float | str | None
    ground_baseline: float | str | None
    ground_step: float | str | None
    ground_wall_slope: float | str | None
    ground_slope_change: float | str | None
    ground_start_distance: float | str | None
    ground_cell: float | str | None
    ground_height_band: float | str | None
    rounding: str | None
    condition_angle: float | str | None
    condition_rays: str | None
    condition_rays_nominal_row_step: float | str | None
    condition_gate: bool | str | None
    condition_gate_farthest: float | str | None
    condition_gate_touching: float | str | None
    condition_gate_touching_range: float | str | None
    condition_gate_reach_by_range: Iterable[float] | Iterable[Iterable[float]] | str | None
    condition_nearness: bool | str | None
    condition_nearness_share_of_width: float | str | None
    condition_nearness_at_most: float | str | None
    same_class_neighbours: bool | str | None
    seeding: str | None
    leftovers: str | None
    merge_ratio: float | str | None
    accumulation: str | None
    birds_eye: bool | str | None
    birds_eye_region: str | None
    birds_eye_margin: float | str | None
    birds_eye_same_class: bool | str | None
    birds_eye_transitive: bool | str | None
    birds_eye_grown_pixels_only: bool | str | None
    fragments: bool | str | None
    fragments_touching_share: float | str | None
    fragments_touching: float | str | None
    fragments_widest: float | str | None
    fragments_bridged: float | str | None
    fragments_slack: float | str | None
    fragments_perimeter_weight: float | str | None
    fragments_excess_weight: float | str | None
    fragments_delay: float | str | None
    tree: bool | str | None
    tree_height_weight: float | str | None
    tree_nearest: float | str | None
    tree_farthest: float | str | None
    tree_window: float | str | None
    tree_least_points: int | str | None
    tree_least_scored: int | str | None
    tree_longest: float | str | None
    tree_gap: float | str | None
    tree_nearest_gap: float | str | None
    tree_least_gap: float | str | None
    tree_wholeness: float | str | None
    tree_filled: float | str | None
    tree_least_score: float | str | None
    tree_power: float | str | None
    tree_background: float | str | None
    min_pixels: int | str | None
    back_projection_rows: int | str | None
    back_projection_columns: int | str | None
    back_projection_nearest: str | None
    tracks_lag_s: float | str | None
    tracks_gap_s: float | str | None
    tracks_least_affinity: float | str | None
    tracks_distance_weight: float | str | None
    tracks_place_error: float | str | None
    tracks_displacement_error: float | str | None
    tracks_kept_after_second: float | str | None
    tracks_other_class: float | str | None
    tracks_young: float | str | None
    tracks_least_continuation: float | str | None
    tracks_whole_share: float | str | None
    tracks_part_share: float | str | None
    registration_voxel: float | str | None
    registration_max_points: int | str | None
    registration_nearest: float | str | None
    registration_farthest: float | str | None
    ego_motion_voxels: Iterable[float] | Iterable[Iterable[float]] | str | None
    ego_motion_reach: float | str | None
    ego_motion_first_width: float | str | None
    ego_motion_width: float | str | None
    ego_motion_least_width: float | str | None
    ego_motion_prediction_weight: float | str | None
    ego_motion_least_points: int | str | None
    ego_motion_least_matched: float | str | None
    ego_motion_least_inliers: float | str | None
    ego_motion_highest_speed: float | str | None
    ego_motion_highest_acceleration: float | str | None
    ego_motion_highest_turn_rate: float | str | None
    ego_motion_longest_gap: float | str | None

class Error(Exception): ...

@final
class Taxonomy:
    def __new__(cls, path: _Path | None = None) -> Taxonomy: ...
    @property
    def name(self) -> str: ...
    @property
    def classes(self) -> list[str]: ...
    @property
    def things(self) -> list[int]: ...
    @property
    def ids(self) -> dict[int, int]: ...

@final
class Result:
    @property
    def instance(self) -> NDArray[np.uint32]: ...
    @property
    def component(self) -> NDArray[np.uint32]: ...
    @property
    def semantic(self) -> NDArray[np.uint16]: ...
    @property
    def reason(self) -> NDArray[np.uint8]: ...
    @property
    def ground(self) -> NDArray[np.float32] | None: ...
    @property
    def range_image(self) -> NDArray[np.float32]: ...
    @property
    def point_of_pixel(self) -> NDArray[np.int64]: ...
    @property
    def pixel_of_point(self) -> NDArray[np.int64]: ...
    @property
    def votes(self) -> NDArray[np.void]: ...
    @property
    def merges(self) -> NDArray[np.void]: ...
    @property
    def joins(self) -> NDArray[np.void]: ...
    @property
    def instances(self) -> NDArray[np.void]: ...
    @property
    def rotation(self) -> NDArray[np.float64]: ...
    @property
    def times(self) -> dict[str, float]: ...
    @property
    def projection(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def _repr_png_(self) -> bytes: ...

@final
class Frame:
    @property
    def topic(self) -> str: ...
    @property
    def number(self) -> int: ...
    @property
    def stamp_ns(self) -> int: ...
    @property
    def log_time_ns(self) -> int: ...
    @property
    def frame_id(self) -> str: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def points(self) -> NDArray[np.float32]: ...
    @property
    def classes(self) -> NDArray[np.uint16] | None: ...
    @property
    def confidence(self) -> NDArray[np.float32] | None: ...
    @property
    def ring(self) -> NDArray[np.uint16] | None: ...
    @property
    def source(self) -> NDArray[np.uint16] | None: ...
    @property
    def fields(self) -> dict[str, NDArray[np.int64] | NDArray[np.float64]]: ...
    @property
    def semantics(self) -> str: ...
    @property
    def taxonomy(self) -> Taxonomy: ...
    @property
    def rotation(self) -> NDArray[np.float64]: ...
    def cluster(
        self,
        semantics: _Array | Literal["ground", "all"] | None = None,
        *,
        confidence: _Array | None = None,
        ring: _Array | None = None,
        source: _Array | None = None,
        taxonomy: Taxonomy | _Path | None = None,
        preset: _Preset = "best",
        voxel: float | None = None,
        angle: float | None = None,
        gap_columns: int | None = None,
        gap_rows: int | None = None,
        min_points: int | None = None,
        bev: _BirdsEye | None = None,
        method: _Method | None = None,
        set: dict[str, _Setting] | None = None,
        rows: int | None = None,
        columns: int | None = None,
        fov: tuple[float, float] | None = None,
        **parameters: Unpack[_Parameters],
    ) -> Result: ...
    def __len__(self) -> int: ...

@final
class Frames:
    @property
    def topic(self) -> str: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Frames: ...
    def __next__(self) -> Frame: ...
    @overload
    def __getitem__(self, index: SupportsIndex, /) -> Frame: ...
    @overload
    def __getitem__(self, index: slice, /) -> Frames: ...

def cluster(
    points: _Array | Frame,
    semantics: _Array | Literal["ground", "all"] | None = None,
    *,
    confidence: _Array | None = None,
    ring: _Array | None = None,
    source: _Array | None = None,
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str | None = None,
    **parameters: Unpack[_Parameters],
) -> Result: ...
def cluster_image(
    x: _Array,
    y: _Array,
    z: _Array,
    mask: _Array,
    *,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str | None = None,
    **parameters: Unpack[_Parameters],
) -> Result: ...
def frames(
    path: _Path,
    topic: str | None = None,
    *,
    start: int = 0,
    stop: int | None = None,
    fields: str | Iterable[str] = (),
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
) -> Frames: ...
def topics(path: _Path) -> list[str]: ...
def annotate(
    path: _Path,
    out: _Path,
    *,
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    topics: str | Iterable[str] = (),
    from_: float | str | None = None,
    to: float | str | None = None,
    objects: _Boxes | Iterable[_Boxes] | None = None,
    flavor: Literal["auto", "foxglove"] = "auto",
    compression: _Compression | None = None,
    unchecked: bool = False,
    assemble: str | None = None,
    track: Literal["auto", "on", "off"] = "auto",
    lag: float | None = None,
    ego_motion: str = "auto",
    only: bool = False,
    in_place: bool = False,
    resume: bool = False,
    force: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    **parameters: Unpack[_Parameters],
) -> dict[str, Any]: ...
def parameters(preset: _Preset = "best") -> list[dict[str, Any]]: ...
def plan(
    inputs: _Path | Iterable[_Path], shards: int, *, topics: str | Iterable[str] | None = None
) -> list[dict[str, Any]]: ...
def annotate_slice(
    slice: dict[str, Any],
    folder: _Path,
    *,
    input: _Path | None = None,
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    topics: str | Iterable[str] = (),
    from_: float | str | None = None,
    to: float | str | None = None,
    objects: _Boxes | Iterable[_Boxes] | None = None,
    flavor: Literal["auto", "foxglove"] = "auto",
    compression: _Compression | None = None,
    unchecked: bool = False,
    only: bool = False,
    in_place: bool = False,
    resume: bool = False,
    force: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    **parameters: Unpack[_Parameters],
) -> dict[str, Any]: ...
def join(
    slices: Iterable[_Path],
    out: _Path,
    *,
    input: _Path | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> dict[str, Any]: ...
@overload
def evaluate(
    scans: _Path,
    *,
    taxonomy: Taxonomy | _Path | None = None,
    min_points: int = 50,
    over_time: bool = False,
    topic: str | None = None,
) -> dict[str, dict[str, Any]]: ...
@overload
def evaluate(
    scans: Iterable[tuple[_Side, _Side]],
    *,
    taxonomy: Taxonomy | _Path | None = None,
    min_points: int = 50,
    over_time: bool = False,
    topic: str | None = None,
) -> dict[str, Any]: ...
def simulate(
    out: _Path,
    *,
    sensor: str = "hdl-64e",
    scene: str = "street",
    frames: int = 50,
    seed: int = 1,
    encoding: Literal[
        "ros2", "ros1", "foxglove-protobuf", "foxglove-json", "foxglove-ros2"
    ] = "ros2",
    compression: _Compression = "zstd",
    force: bool = False,
) -> int: ...
def explain(
    cloud: Result | Frame | _Path,
    a: _Point | None = None,
    b: _Point | None = None,
    *,
    instances: Iterable[int] | None = None,
    within: float = 0.3,
    what_if: bool = True,
    track: int | None = None,
    link: int | None = None,
    start: int = 0,
    stop: int | None = None,
    lag: float | None = None,
    ego_motion: str = "auto",
    topic: str | None = None,
    frame: int = 0,
    time: float | str | None = None,
    assemble: str | None = None,
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    **parameters: Unpack[_Parameters],
) -> dict[str, Any]: ...
@overload
def figure(
    cloud: Result | Frame | _Path,
    out: None = None,
    *,
    format: _Form | None = None,
    panels: _Panel | Iterable[_Panel] = (),
    theme: Literal["dark", "light"] = "dark",
    aspect: float = 0.125,
    dpi: float = 192,
    window: tuple[_Span, _Span] | None = None,
    view: tuple[tuple[float, float], tuple[float, float]] | None = None,
    steps: _Path | None = None,
    steps_by: Literal["instance", "decision"] = "instance",
    force: bool = False,
    a: _Point | None = None,
    b: _Point | None = None,
    instances: Iterable[int] | None = None,
    within: float = 0.3,
    tracks: bool = False,
    start: int = 0,
    stop: int | None = None,
    lag: float | None = None,
    ego_motion: str = "auto",
    topic: str | None = None,
    frame: int = 0,
    time: float | str | None = None,
    assemble: str | None = None,
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    **parameters: Unpack[_Parameters],
) -> bytes: ...
@overload
def figure(
    cloud: Result | Frame | _Path,
    out: _Path,
    *,
    format: _Form | None = None,
    panels: _Panel | Iterable[_Panel] = (),
    theme: Literal["dark", "light"] = "dark",
    aspect: float = 0.125,
    dpi: float = 192,
    window: tuple[_Span, _Span] | None = None,
    view: tuple[tuple[float, float], tuple[float, float]] | None = None,
    steps: _Path | None = None,
    steps_by: Literal["instance", "decision"] = "instance",
    force: bool = False,
    a: _Point | None = None,
    b: _Point | None = None,
    instances: Iterable[int] | None = None,
    within: float = 0.3,
    tracks: bool = False,
    start: int = 0,
    stop: int | None = None,
    lag: float | None = None,
    ego_motion: str = "auto",
    topic: str | None = None,
    frame: int = 0,
    time: float | str | None = None,
    assemble: str | None = None,
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    **parameters: Unpack[_Parameters],
) -> None: ...
def triage(
    path: _Path,
    *,
    limit: int = 20,
    weigh_points: int = 50,
    topics: str | Iterable[str] = (),
    start: int = 0,
    stop: int | None = None,
    from_: float | str | None = None,
    to: float | str | None = None,
    assemble: str | None = None,
    out: _Path | None = None,
    csv: _Path | None = None,
    report: _Path | None = None,
    compression: _Compression = "zstd",
    force: bool = False,
    progress: Callable[[int, int], object] | bool | None = None,
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    **parameters: Unpack[_Parameters],
) -> dict[str, Any]: ...
def failures(
    path: _Path,
    *,
    topic: str | None = None,
    sequences: str | Iterable[str] = (),
    start: int = 0,
    stop: int | None = None,
    labels: _Path | None = None,
    true_class_field: str = "label",
    true_instance_field: str = "true_instance",
    small: int = 50,
    assemble: str | None = None,
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    preset: _Preset = "best",
    voxel: float | None = None,
    angle: float | None = None,
    gap_columns: int | None = None,
    gap_rows: int | None = None,
    min_points: int | None = None,
    bev: _BirdsEye | None = None,
    method: _Method | None = None,
    set: dict[str, _Setting] | None = None,
    rows: int | None = None,
    columns: int | None = None,
    fov: tuple[float, float] | None = None,
    sensor_frame: str = "auto",
    units: Literal["m", "cm", "mm"] | None = None,
    sensor_origin: str | Iterable[str] = (),
    min_range: float | None = None,
    max_range: float | None = None,
    crop: str | None = None,
    ego: str | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    **parameters: Unpack[_Parameters],
) -> dict[str, Any]: ...
def compare(
    path: _Path,
    *,
    methods: str | Iterable[str] = (
        "best",
        "paper",
        "authors",
        "alpine",
        "euclidean",
        "dbscan",
        "scan-line-run",
        "depth-clustering",
        "supervoxel",
        "one-per-class",
    ),
    voxels: Iterable[float] = (),
    min_points: int = 50,
    topic: str | None = None,
    sequences: str | Iterable[str] = (),
    start: int = 0,
    stop: int | None = None,
    labels: _Path | None = None,
    true_class_field: str = "label",
    true_instance_field: str = "true_instance",
    semantics: str = "auto",
    taxonomy: Taxonomy | _Path | None = None,
    tolerance: float = 0.01,
    model_config: _Path | Iterable[_Path] | None = None,
    model_image: Literal["auto", "clustering"] = "auto",
    remission_scale: float | None = None,
    batch: int | None = None,
    runtime: _Runtime = "auto",
    onnxruntime: _Path | None = None,
    device: _Device = "auto",
    set: dict[str, _Setting] | None = None,
    **parameters: Unpack[_Parameters],
) -> list[dict[str, Any]]: ...
def _main(program: Sequence[str], words: Sequence[str]) -> int: ...
