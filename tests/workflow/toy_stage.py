"""A stand-in for every stage of a copied repository: takes any options and writes the outputs."""

import os
import sys
import time
from pathlib import Path

REPORT = (
    *("index.html", "facts.json", "fig2.pdf", "fig2.svg", "fig2.png"),
    *("design.csv", "facts.csv", "loss_history.csv"),
)

BESIDE = {"virtual_lab": ("{}.yaml", "{}_truth.nc"), "track": ("{}.csv",)}
"""What a stage writes beside its output, by the name that this has."""


def main(words: list[str]) -> None:
    options = {word: words[at + 1] for at, word in enumerate(words) if word.startswith("--")}
    time.sleep(float(os.environ.get("STAGE_SECONDS", "0")))
    if "--out" in options:
        out = Path(options["--out"])
        out.write_text(" ".join(words))
        for name in BESIDE.get(Path(__file__).stem, ()):
            out.with_name(name.format(out.stem)).write_text("")
    if "--out-dir" in options:
        folder = Path(options["--out-dir"])
        for name in REPORT:
            (folder / name).write_text("")
    Path(options["--log"]).write_text("done\n")


if __name__ == "__main__":
    main(sys.argv[1:])
