"""Find the triangles that one view sees, and the masks that cover them. Kernels for numba.

A sample is visible if the ray from the camera to it hits nothing before it. The sample of a
triangle is its centroid; a triangle that is large in the photo gets the centroids of its regular
subdivision. Instead of casting rays, the kernels sort samples into the cells of an image grid, and
every triangle removes the samples behind it (an irregular z-buffer: Johnson et al., TOG 2005). The
result is exact in float64 for every camera model, because straight lines stay straight in
undistorted coordinates.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from walltopo.geometry.kernels import kernel
from walltopo.geometry.screen import distort

# A surface hides a sample only if it is nearer by more than this share of the distance. The
# tolerance covers rounding of duplicate triangles and the float32 rays of the reference.
HIT_TOLERANCE = 1e-5
MAX_GRID = 512


@kernel
def cull_blocks(spheres: Any, pose: Any, bounds: Any, limit: Any) -> Any:
    """Return the indices of blocks that may be in the photo and within `limit` of the camera."""
    kept = np.zeros(len(spheres), dtype=np.int32)
    count = 0
    planes = np.zeros((4, 3))  # normals pointing inwards, camera frame
    for side in range(4):
        slope = bounds[side]
        length = np.sqrt(1.0 + slope * slope)
        sign = 1.0 if side % 2 == 0 else -1.0
        planes[side, side // 2] = sign / length
        planes[side, 2] = -sign * slope / length
    for b in range(len(spheres)):
        x, y, z = _to_camera(spheres[b, 0], spheres[b, 1], spheres[b, 2], pose)
        r = spheres[b, 3]
        inside = z + r > 0 and np.sqrt(x * x + y * y + z * z) - r <= limit
        for side in range(4):
            if inside and abs(bounds[side]) < 1e6:
                inside = planes[side, 0] * x + planes[side, 1] * y + planes[side, 2] * z >= -r
        if inside:
            kept[count] = b
            count += 1
    return kept[:count]


@kernel
def _to_camera(px: Any, py: Any, pz: Any, pose: Any) -> Any:
    # `pose` is cam_from_world as a flat tuple, because numba keeps tuples in registers.
    x = pose[0] * px + pose[1] * py + pose[2] * pz + pose[3]
    y = pose[4] * px + pose[5] * py + pose[6] * pz + pose[7]
    z = pose[8] * px + pose[9] * py + pose[10] * pz + pose[11]
    return x, y, z


@kernel
def _pixel(u: Any, v: Any, lens: Any, reach: Any, size: Any, labels: Any) -> Any:
    """Return the label image's row and column in direction (u, v, 1); row -1 = outside the photo.

    `size` contains the photo's width and height, and the label image's pixels per photo pixel.
    """
    if u * u + v * v >= reach * reach:
        return -1, -1
    x, y = distort(u, v, lens)
    if not (x >= 0 and y >= 0 and x < size[0] and y < size[1]):
        return -1, -1
    col = min(int(x * size[2]), labels.shape[1] - 1)
    row = min(int(y * size[3]), labels.shape[0] - 1)
    return row, col


@kernel
def _splits(longest: Any, z: Any, lens: Any, sample_px: Any, max_splits: Any) -> Any:
    """Return the number of parts into which each edge is divided; 1 = the centroid alone."""
    if max_splits <= 1:
        return 1
    return min(max_splits, max(1, int(np.ceil(longest * lens[1] / z / sample_px))))


@kernel
def _sample(corners: Any, k: Any, s: Any) -> Any:
    """Return x/z, y/z and z of the k-th of s*s sub-triangle centroids; only z if z <= 0."""
    # Row i of the subdivision has 2 (s - i) - 1 sub-triangles, alternately upright and inverted.
    i = 0
    while k >= 2 * (s - i) - 1:
        k -= 2 * (s - i) - 1
        i += 1
    j = k // 2
    shift = 1.0 / 3.0 if k % 2 == 0 else 2.0 / 3.0
    wb, wc = (i + shift) / s, (j + shift) / s
    wa = 1.0 - wb - wc
    ax, ay, az, bx, by, bz, cx, cy, cz = corners
    z = wa * az + wb * bz + wc * cz
    if z <= 0:
        return 0.0, 0.0, z
    return (wa * ax + wb * bx + wc * cx) / z, (wa * ay + wb * by + wc * cy) / z, z


@kernel
def mark_candidates(
    blocks: Any,
    starts: Any,
    spheres: Any,
    vertices: Any,
    faces: Any,
    centroids: Any,
    longest: Any,
    pose: Any,
    lens: Any,
    reach: Any,
    size: Any,
    labels: Any,
    limit: Any,
    sample_px: Any,
    max_splits: Any,
    windows: Any,
    cell: Any,
    mark: Any,
) -> None:
    """Set `mark` for faces with a sample under some mask, hidden or not.

    `windows` is the table of `mask_windows`. Blocks away from all masks are skipped if the lens has
    no distortion; otherwise the block's outline in the photo is unknown.
    """
    rows, cols = windows.shape[0] - 1, windows.shape[1] - 1
    for b in blocks:
        x, y, z = _to_camera(spheres[b, 0], spheres[b, 1], spheres[b, 2], pose)
        if lens[0] == 0.0 and z > 1.01 * spheres[b, 3]:
            u0, u1, v0, v1 = _outline(x, y, z, spheres[b, 3])
            u0, u1 = (u0 * lens[1] + lens[3]) / cell, (u1 * lens[1] + lens[3]) / cell
            v0, v1 = (v0 * lens[2] + lens[4]) / cell, (v1 * lens[2] + lens[4]) / cell
            c0, c1 = _cell_range(u0, u1, 0.0, 1.0, cols)
            r0, r1 = _cell_range(v0, v1, 0.0, 1.0, rows)
            if c1 < c0 or r1 < r0 or _sum(windows, r0, r1, c0, c1) == 0:
                continue
        for f in range(starts[b], starts[b + 1]):
            if mark[f]:
                continue
            x, y, z = _to_camera(centroids[f, 0], centroids[f, 1], centroids[f, 2], pose)
            if not (z > 0 and x * x + y * y + z * z <= limit * limit):
                continue
            s = _splits(longest[f], z, lens, sample_px, max_splits)
            if s == 1:
                # Never write False: another thread may have written True in the meantime.
                row, col = _pixel(x / z, y / z, lens, reach, size, labels)
                if row >= 0 and labels[row, col] >= 0:
                    mark[f] = True
                continue
            corners = _corners(vertices, faces, f, pose)
            for k in range(s * s):
                u, v, z = _sample(corners, k, s)
                if z > 0:
                    row, col = _pixel(u, v, lens, reach, size, labels)
                    if row >= 0 and labels[row, col] >= 0:
                        mark[f] = True
                        break


@kernel
def _corners(vertices: Any, faces: Any, f: Any, pose: Any) -> Any:
    a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
    ax, ay, az = _to_camera(vertices[a, 0], vertices[a, 1], vertices[a, 2], pose)
    bx, by, bz = _to_camera(vertices[b, 0], vertices[b, 1], vertices[b, 2], pose)
    cx, cy, cz = _to_camera(vertices[c, 0], vertices[c, 1], vertices[c, 2], pose)
    return ax, ay, az, bx, by, bz, cx, cy, cz


@kernel
def place_samples(
    blocks: Any,
    block_starts: Any,
    candidates: Any,
    vertices: Any,
    faces: Any,
    centroids: Any,
    longest: Any,
    pose: Any,
    lens: Any,
    reach: Any,
    size: Any,
    labels: Any,
    distance: Any,
    limit: Any,
    sample_px: Any,
    max_splits: Any,
    where: Any,
    owner: Any,
    label: Any,
    border: Any,
) -> Any:
    """Write the samples of candidate faces that lie in the photo into the buffers.

    Parameters
    ----------
    block_starts : (B + 1,), first of each block's candidates in `candidates`.
    labels, distance : the label image, and distances to mask borders, see `stamp_borders`.
    where : (n, 3) float64 buffer for u, v and 1/z; owner : the candidate's number; label and
        border : the values of both images at the sample.

    Returns
    -------
    The number of samples. If it exceeds the buffers, call again with larger ones.
    """
    count = 0
    for b in blocks:
        for c in range(block_starts[b], block_starts[b + 1]):
            f = candidates[c]
            x, y, z = _to_camera(centroids[f, 0], centroids[f, 1], centroids[f, 2], pose)
            if not (z > 0 and x * x + y * y + z * z <= limit * limit):
                continue
            s = _splits(longest[f], z, lens, sample_px, max_splits)
            if s == 1:
                row, col = _pixel(x / z, y / z, lens, reach, size, labels)
                if row >= 0:
                    if count < len(owner):
                        where[count, 0], where[count, 1] = x / z, y / z
                        where[count, 2] = 1.0 / z
                        owner[count], label[count] = c, labels[row, col]
                        border[count] = distance[row, col]
                    count += 1
                continue
            corners = _corners(vertices, faces, f, pose)
            for k in range(s * s):
                u, v, z = _sample(corners, k, s)
                if z > 0:
                    row, col = _pixel(u, v, lens, reach, size, labels)
                    if row >= 0:
                        if count < len(owner):
                            where[count, 0], where[count, 1], where[count, 2] = u, v, 1.0 / z
                            owner[count], label[count] = c, labels[row, col]
                            border[count] = distance[row, col]
                        count += 1
    return count


@kernel
def _grid(where: Any, focal: Any) -> Any:
    """Sort samples into square cells of at least 4 px: u0, v0, 1/cell, shape, starts, order."""
    u0, v0, u1, v1 = np.inf, np.inf, -np.inf, -np.inf
    for k in range(len(where)):
        u0, u1 = min(u0, where[k, 0]), max(u1, where[k, 0])
        v0, v1 = min(v0, where[k, 1]), max(v1, where[k, 1])
    cell = max(4.0 / focal, max(u1 - u0, v1 - v0) / MAX_GRID)
    cols, rows = int((u1 - u0) / cell) + 1, int((v1 - v0) / cell) + 1
    starts = np.zeros(cols * rows + 1, dtype=np.int32)
    home = np.zeros(len(where), dtype=np.int32)
    for k in range(len(where)):
        col = min(int((where[k, 0] - u0) / cell), cols - 1)
        row = min(int((where[k, 1] - v0) / cell), rows - 1)
        home[k] = row * cols + col
        starts[home[k] + 1] += 1
    for k in range(cols * rows):
        starts[k + 1] += starts[k]
    order = np.zeros(len(where), dtype=np.int32)
    place = starts[:-1].copy()
    for k in range(len(where)):
        order[place[home[k]]] = k
        place[home[k]] += 1
    return u0, v0, 1.0 / cell, cols, rows, starts, order


@kernel
def _count_table(starts: Any, cols: Any, rows: Any) -> Any:
    """Return the summed-area table of the number of samples: (rows + 1, cols + 1) int32."""
    table = np.zeros((rows + 1, cols + 1), dtype=np.int32)
    for row in range(rows):
        along = 0
        for col in range(cols):
            along += starts[row * cols + col + 1] - starts[row * cols + col]
            table[row + 1, col + 1] = table[row, col + 1] + along
    return table


@kernel
def _cell_range(low: Any, high: Any, origin: Any, per_cell: Any, count: Any) -> Any:
    """Return the first and last cell that an interval touches; last < first if none."""
    first, last = (low - origin) * per_cell, (high - origin) * per_cell
    if not (last >= 0 and first < count):
        return 1, 0
    return int(max(first, 0.0)), int(min(last, count - 1.0))


@kernel
def _outline(x: Any, y: Any, z: Any, r: Any) -> Any:
    """Return the bounds of x/z and y/z over a ball in front of the camera (z > r)."""
    near, far = z - r, z + r
    left, right, top, bottom = x - r, x + r, y - r, y + r
    return (
        left / (near if left < 0 else far),
        right / (far if right < 0 else near),
        top / (near if top < 0 else far),
        bottom / (far if bottom < 0 else near),
    )


@kernel
def _sum(table: Any, r0: Any, r1: Any, c0: Any, c1: Any) -> Any:
    """Return the sum over rows r0..r1 and columns c0..c1, inclusive, of a summed-area table."""
    return table[r1 + 1, c1 + 1] - table[r0, c1 + 1] - table[r1 + 1, c0] + table[r0, c0]


@kernel
def find_hidden(
    blocks: Any,
    starts: Any,
    vertex_starts: Any,
    spheres: Any,
    vertices: Any,
    faces: Any,
    candidate_of: Any,
    pose: Any,
    focal: Any,
    where: Any,
    owner: Any,
) -> Any:
    """Return which samples another triangle hides.

    Parameters
    ----------
    candidate_of : (F,) int32, candidate number of each face, -1 = none.

    Returns
    -------
    (n,) bool, whether each sample is hidden.
    """
    hidden = np.zeros(len(where), dtype=np.bool_)
    u0, v0, per_cell, cols, rows, cell_starts, order = _grid(where, focal)
    table = _count_table(cell_starts, cols, rows)
    us, vs, limits = np.zeros(len(order)), np.zeros(len(order)), np.zeros(len(order))
    owners = np.zeros(len(order), dtype=np.int32)
    max_vertices = 0
    for k in range(len(order)):
        us[k], vs[k], owners[k] = where[order[k], 0], where[order[k], 1], owner[order[k]]
        # A triangle hides a sample if its 1/z exceeds the limit. Hidden samples get limit inf.
        limits[k] = where[order[k], 2] * (1.0 + HIT_TOLERANCE)
    for b in blocks:
        max_vertices = max(max_vertices, vertex_starts[b + 1] - vertex_starts[b])
    screen = np.zeros((max_vertices, 3))
    cells = np.zeros((max_vertices, 2), dtype=np.int32)
    for b in blocks:
        x, y, z = _to_camera(spheres[b, 0], spheres[b, 1], spheres[b, 2], pose)
        r = spheres[b, 3]
        if z > 1.01 * r:
            left, right, top, bottom = _outline(x, y, z, r)
            c0, c1 = _cell_range(left, right, u0, per_cell, cols)
            r0, r1 = _cell_range(top, bottom, v0, per_cell, rows)
            if c1 < c0 or r1 < r0 or _sum(table, r0, r1, c0, c1) == 0:
                continue
        base = vertex_starts[b]
        for k in range(vertex_starts[b + 1] - base):
            x, y, z = _to_camera(
                vertices[base + k, 0], vertices[base + k, 1], vertices[base + k, 2], pose
            )
            inverse = 1.0 / z if z > 0 else 0.0
            screen[k, 0], screen[k, 1], screen[k, 2] = x * inverse, y * inverse, inverse
            # One cell beyond the grid on each side stands for everything outside the grid.
            cells[k, 0] = int(np.floor(min(max((x * inverse - u0) * per_cell, -1.0), cols)))
            cells[k, 1] = int(np.floor(min(max((y * inverse - v0) * per_cell, -1.0), rows)))
        for f in range(starts[b], starts[b + 1]):
            first, second, third = faces[f, 0] - base, faces[f, 1] - base, faces[f, 2] - base
            az, bz, cz = screen[first, 2], screen[second, 2], screen[third, 2]
            if az > 0 and bz > 0 and cz > 0:
                c0 = max(min(cells[first, 0], cells[second, 0], cells[third, 0]), 0)
                c1 = min(max(cells[first, 0], cells[second, 0], cells[third, 0]), cols - 1)
                r0 = max(min(cells[first, 1], cells[second, 1], cells[third, 1]), 0)
                r1 = min(max(cells[first, 1], cells[second, 1], cells[third, 1]), rows - 1)
                if c1 < c0:
                    continue
                mine, nearest = candidate_of[f], max(az, bz, cz)
                ready = False
                for row in range(r0, r1 + 1):
                    for k in range(cell_starts[row * cols + c0], cell_starts[row * cols + c1 + 1]):
                        if limits[k] >= nearest or owners[k] == mine:
                            continue
                        if not ready:
                            ready = True
                            ax, ay = screen[first, 0], screen[first, 1]
                            bx, by = screen[second, 0] - ax, screen[second, 1] - ay
                            cx, cy = screen[third, 0] - ax, screen[third, 1] - ay
                            # Weights of b and c, and their terms of 1/z, are linear in the offset
                            # from a; they are NaN or infinite on a triangle seen edge-on.
                            twice = bx * cy - by * cx
                            ub, vb, uc, vc = cy / twice, -cx / twice, -by / twice, bx / twice
                            zb, zc = bz - az, cz - az
                        dx, dy = us[k] - ax, vs[k] - ay
                        wb, wc = ub * dx + vb * dy, uc * dx + vc * dy
                        if wb < 0 or wc < 0 or wb + wc > 1:
                            continue
                        if az + wb * zb + wc * zc > limits[k]:
                            limits[k] = np.inf
            elif az > 0 or bz > 0 or cz > 0:
                _hide_behind_crossing(
                    _corners(vertices, faces, f, pose),
                    candidate_of[f],
                    us,
                    vs,
                    limits,
                    owners,
                )
    for k in range(len(order)):
        hidden[order[k]] = limits[k] == np.inf
    return hidden


@kernel
def _hide_behind_crossing(
    corners: Any, mine: Any, us: Any, vs: Any, limits: Any, owners: Any
) -> None:
    """Hide the samples behind a triangle that extends behind the camera (few do)."""
    ax, ay, az, bx, by, bz, cx, cy, cz = corners
    # The ray d = (u, v, 1) meets the triangle if d·(B x C), d·(C x A) and d·(A x B) have the sign
    # of A·(B x C). Their sum divided by A·(B x C) is 1/z.
    px, py, pz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    qx, qy, qz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
    rx, ry, rz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    volume = ax * px + ay * py + az * pz
    if volume == 0.0:
        return
    for k in range(len(us)):
        if owners[k] == mine:
            continue
        u, v = us[k], vs[k]
        ea = (u * px + v * py + pz) / volume
        eb = (u * qx + v * qy + qz) / volume
        ec = (u * rx + v * ry + rz) / volume
        if ea >= 0 and eb >= 0 and ec >= 0 and ea + eb + ec > limits[k]:
            limits[k] = np.inf


@kernel
def sum_samples(owner: Any, label: Any, border: Any, hidden: Any) -> Any:
    """Sum the visible samples of each face by label, as shares of the face's visible samples.

    Returns
    -------
    face (candidate number), label (< 0 = no mask), share, border (mean) : (n,) int32, int32,
    float32, float32.
    """
    n = len(owner)
    face, kind = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
    share, margin = np.zeros(n, dtype=np.float32), np.zeros(n, dtype=np.float32)
    count, start = 0, 0
    while start < n:
        end, seen = start, 0
        while end < n and owner[end] == owner[start]:
            seen += not hidden[end]
            end += 1
        first = count
        for k in range(start, end):
            if hidden[k]:
                continue
            slot = first
            while slot < count and kind[slot] != label[k]:
                slot += 1
            if slot == count:
                face[slot], kind[slot] = owner[start], label[k]
                count += 1
            share[slot] += np.float32(1.0 / seen)
            margin[slot] += np.float32(border[k] / seen)
        start = end
    for slot in range(count):
        margin[slot] /= share[slot]
    return face[:count].copy(), kind[:count].copy(), share[:count].copy(), margin[:count].copy()


@kernel
def distances(centroids: Any, candidates: Any, face: Any, centre: Any) -> Any:
    """Return (n,) float64 distances from a point to the centroids of candidates number `face`."""
    found = np.zeros(len(face))
    for k in range(len(face)):
        f = candidates[face[k]]
        x, y, z = (
            centroids[f, 0] - centre[0],
            centroids[f, 1] - centre[1],
            centroids[f, 2] - centre[2],
        )
        found[k] = np.sqrt(x * x + y * y + z * z)
    return found
