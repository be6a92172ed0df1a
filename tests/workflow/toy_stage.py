"""A stand-in for every stage and page of a copied repository: writes the outputs, empty."""

import argparse
import os
import time
from pathlib import Path

REPORT = (
    *("index.html", "facts.json", "fig2.pdf", "fig2.svg", "fig2.png"),
    *("design.csv", "facts.csv", "loss_history.csv"),
)

BESIDE = {"film": ("{}.yaml", "{}_truth.nc"), "track": ("{}.csv",)}
"""What a stage writes beside its output, by the name that this has."""


def work(args: argparse.Namespace) -> None:
    """As a stage works, for a while."""
    time.sleep(float(os.environ.get("STAGE_SECONDS", "0")))
    _write(args)


def _write(args: argparse.Namespace) -> None:
    if out := getattr(args, "out", None):
        out.write_text(str(args))
        for name in BESIDE.get(Path(__file__).stem, ()):
            out.with_name(name.format(out.stem)).write_text("")
    elif folder := getattr(args, "out_dir", None):
        folder.mkdir(parents=True, exist_ok=True)
        for name in REPORT:
            (folder / name).write_text("")


def main() -> None:
    """As a page is made, at once: it has options of its own, and the first look has no log."""
    parser = argparse.ArgumentParser()
    for name in ("--out", "--out-dir", "--log"):
        parser.add_argument(name, type=Path)
    args, _ = parser.parse_known_args()
    _write(args)
    if args.log:
        args.log.write_text("done\n")


if __name__ == "__main__":
    main()
