"""Which problems are learnt from, and which measure: no near-twin stands on both sides."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from walltopo_lab.train.grades.board import CELLS, Problem

Ints = npt.NDArray[np.int64]
_ROWS = 500
_ALIKE = 0.7  # of the holds of two problems are in both (Jaccard): they count as one


def presence(problems: tuple[Problem, ...]) -> csr_matrix:
    """(N, CELLS) 1 where a problem has a hold."""
    rows = np.repeat(np.arange(len(problems)), [len(p.cells) for p in problems])
    columns = np.concatenate([p.cells for p in problems])
    return csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(problems), CELLS))


def groups_of(problems: tuple[Problem, ...]) -> Ints:
    """(N,) group of each problem; problems that share most holds, also by way of others, share one.

    The data has neither setter nor year: this is the split that it allows.
    """
    holds = presence(problems)
    count = np.asarray(holds.sum(axis=1)).ravel()
    pairs = []
    for begin in range(0, len(problems), _ROWS):  # all pairs at once would fill the memory
        both = (holds[begin : begin + _ROWS] @ holds.T).tocoo()
        row, column = both.row.astype(np.int64) + begin, both.col.astype(np.int64)
        alike = both.data >= _ALIKE * (count[row] + count[column] - both.data)
        pairs.append(np.stack([row[alike], column[alike]]))
    rows, columns = np.concatenate(pairs, axis=1)
    shape = (len(problems), len(problems))
    graph = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=shape)
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def parts_of(groups: Ints, shares: tuple[float, ...], seed: int) -> Ints:
    """(N,) part of each problem, whole groups at random, the largest first into the first part."""
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
