"""Split into training and evaluation problems, with no near-duplicate on both sides."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from walltopo_lab.train.grades.board import CELLS, Problem

Ints = npt.NDArray[np.int64]
_ROWS = 500
_ALIKE = 0.7  # Jaccard index of two problems' holds from which they count as one


def presence(problems: tuple[Problem, ...]) -> csr_matrix:
    """Return (N, CELLS) 1 where a problem has a hold."""
    rows = np.repeat(np.arange(len(problems)), [len(p.cells) for p in problems])
    columns = np.concatenate([p.cells for p in problems])
    return csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(problems), CELLS))


def groups_of(problems: tuple[Problem, ...]) -> Ints:
    """Return (N,) the group of each problem: problems that share most holds, also transitively.

    The data has neither setter nor year, so no stricter split is possible.
    """
    holds = presence(problems)
    count = np.asarray(holds.sum(axis=1)).ravel()
    pairs = []
    for begin in range(0, len(problems), _ROWS):  # all pairs at once would exceed the memory
        both = (holds[begin : begin + _ROWS] @ holds.T).tocoo()
        row, column = both.row.astype(np.int64) + begin, both.col.astype(np.int64)
        alike = both.data >= _ALIKE * (count[row] + count[column] - both.data)
        pairs.append(np.stack([row[alike], column[alike]]))
    rows, columns = np.concatenate(pairs, axis=1)
    shape = (len(problems), len(problems))
    graph = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=shape)
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def parts_of(groups: Ints, shares: tuple[float, ...], seed: int) -> Ints:
    """Return (N,) part of each problem, in random whole groups, the largest first in part 0."""
    rng = np.random.default_rng(seed)
    names, sizes = np.unique(groups, return_counts=True)
    order = rng.permutation(len(names))
    order = order[np.argsort(sizes[order] <= len(groups) / 50, kind="stable")]
    ends = np.cumsum(np.array(shares) / sum(shares)) * len(groups)
    reached = np.cumsum(sizes[order]) - sizes[order] / 2
    part = np.minimum(np.searchsorted(ends, reached), len(shares) - 1)
    of_group = np.zeros(int(groups.max()) + 1, np.int64)
    of_group[names[order]] = part
    return of_group[groups]
