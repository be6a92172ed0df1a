"""Follows points over whole pictures by pyvale; runs alone, in an environment that has it.

``python pyvale_points.py PICTURES.npz POINTS.npz`` reads pictures ``before_K``, ``after_K`` and a
place ``seed_K`` (2,) that moves little between them; it writes ``points_K`` (n, 4), places before
and after, px, none where pyvale gives up.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from pyvale import dic  # type: ignore[import-not-found]

_STEP, _SUBSET, _MARGIN = 4, 21, 12
"""Distance of the points, side of the subsets, and rim of the pictures that is left out, px."""


def track_points(before: np.ndarray, after: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Returns points and where they are afterwards (n, 4), px."""
    inner = np.zeros(before.shape, bool)
    inner[_MARGIN:-_MARGIN, _MARGIN:-_MARGIN] = True
    with tempfile.TemporaryDirectory() as folder:
        try:
            dic.calculate_2d(
                reference=before,
                deformed=after[None],
                roi_mask=inner,
                seed=np.round(seed).astype(int).tolist(),
                subset_size=_SUBSET,
                subset_step=_STEP,
                num_threads=1,
                output_basepath=folder,
                print_level=0,
            )
        except RuntimeError as error:
            sys.stderr.write(f"pyvale: {str(error).splitlines()[0]}\n")
            return np.empty((0, 4))
        table = next(Path(folder).glob("*.csv"))
        x, y, u, v = np.genfromtxt(table, delimiter=",", skip_header=1, usecols=range(4)).T
    return np.stack([x, y, x + u, y + v], axis=1)


if __name__ == "__main__":
    given = np.load(sys.argv[1])
    pairs = range(len(given.files) // 3)
    names = ("before", "after", "seed")
    made = {f"points_{k}": track_points(*(given[f"{one}_{k}"] for one in names)) for k in pairs}
    np.savez(sys.argv[2], allow_pickle=False, **made)
