"""Dense mesh and texture of a rendered gym against its exact truth.

    python -m benchmarks.dense SCAN --photos DATA/gym-a/photos --truth DATA/gym-a
    python -m benchmarks.dense SCAN --truth DATA/gym-a --update RESET DATA/gym-a-reset
    python -m benchmarks.dense SCAN --truth DATA/gym-a --held-out 12 --pictures FOLDER
    python -m benchmarks.dense NEW --photos DATA/gym-a-reset/photos --truth DATA/gym-a-reset \\
        --reference SCAN DATA/gym-a

Stages whose results SCAN lacks are run in it, from `--photos` on; their seconds and memory are
printed. Accuracy: distance of points sampled evenly on the mesh to the truth's surface.
Completeness: distance to the mesh of points on the truth that at least 3 photos see. Filled holes
(docs/dense.md) count in neither; a separate line compares them with the truth. Open gaps: length
and area between borders of the mesh that face each other. One rigid motion between camera centres,
without scale, maps the scan's frame to the truth's. With `--reference` the scan is registered into
that one, and the motion is that of the reference's cameras: nothing is fitted to the new scan.
`--update` evaluates such a scan beside its reference. `--held-out N` makes mesh and texture anew
without every N-th photo and renders those views; `--within M` does so only with the photos taken
within M metres of the middle one.
"""

from __future__ import annotations

import argparse
import json
import resource
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.reconstruction_poses import run_stages, run_to_scale
from walltopo.core import Mesh, Silent, View
from walltopo.geometry.mesh_check import check_mesh
from walltopo.geometry.mesh_files import read_mesh
from walltopo.geometry.topology import edges_of
from walltopo.geometry.zbuffer import render_ids
from walltopo.images.files import read_grey, read_rgb
from walltopo.pipeline.settings import Settings
from walltopo.reconstruct.dense.make_mesh import edge_and_unit
from walltopo.reconstruct.dense.scene import read_scene
from walltopo.reconstruct.dense.sgm import sgm_mesh
from walltopo.reconstruct.settings import DenseSettings, SparseSettings, TextureSettings
from walltopo.reconstruct.texture.atlas import Texture, make_texture
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.scale import Scale

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

_SAMPLES = 200_000
_HOLD_SIZE = 0.05
# Measure gaps up to these widths; below this height the floor is bare and always open.
_GAP_WIDTHS = (0.02, 0.05)
_WALL_HEIGHT = 0.5


