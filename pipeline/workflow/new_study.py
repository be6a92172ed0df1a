"""Makes a study of one's own: a commented problem file that builds as it is."""

import argparse
import json
import logging
import re
import shutil
from pathlib import Path
from string import Template
from textwrap import indent

from pipeline import problem
from pipeline.problem.outlines import read_outlines
from pipeline.runtime import BUILD, WORK, UserError, found_in, write_folder_atomically
from pipeline.workflow.studies import check_new

LOG = logging.getLogger(__name__)

TEMPLATES = Path(__file__).parent / "templates"
_DISC = "disc:\n  centre: centre\n  radius: 45 mm # 3 spacings"
_SMALL_DISC = "disc:\n  radius: 18 mm"
_IMAGE = (
    "image: # what is dark on a light ground; PNG, JPG or SVG\n"
    "  file: {file}\n{grey}"
    "  width: 120 mm # 8 spacings; the height follows\n"
    "  centre: centre # or [142.5 mm, 142.5 mm]\n"
    "  orientation: 0 deg # counter-clockwise\n"
    "loose: remove # units that the void cuts off from the rest; or refuse"
)
_SMALL_IMAGE = "image:\n  width: 45 mm"


def work(args: argparse.Namespace) -> None:
    """Writes the study's folder, complete or not at all.

    Raises:
        UserError: a bad name, a study of that name, or an image that shows no shape.
    """
    folder = args.folder / args.name
    _check(args, folder)
    with write_folder_atomically(folder) as aside:
        if args.image is not None:
            shutil.copyfile(args.image, aside / args.image.name)
        made = aside / "problem.yaml"
        made.write_text(text(args), encoding="utf-8")
        try:
            problem.load(made)
        except UserError as error:  # the template is sound: it is the image
            error.file, error.line = str(args.image), None
            raise
        has_draft = _has_draft(made)
    own = WORK / "experiments"
    what, build = ("a draft", f"{args.name}@quick") if has_draft else ("build it", args.name)
    build = f"{BUILD} {build}"
    if args.folder.resolve() != own.resolve():
        build = f"move its folder to {own}, then {build}"
    LOG.info("made %s; %s: %s", folder / "problem.yaml", what, build)


def _has_draft(made: Path) -> bool:
    """Tells a study whose void fits the small lattice of its draft too, and warns of another."""
    try:
        problem.load(made, "quick")
    except UserError as error:
        LOG.warning("no draft before presets.quick.void is changed: %s", error.what)
        return False
    return True


def text(args: argparse.Namespace) -> str:
    """Fills in the problem file of a new study."""
    name, image = args.name, args.image
    if image is None:
        void, small = _DISC, _SMALL_DISC
    else:
        plain = re.fullmatch(r"[A-Za-z][\w.-]*", image.name)
        file = image.name if plain else json.dumps(image.name, ensure_ascii=False)
        grey = "" if args.threshold is None else f"  threshold: {args.threshold:g}\n"
        grey += "  invert: true\n" if args.invert else ""
        void, small = _IMAGE.format(file=file, grey=grey), _SMALL_IMAGE
    template = (TEMPLATES / f"{args.kind}.yaml").read_text(encoding="utf-8")
    return Template(template).substitute(
        name=name,
        build=BUILD,
        title=name.replace("_", " ").capitalize(),
        void=indent(void, "  "),
        quick=indent(small, "      "),
    )


def _check(args: argparse.Namespace, folder: Path) -> None:
    if re.fullmatch(r"[A-Za-z]\w*", args.name, re.ASCII) is None:
        remedy = "begin with a letter; use letters, digits and underscores"
        raise UserError("not a name for a study", key="name", value=args.name, remedy=remedy)
    if folder.exists():
        remedy = "choose another name, or edit the problem file there"
        raise UserError("there is a study of this name", file=folder, remedy=remedy)
    check_new(args.name, args.folder.resolve().parent)
    if args.image is None:
        if args.threshold is not None or args.invert:
            key = "--invert" if args.threshold is None else "--threshold"
            raise UserError(
                "it is for an image", key=key, remedy="give --image too, or leave it out"
            )
        return
    if args.kind == "dynamic":
        remedy = "leave --image out, or take --kind static"
        raise UserError("the dynamic template has no void", key="--image", remedy=remedy)
    with found_in(args.image):
        read_outlines(args.image, threshold=args.threshold, invert=args.invert)
