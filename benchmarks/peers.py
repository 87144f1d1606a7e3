# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Other programs in Python that answer the same question, or a neighboring one.

Each takes one thread, as it comes. A program that is not installed raises ``ImportError``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from benchmarks.points import FloatArray, Points
from topo_region_seg.params import Params

CHUNK = 4_000_000  # pairs whose features are compared at a time, so that the lists fit into memory


@dataclass(frozen=True)
class Edges:
    """All edges of the graph at the largest scale: point ids (M, 2) and lengths (M,), metres."""

    n: int
    pairs: npt.NDArray[np.integer]
    lengths: FloatArray

    def matrix(self) -> coo_matrix:
        """Return the sparse matrix of lengths."""
        return coo_matrix((self.lengths, self.pairs.T), shape=(self.n, self.n))

    def partition(self, scale: float) -> npt.NDArray[np.int32]:
        """Return the component of each point (N,) in the graph of the edges up to `scale` (m)."""
        pairs = self.pairs[self.lengths <= scale]
        graph = coo_matrix((np.ones(len(pairs), np.int8), pairs.T), shape=(self.n, self.n))
        return connected_components(graph, directed=False)[1]


@dataclass(frozen=True)
class Persistence:
    """Finite deaths in any order, and the number of components at each scale."""

    deaths: FloatArray
    counts: npt.NDArray[np.int64]


def all_edges(points: Points, params: Params) -> Edges:
    """List all pairs within reach and drop those that are not alike."""
    pairs = cKDTree(points.xyz).query_pairs(params.max_radius, output_type="ndarray")
    chunks = (_alike(points, pairs[i : i + CHUNK], params) for i in range(0, len(pairs), CHUNK))
    pairs = np.concatenate([np.empty((0, 2), pairs.dtype), *chunks])
    step = points.xyz[pairs[:, 0]] - points.xyz[pairs[:, 1]]
    return Edges(len(points), pairs, np.sqrt(np.einsum("ij,ij->i", step, step)))


def scipy_program(points: Points, params: Params) -> Persistence:
    """Find deaths and counts with SciPy: pairs, mask, minimum spanning tree, components at every scale."""
    edges = all_edges(points, params)
    shortest = minimum_spanning_tree(edges.matrix().tocsr())
    scales = scales_of(params)
    counts = []
    for scale in scales:
        keep = edges.lengths <= scale
        graph = coo_matrix((keep[keep], edges.pairs[keep].T), shape=(edges.n, edges.n))
        counts.append(connected_components(graph, directed=False)[0])
    return Persistence(shortest.data, np.array(counts))


def ripser_deaths(edges: Edges) -> FloatArray:
    """Find the finite H0 deaths with ripser.py, in single precision."""
    from ripser import ripser

    bars = ripser(edges.matrix().tocsr(), distance_matrix=True, maxdim=0)["dgms"][0]
    return bars[np.isfinite(bars[:, 1]), 1].astype(np.float64)


def gudhi_deaths(edges: Edges) -> FloatArray:
    """Find the finite H0 deaths with GUDHI's simplex tree."""
    import gudhi

    tree = gudhi.SimplexTree()
    tree.insert_batch(np.arange(edges.n)[None, :], np.zeros(edges.n))
    tree.insert_batch(edges.pairs.T.copy(), edges.lengths)
    tree.compute_persistence(homology_coeff_field=2, min_persistence=-1.0, persistence_dim_max=False)
    bars = tree.persistence_intervals_in_dimension(0)
    return bars[np.isfinite(bars[:, 1]), 1]


def quitefastmst_lengths(xyz: FloatArray) -> FloatArray:
    """Find the lengths (N - 1,) of the Euclidean minimum spanning tree of positions (N, 3) with quitefastmst."""
    import quitefastmst

    lengths: FloatArray = quitefastmst.mst_euclid(xyz)[0]
    return lengths


def hdbscan_labels(points: Points, params: Params) -> npt.NDArray[np.integer]:
    """Cluster the positions with scikit-learn's HDBSCAN: another question, for scale."""
    from sklearn.cluster import HDBSCAN

    clusters = HDBSCAN(min_cluster_size=params.min_region_size, n_jobs=1, copy=False).fit(points.xyz)
    return np.asarray(clusters.labels_)


def open3d_clusters(points: Points, params: Params) -> npt.NDArray[np.integer]:
    """Cluster the positions with Open3D's DBSCAN, every point a core point: one scale, without colors and normals."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.xyz))
    return np.asarray(cloud.cluster_dbscan(eps=params.max_radius, min_points=1))


def scales_of(params: Params) -> FloatArray:
    """Return the scales of the filtration, metres."""
    scales = np.arange(1, params.filtration_steps + 1) * params.max_radius / params.filtration_steps
    scales[-1] = params.max_radius
    return scales


def _alike(points: Points, pairs: npt.NDArray[np.integer], params: Params) -> npt.NDArray[np.integer]:
    i, j = pairs.T
    keep = np.ones(len(pairs), bool)
    if params.features != "normals":
        color = points.lab[i] - points.lab[j]
        keep &= np.einsum("ij,ij->i", color, color) <= params.color_threshold**2
    if params.features != "color":
        cosine = np.einsum("ij,ij->i", points.normals[i], points.normals[j])
        keep &= cosine >= np.cos(np.radians(params.angle_threshold))
    return pairs[keep]