def sample(mesh: Mesh, weight: Floats, count: int, seed: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return points spread evenly over the weighted area, and the face of each."""
    rng = np.random.default_rng(seed)
    share = mesh.areas * weight
    face = rng.choice(len(mesh.faces), count, p=share / share.sum())
    a, b = rng.random((2, count, 1))
    over = (a + b) > 1
    a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    p, q, r = (mesh.vertices[mesh.faces[face, k]] for k in range(3))
    return p + a * (q - p) + b * (r - p), face


def distance(points: Floats, mesh: Mesh, seed: int = 7) -> Floats:
    """Return (n,) distance of points to the mesh, exact to the triangles of the nearest samples."""
    from scipy.spatial import cKDTree
    from trimesh.triangles import closest_point

    low, high = points.min(axis=0) - 0.3, points.max(axis=0) + 0.3
    near = ((mesh.centroids >= low) & (mesh.centroids <= high)).all(axis=1)
    spread, face = sample(mesh, near.astype(float), 2_000_000, seed)
    tree = cKDTree(np.concatenate([spread, mesh.centroids[near]]))
    faces = np.concatenate([face, np.flatnonzero(near)])
    _, nearest = tree.query(points, k=4)
    best = np.full(len(points), np.inf)
    for k in range(4):
        triangles = mesh.vertices[mesh.faces[faces[nearest[:, k]]]]
        gap = np.linalg.norm(closest_point(triangles, points) - points, axis=1)
        best = np.minimum(best, gap)
    return best


def to_truth(views: Sequence[View], poses: Floats) -> tuple[Floats, Floats]:
    """Return rotation (3, 3) and translation (3,) from the scan's frame to the truth's."""
    number = [int(view.name[-8:-4]) for view in views]
    here = np.array([view.centre for view in views])
    there = np.array([-poses[k, :, :3].T @ poses[k, :, 3] for k in number])
    u, _, vt = np.linalg.svd((there - there.mean(0)).T @ (here - here.mean(0)))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return rotation, there.mean(0) - rotation @ here.mean(0)


def holds_present(
    truth: Mesh, instance: NDArray[np.int32], views: NDArray[np.int32], mesh: Mesh, scene: Path
) -> tuple[int, int, list[int]]:
    """Return the number of holds present, the total, and the ids of the missing holds.

    Holds over 5 cm that 3 photos see count. A hold is present if over half its seen area lies
    within 15 mm of the mesh.
    """
    missing: list[int] = []
    total = 0
    for record in json.loads(scene.read_text())["instances"]:
        mine = (instance == record["id"]) & (views >= 3)
        if record["class"] != "hold" or not mine.any():
            continue
        corners = truth.vertices[truth.faces[instance == record["id"]]].reshape(-1, 3)
        if np.ptp(corners, axis=0).max() < _HOLD_SIZE:
            continue
        total += 1
        points, _ = sample(truth, mine.astype(float), 300, record["id"])
        if (distance_near(points, mesh) < 0.015).mean() < 0.5:
            missing.append(record["id"])
    return total - len(missing), total, missing


def distance_near(points: Floats, mesh: Mesh) -> Floats:
    """Return the distance to the mesh's centroids near some points (fast, exact within an edge)."""
    from scipy.spatial import cKDTree

    low, high = points.min(axis=0) - 0.1, points.max(axis=0) + 0.1
    near = ((mesh.centroids >= low) & (mesh.centroids <= high)).all(axis=1)
    if not near.any():
        return np.full(len(points), np.inf)
    return np.asarray(cKDTree(mesh.centroids[near]).query(points)[0])


def compare(
    scan: ScanFolder, truth_folder: Path, frame: tuple[Path, Path] | None = None
) -> dict[str, str]:
    """Return accuracy, completeness and holds of the scan's mesh: name of each figure to its text.

    Parameters
    ----------
    frame : scan and truth whose cameras define the fit to the truth's frame; this scan's own if
        None.
    """
    data = np.load(truth_folder / "gt.npz")
    truth = Mesh(data["vertices"].astype(float), data["faces"])
    known, there = frame or (scan.root, truth_folder)
    poses = np.load(there / "gt.npz")["cam_from_world"]
    rotation, shift = to_truth(read_views(ScanFolder(known).sparse), poses)
    whole = read_mesh(scan.mesh)
    whole = replace(whole, vertices=whole.vertices @ rotation.T + shift)
    mesh = whole.without_guesses()
    points, _ = sample(mesh, np.ones(len(mesh.faces)), _SAMPLES, 1)
    off = distance(points, truth) * 1000
    seen = (data["face_views"] >= 3).astype(float)
    points, face = sample(truth, seen, _SAMPLES, 2)
    away = distance(points, mesh) * 1000
    on_hold = data["face_instance"][face] > 0
    present, total, _ = holds_present(
        truth, data["face_instance"], data["face_views"], mesh, truth_folder / "scene.json"
    )
    report = check_mesh(mesh)
    edge = report.edge_length_median * 1000
    return (
        {
            "accuracy: mesh within 8 mm of the truth": f"{_share(off < 8)} (median "
            f"{np.median(off):.1f} mm, 90 % within {np.percentile(off, 90):.1f} mm)",
            "completeness: truth seen by 3 photos or more within 10 mm": f"{_share(away < 10)} "
            f"(holds and volumes alone {_share(away[on_hold] < 10)})",
            "holds over 5 cm with over half of their seen area within 15 mm": f"{present} of {total}",
            "mesh": f"{report.faces / 1e6:.2f} M faces, {report.area:.0f} m², median edge {edge:.1f} mm",
            "problems in `mesh check`": ", ".join(report.defects) or "none",
        }
        | _gaps(mesh)
        | _guesses(whole, truth, seen)
    )


def _share(mask: NDArray[np.bool_]) -> str:
    return f"{100 * mask.mean():.1f} %"


def _gaps(mesh: Mesh) -> dict[str, str]:
    """Return the length and area of the open gaps above the floor."""
    found = {}
    for widest in _GAP_WIDTHS:
        length, area = thin_gaps(mesh, widest, _WALL_HEIGHT)
        name = f"open gaps up to {widest * 100:.0f} cm wide, over {_WALL_HEIGHT} m above the floor"
        found[name] = f"{length:.1f} m, {area:.2f} m²"
    return found


def print_table(columns: dict[str, dict[str, str]]) -> None:
    """Print the figures of `compare` for some scans, side by side."""
    print(f"| figure | {' | '.join(columns)} |\n|{'---|' * (1 + len(columns))}")
    for figure in next(iter(columns.values())):
        print(f"| {figure} | {' | '.join(column[figure] for column in columns.values())} |")


def _guesses(whole: Mesh, truth: Mesh, seen: Floats) -> dict[str, str]:
    """Return the accuracy of the guessed triangles, and the completeness with them.

    Parameters
    ----------
    whole : the mesh with its guesses, in the truth's frame.
    seen : (F,) weight of the truth's faces in the completeness.
    """
    names = ("guessed", "completeness within 10 mm, guesses counted")
    guessed = ~whole.measured
    if not guessed.any():
        return dict.fromkeys(names, "nothing")
    points, _ = sample(whole, guessed.astype(float), _SAMPLES // 10, 3)
    off = distance(points, truth) * 1000
    points, _ = sample(truth, seen, _SAMPLES, 2)
    away = distance(points, whole) * 1000
    cell = (
        f"{whole.areas[guessed].sum():.2f} m², {_share(off < 8)} within 8 mm of the truth, "
        f"{_share(off < 50)} within 50 mm"
    )
    return dict(zip(names, (cell, _share(away < 10)), strict=True))


def thin_gaps(mesh: Mesh, widest: float, above: float) -> tuple[float, float]:
    """Return length and area of the gaps whose facing borders are at most `widest` apart.

    Parameters
    ----------
    above : count only border edges higher than this (z up, floor 0).
    """
    from scipy.spatial import cKDTree

    edges = edges_of(mesh.faces)
    face, corner = np.nonzero((edges.count == 1)[edges.of_face])
    a, b, c = (mesh.vertices[mesh.faces[face, (corner + k) % 3]] for k in range(3))
    along, middle = b - a, 0.5 * (a + b)
    length = np.linalg.norm(along, axis=1)
    out = middle - c
    out -= along * ((out * along).sum(axis=1) / length**2)[:, None]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    p, q = cKDTree(middle).query_pairs(widest, output_type="ndarray").T
    across = middle[q] - middle[p]
    far = np.linalg.norm(across, axis=1)
    facing = ((out[p] * across).sum(axis=1) > 0.5 * far) & (
        (out[q] * across).sum(axis=1) < -0.5 * far
    )
    width = np.full(len(middle), np.inf)
    np.minimum.at(width, p[facing], far[facing])
    np.minimum.at(width, q[facing], far[facing])
    counts = np.isfinite(width) & (middle[:, 2] > above)
    # Halve the sums, because both sides of a gap were counted.
    return float(0.5 * length[counts].sum()), float(0.5 * (length * width)[counts].sum())


def run_measured(folder: Path) -> None:
    """Run dense and texture; print their seconds and the process's peak memory."""
    run_stages(folder, ("dense", "texture"), Settings())
    # Mapping runs in a child process.
    own, child = (
        resource.getrusage(who).ru_maxrss / 1e6
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    print(f"peak memory: {max(own, child):.2f} GB (mapping {child:.2f} GB)", flush=True)


def shade(mesh: Mesh, texture: Texture, view: View) -> tuple[Image, NDArray[np.bool_]]:
    """Return a rendering of the textured mesh, (H, W, 3) RGB, and the covered pixels."""
    face_id, depth = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
    covered = face_id >= 0
    y, x = np.nonzero(covered)
    face = face_id[covered]
    camera = view.camera
    rays = np.stack(
        [(x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, np.ones(len(x))],
        axis=1,
    )
    points = (rays * depth[covered, None] - view.cam_from_world[:, 3]) @ view.cam_from_world[:, :3]
    a, b, c = (mesh.vertices[mesh.faces[face, k]] for k in range(3))
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    wu, wv = (w * u).sum(1), (w * v).sum(1)
    det = np.maximum(uu * vv - uv * uv, 1e-30)
    s, t = np.clip((vv * wu - uv * wv) / det, 0, 1), np.clip((uu * wv - uv * wu) / det, 0, 1)
    corner = texture.uv[face].astype(float) * len(texture.image)
    at = (1 - s - t)[:, None] * corner[:, 0] + s[:, None] * corner[:, 1] + t[:, None] * corner[:, 2]
    table = np.full((*face_id.shape, 2), -10.0, dtype=np.float32)
    table[covered] = at - 0.5
    picture = cv2.remap(texture.image, table[..., 0], table[..., 1], cv2.INTER_LINEAR)
    return np.asarray(picture, dtype=np.uint8), covered


def held_out(scan: ScanFolder, every: int, within: float, folder: Path | None) -> None:
    """Print PSNR and SSIM of views held out from both mesh and texture.

    Parameters
    ----------
    every : hold out every such photo, by name.
    within : use only photos with cameras this near to the middle photo's, world units.
    folder : output of pictures, the rendering left and the photo right.
    """
    from skimage.metrics import structural_similarity

    from walltopo.reconstruct.dense.stereo import undistort

    scene = read_scene(scan.sparse)
    middle = scene.views[len(scene.views) // 2].centre
    near = [k for k, v in enumerate(scene.views) if np.linalg.norm(v.centre - middle) <= within]
    scene = scene.subset(near)
    out = list(range(every // 2, len(scene.views), every))
    rest = scene.subset([k for k in range(len(scene.views)) if k not in out])
    settings = DenseSettings()
    edge, unit = edge_and_unit(rest, settings, Scale.load(scan.scale).metric)
    mesh = sgm_mesh(
        rest, lambda name: read_grey(scan.photos / name), settings, edge, unit, Silent()
    )

    def colour(name: str) -> Image:
        return read_rgb(scan.photos / name)

    texture = make_texture(mesh, rest.views, colour, TextureSettings(), Silent())
    rows: list[tuple[float, float]] = []
    for k in out:
        photo, view = undistort(colour(scene.views[k].name), scene.views[k])
        picture, covered = shade(mesh, texture, view)
        # Undistortion leaves black beyond the photo's own border.
        covered &= undistort(np.full(photo.shape[:2], 255, np.uint8), scene.views[k])[0] == 255
        # Apply one gain per channel, because the texture cannot know a held-out photo's exposure.
        gain = (photo[covered].astype(float).mean(0) + 1) / (picture[covered].mean(0) + 1)
        even = np.clip(picture * gain, 0, 255).astype(np.uint8)
        error = (even[covered].astype(float) - photo[covered]) ** 2
        _, similar = structural_similarity(photo, even, channel_axis=2, full=True)
        psnr, ssim = 10 * np.log10(255**2 / error.mean()), float(similar[covered].mean())
        rows.append((psnr, ssim))
        print(f"  {view.name}: covered {covered.mean():.0%}, PSNR {psnr:.2f} dB, SSIM {ssim:.3f}")
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            both = np.hstack([even, photo])[..., ::-1]
            cv2.imwrite(str(folder / f"{Path(view.name).stem}.png"), both)
    mean = np.mean(rows, axis=0)
    print(
        f"held-out views, {len(out)} of {len(scene.views)}: mean PSNR {mean[0]:.2f} dB, "
        f"mean SSIM {mean[1]:.3f} where covered"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scan", type=Path)
    parser.add_argument("--photos", type=Path, help="to scan, where SCAN has no cameras yet")
    parser.add_argument(
        "--reference", nargs=2, type=Path, metavar=("SCAN", "TRUTH"), help="registered into it"
    )
    parser.add_argument("--truth", type=Path, help="folder with gt.npz and scene.json")
    parser.add_argument(
        "--update", nargs=2, type=Path, metavar=("SCAN", "TRUTH"), help="registered into SCAN"
    )
    parser.add_argument("--held-out", type=int, default=0, metavar="N")
    parser.add_argument(
        "--within", type=float, default=np.inf, metavar="M", help="of a part of the scan only"
    )
    parser.add_argument("--pictures", type=Path, help="where to put rendered held-out views")
    args = parser.parse_args()
    scan = ScanFolder(args.scan)
    if not scan.sparse.is_dir():
        reference = str(args.reference[0]) if args.reference else ""
        run_to_scale(args.photos, args.scan, SparseSettings(reference=reference))
    if not scan.mesh.is_file():
        run_measured(args.scan)
    if args.truth:
        columns = {args.truth.name: compare(scan, args.truth, args.reference)}
        if args.update:
            update, truth = args.update
            columns[truth.name] = compare(ScanFolder(update), truth, (args.scan, args.truth))
        print_table(columns)
    if args.held_out:
        held_out(scan, args.held_out, args.within, args.pictures)


if __name__ == "__main__":
    main()
