"""A stand-in for every stage of a copied repository: takes any options and writes the outputs."""

import os
import sys
import time
from pathlib import Path


def main(words: list[str]) -> None:
    options = {word: words[at + 1] for at, word in enumerate(words) if word.startswith("--")}
    time.sleep(float(os.environ.get("STAGE_SECONDS", "0")))
    if "--out" in options:
        Path(options["--out"]).write_text(" ".join(words))
    if "--out-dir" in options:
        folder = Path(options["--out-dir"])
        figures = (f"fig2{suffix}" for suffix in (".pdf", ".svg", ".png"))
        for name in ("index.html", "facts.json", *figures):
            (folder / name).write_text("")
    Path(options["--log"]).write_text("done\n")


if __name__ == "__main__":
    main(sys.argv[1:])
