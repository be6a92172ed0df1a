"""Builds regular lattices: rotating squares and triangles, kagome triangles, hexagons."""

from dataclasses import replace

import numpy as np

from sim.core import Floats, Ints
from sim.structure.lattice import Lattice, groups, network


def quads(
    columns: int, rows: int, spacing: float, ligament_length: float, bias_angle: float
) -> Lattice:
    """Builds rotating squares: units on a square grid, joined at their four corners.

    Unit ``i + columns * j`` has its lattice point at ``(i, j) * spacing`` and its vertices in the
    order right, top, left, bottom. Units with even ``i + j`` are turned by ``-bias_angle`` (rad),
    the others by ``+bias_angle``, and scaled so that the ligaments stay horizontal and vertical.
    """
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(columns), np.arange(rows)))
    site = np.stack([i, j], axis=1) * np.float64(spacing)
    turn = np.where((i + j) % 2 == 0, -1.0, 1.0) * np.tan(bias_angle)
    half = (spacing - ligament_length) / 2
    right = half * np.stack([np.ones_like(turn), turn], axis=1)
    top = np.stack([-right[:, 1], right[:, 0]], axis=1)
    vertices: Floats = (site[:, None, :] + np.stack([right, top, -right, -top], axis=1)).reshape(
        -1, 2
    )

    unit_id = np.arange(columns * rows).reshape(rows, columns)
    horizontal = np.stack([4 * unit_id[:, :-1].ravel(), 4 * unit_id[:, 1:].ravel() + 2], axis=1)
    vertical = np.stack([4 * unit_id[:-1].ravel() + 1, 4 * unit_id[1:].ravel() + 3], axis=1)
    ligaments = np.concatenate([horizontal, vertical])
    return Lattice(
        vertices=vertices,
        unit=np.repeat(np.arange(columns * rows), 4),
        ligaments=ligaments,
        group=groups(len(vertices), ligaments),
        site=site,
        index=np.stack([i, j], axis=1),
        spacing=spacing,
        id=np.arange(columns * rows),
    )


def kagome(
    columns: int,
    rows: int,
    spacing: float,
    ligament_length: float,
    bias: float,
    cell_angle: float = np.pi / 3,
) -> Lattice:
    """Builds kagome triangles: two in each cell, joined there and to the neighbouring cells.

    A cell is spanned by ``spacing`` along x and along the direction ``cell_angle`` (rad). Its
    joints are the middles of its four sides and its centre; ligaments run through them along the
    three directions of the regular lattice. Joints of cells with even i and j are moved up by
    ``bias`` (mm), those with odd i and j down. Unit ``2 i + k + 2 columns j`` is triangle k of cell
    (i, j), the lower left one first (the authors' geometry).
    """
    across = spacing * np.array([1.0, 0.0])
    along = spacing * np.array([np.cos(cell_angle), np.sin(cell_angle)])
    inner, right, up = (
        ligament_length / 2 * np.array([[np.sqrt(0.75), 0.5], [np.sqrt(0.75), -0.5], [0.0, 1.0]])
    )
    polygons, ligaments = [], []
    unit_of = np.arange(2 * columns * rows).reshape(rows, columns, 2)
    for j, i in np.ndindex(rows, columns):
        left, below, centre, beyond, above = (
            (i + a) * across + (j + b) * along + [0.0, bias * _parity(p, q)]
            for a, b, p, q in (
                (0.0, 0.5, i, j),
                (0.5, 0.0, i, j),
                (0.5, 0.5, i, j),
                (1.0, 0.5, i + 1, j),
                (0.5, 1.0, i, j + 1),
            )
        )
        polygons += [
            np.stack([left + right, below + up, centre - inner]),
            np.stack([centre + inner, beyond - right, above - up]),
        ]
        here, other = 3 * unit_of[j, i]
        ligaments.append((here + 2, other))
        if i + 1 < columns:
            ligaments.append((other + 1, 3 * unit_of[j, i + 1, 0]))
        if j + 1 < rows:
            ligaments.append((other + 2, 3 * unit_of[j + 1, i, 0] + 1))
    j, i = np.divmod(np.arange(2 * columns * rows), 2 * columns)
    return network(polygons, np.array(ligaments), np.stack([i, j], axis=1), spacing)


def honeycomb(
    columns: int, rows: int, spacing: float, ligament_length: float, bias_angle: float = 0.0
) -> Lattice:
    """Builds rotating triangles: units on a honeycomb, joined at their three corners.

    Neighbours are ``spacing`` apart. Rows are zigzags of units along x, and unit
    ``i + columns * j`` with even ``i + j`` has its third neighbour in the row above, with odd in
    the row below. The first are turned by ``-bias_angle`` (rad), the others by ``+bias_angle``,
    and scaled so that the ligaments stay along the lines of the honeycomb.
    """
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(columns), np.arange(rows)))
    even = (i + j) % 2 == 0
    site = spacing * np.stack([np.sqrt(0.75) * i, 1.5 * j + 0.5 * even], axis=1)
    first, turn = np.where(even, np.pi / 2, -np.pi / 2), np.where(even, -bias_angle, bias_angle)
    return _regular(3, site, np.stack([i, j], axis=1), spacing, ligament_length, first, turn)


def triangular(columns: int, rows: int, spacing: float, ligament_length: float) -> Lattice:
    """Builds hexagons on a triangular lattice, joined at their six corners.

    Neighbours are ``spacing`` apart. Rows are along x, and every other one, from the second on, is
    shifted by half a spacing. Unit ``i + columns * j`` is the i-th of row j.
    """
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(columns), np.arange(rows)))
    site = spacing * np.stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j], axis=1)
    straight = np.zeros(len(i))
    index = np.stack([i, j], axis=1)
    return _regular(6, site, index, spacing, ligament_length, straight, straight)


def _regular(
    corners: int,
    site: Floats,
    index: Ints,
    spacing: float,
    ligament_length: float,
    first: Floats,
    turn: Floats,
) -> Lattice:
    """Builds regular polygons on sites, a corner towards each neighbour ``spacing`` away.

    The directions of a unit's neighbours are ``first`` (n_units,) and on by equal angles; ``turn``
    (n_units,) is that of the polygons, opposite in neighbours (rad).
    """
    from scipy.spatial import cKDTree

    towards = first[:, None] + 2 * np.pi / corners * np.arange(corners)
    reach = (spacing - ligament_length) / 2 / np.cos(turn)
    angle = towards + turn[:, None]
    out = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    polygons = list(site[:, None] + reach[:, None, None] * out)
    pairs = cKDTree(site).query_pairs(1.01 * spacing, output_type="ndarray")
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    x, y = (site[pairs[:, 1]] - site[pairs[:, 0]]).T
    along = np.stack([np.arctan2(y, x), np.arctan2(-y, -x)], axis=1)
    corner = np.cos(towards[pairs] - along[:, :, None]).argmax(axis=2)
    return replace(network(polygons, corners * pairs + corner, index, spacing), site=site)


def _parity(i: int, j: int) -> float:
    """Returns 1 where both numbers are even, -1 where both are odd, else 0."""
    return {(0, 0): 1.0, (1, 1): -1.0}.get((i % 2, j % 2), 0.0)
