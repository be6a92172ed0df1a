"""Fits of patches are the same to the bit, whichever of their loops come from the cache."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TRACK = """
import hashlib, sys
from pathlib import Path
import numpy as np
from benchmarks.tracking import speed, wild_clips
from benchmarks.tracking.clip_scripts import RATE, ClipScript
from pipeline.tracking.motion import track_video

view, film = speed._LARGE, ("ffv1", "gray", 0)
count = np.arange(4)
times, stamps = count / 120.0, count / RATE
script = ClipScript(grid=speed._UNITS, view=view, times=times, stamps=stamps, film=film)
clip = wild_clips.film(script, Path(sys.argv[1]))
track = track_video(iter(clip.frames), clip.specimen, clip.scale)
print(hashlib.sha256(track.displacement.tobytes()).hexdigest())
"""


def test_a_track_is_the_same_by_cached_loops(tmp_path: Path) -> None:
    cache = tmp_path / "loops"

    def tracked() -> str:
        command = [sys.executable, "-c", "import pipeline\n" + TRACK, str(tmp_path / "clip.mkv")]
        environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
        done = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout

    new = tracked()
    assert len(new) > 60
    assert tracked() == new, "all from the cache"
    for anew in ("patch_correlation", "normal_equations"):
        for folder in cache.glob(f"pipeline.tracking.fit.{anew}-*"):
            shutil.rmtree(folder)
        assert tracked() == new, f"{anew} compiled, the others from the cache"
