"""Settings of the stages that reconstruct: ingest, sparse, scale, dense, texture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import SettingsError, about, check_settings


@dataclass(frozen=True)
class IngestSettings:
    """Limits for usable photos, and the choice of frames from a video."""

    # fmt: off
    max_side: Annotated[int, about("Larger photos are reduced to this longer side", unit="px", low=640, high=20000)] = 3200
    min_side: Annotated[int, about("Photos with a shorter side below this are skipped", unit="px", low=64, high=4000, expert=True)] = 320
    max_aspect: Annotated[float, about("Photos with a larger aspect ratio (panoramas) are skipped", low=1.0, high=100.0, expert=True)] = 2.6
    video_max_frames: Annotated[int, about("Maximum number of frames taken from one video", unit="frames", low=3, high=5000, expert=True)] = 150
    hide_people: Annotated[bool, about("Find people in the photos, hide them and leave them out of the scan", expert=True)] = True
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "ingest")


@dataclass(frozen=True)
class SparseSettings:
    """How photos are matched and registered (COLMAP through pycolmap)."""

    # fmt: off
    features: Annotated[Literal["auto", "sift"], about("Feature detector: sift; auto adds doubled photos (of nine and more), then XFeat, then ALIKED (walltopo[features]), where SIFT fails")] = "auto"
    max_features: Annotated[int, about("Maximum number of features per photo", unit="features", low=500, high=65536, expert=True)] = 8192
    first_octave: Annotated[int, about("First SIFT octave; -1 doubles the photo (4 times slower)", low=-1, high=2, expert=True)] = 0
    exhaustive_max: Annotated[int, about("Up to this many photos, match all pairs", unit="photos", low=2, high=2000, expert=True)] = 60
    sequential: Annotated[int, about("Above exhaustive_max: number of next photos by name to match each photo with", low=1, expert=True)] = 10
    retrieved: Annotated[int, about("Above exhaustive_max: number of most similar photos to match each photo with", unit="photos", low=1, expert=True)] = 30
    min_matches: Annotated[int, about("Minimum number of verified matches per pair of photos", unit="matches", low=8, expert=True)] = 15
    threads: Annotated[int, about("CPU threads; 0 uses all", unit="threads", low=0, high=512, expert=True)] = 0
    seed: Annotated[int, about("Random seed", low=0, high=2**31 - 1, expert=True)] = 0
    accept_weak: Annotated[bool, about("Go on with a model of too few points for a sound mesh", expert=True)] = False
    reference: Annotated[str, about("Folder of a finished scan to align the new photos to", content=("photos", "sparse", "scale.json"))] = ""
    poses: Annotated[str, about("File or folder of camera poses from a phone or another program, where the mapping starts", expert=True)] = ""
    part: Annotated[bool, about("The photos show a part of the reference's wall; all else is taken from the reference", expert=True)] = False
    part_colours: Annotated[str, about("With part: exchange only holds of these colours, comma-separated; empty: all holds", expert=True)] = ""
    align: Annotated[Literal["constrained", "rigid"], about("Alignment to the reference: constrained keeps its cameras fixed; rigid fits one similarity afterwards", expert=True)] = "constrained"
    reference_retrieved: Annotated[int, about("Number of reference photos to match each new photo with", unit="photos", low=2, high=1000, expert=True)] = 20
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "sparse")
        if self.part and not self.reference:
            raise SettingsError("sparse.part needs sparse.reference: the scan of the whole wall")
        if self.part_colours and not self.part:
            raise SettingsError("sparse.part_colours needs sparse.part")
        if self.poses and self.reference:
            raise SettingsError(
                "sparse.poses and sparse.reference exclude each other: each sets the scan's frame"
            )


@dataclass(frozen=True)
class ScaleSettings:
    """How the reconstruction gets metres, an up direction and a floor."""

    # fmt: off
    method: Annotated[Literal["auto", "measure", "distance", "poses", "none"], about("Source of metres and up; auto tries the reference, scale.distance, the scale plate, a phone's poses, stickers, then none")] = "auto"
    plates: Annotated[str, about("TOML file with the geometry of your own scale plates; empty: the plates of walltopo", content=(".",))] = ""
    ignore_plates: Annotated[str, about("Scale plates to ignore, by lowest marker id, comma-separated, such as 0,4", expert=True)] = ""
    distance: Annotated[str, about("Known distance A-B=1.23 in metres, between two photos or two points of scale.points")] = ""
    points: Annotated[str, about("TOML file of named points, each given by its pixels in two or more photos", content=(".",), expert=True)] = ""
    way: Annotated[Literal["auto", "markers", "corners", "published"], about("Estimator of the plate: markers (PnP, averaged) or corners (triangulated), refined; published: markers, unrefined", expert=True)] = "auto"
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "scale")


@dataclass(frozen=True)
class DenseSettings:
    """How the mesh is made; `backend` chooses the program, the rest shapes its result."""

    # fmt: off
    backend: Annotated[str, about("Method that computes the mesh: auto, sgm, colmap, openmvs, sparse or a plug-in's")] = "auto"
    mesh: Annotated[str, about("Ready mesh (OBJ, PLY, GLB) in the frame of sparse.poses; it replaces stereo", content=(".",), expert=True)] = ""
    mesh_texture: Annotated[Literal["auto", "always", "never"], about("Whether the texture of the ready mesh is used instead of painting the photos; auto: unless people are in the photos", expert=True)] = "auto"
    edge_length: Annotated[float, about("Target edge length of the mesh in scans with a scale", unit="m", low=0.001, high=0.5)] = 0.008
    edge_pixels: Annotated[float, about("Minimum edge length of the mesh in photo pixels; the target in scans without a scale", unit="px", low=0.5, high=50, expert=True)] = 3.0
    max_size: Annotated[int, about("Longer side of the photos for stereo", unit="px", low=200, high=8000, expert=True)] = 1600
    neighbours: Annotated[int, about("Number of stereo partners per photo", low=1, high=20, expert=True)] = 4
    confirm: Annotated[Literal["auto", "always", "never"], about("Whether another photo must confirm each depth; auto: in scans of more than 12 photos", expert=True)] = "auto"
    min_part: Annotated[float, about("Loose parts smaller than this (metres, or 3 % of the scene) are removed", low=0, expert=True)] = 0.3
    max_hole: Annotated[float, about("Holes up to this diameter (metres, or 1 % of the scene) are closed", low=0, expert=True)] = 0.1
    max_gap: Annotated[float, about("Gaps up to this width (metres, or 0.2 % of the scene) are closed", low=0, high=0.2, expert=True)] = 0.02
    max_guess: Annotated[float, about("Larger holes up to this diameter (metres, or 10 % of the scene per metre) are closed by a guess; 0: none", low=0, high=10)] = 1.0
    openmvs_bin: Annotated[str, about("Folder of the OpenMVS programs; empty: search PATH", program=True, expert=True)] = ""
    openmvs_refine: Annotated[bool, about("With backend openmvs: also run RefineMesh (slow)", expert=True)] = False
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "dense")


@dataclass(frozen=True)
class TextureSettings:
    """How photos become the mesh's picture."""

    # fmt: off
    backend: Annotated[Literal["embedded", "openmvs"], about("Program that paints the texture: walltopo, or TextureMesh of OpenMVS", expert=True)] = "embedded"
    size: Annotated[int, about("Side of the square texture atlas", unit="px", low=256, high=16384)] = 4096
    blend: Annotated[bool, about("Even out exposure between photos, and seams", expert=True)] = True
    openmvs_bin: Annotated[str, about("Folder of the OpenMVS programs; empty: search PATH", program=True, expert=True)] = ""
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "texture")
