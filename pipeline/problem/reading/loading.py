"""Reads a YAML file and one of its presets to a checked problem, or one clear message."""

import hashlib
import json
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from pipeline.problem import SWITCHES, Problem, canonical_json
from pipeline.problem.fields import FOLDER, Section, units
from pipeline.problem.reading import yaml_file
from pipeline.problem.reading.feasibility import find_faults
from pipeline.problem.reading.yaml_file import Document, KeyPath
from pipeline.problem.sections import (
    SeveralDrives,
    SingleDrive,
    Sweep,
    TimeSeriesDrive,
    designs,
    sweep_cases,
)
from pipeline.runtime import UserError, read_bounded

_LARGEST = 64 << 20  # bytes of a measured motion

Alone = TypeVar("Alone", bound=Section)


def load(path: str | Path, preset: str | None = None) -> Problem:
    """Reads the problem in a YAML file, with one of its presets laid over it, or a design.

    Args:
        path: the file.
        preset: the name of a preset, the number of a design, or both: "quick", "2", "quick.2".

    Raises:
        UserError: naming the file, the key, the value and the remedy.
    """
    document = yaml_file.read_yaml(Path(path))
    data = dict(document.data)
    presets = _presets(document, data.pop("presets", None))
    preset, number = designs.split_name(preset)
    if preset is not None:
        data = overlay_keys(data, _preset(document, presets, preset))
    if number is not None:
        data = _design(document, data, number)
    try:
        problem = Problem.model_validate(data, context={FOLDER: document.path.parent})
    except ValidationError as error:
        raise explain_error(error, document, data, preset) from error
    if problem.sweep is not None:
        _check_sweep(problem, problem.sweep, document, data, preset)
    if preset is None and problem.optimiser.start != "initial":
        what, remedy = "a study cannot start from its own design", "say so in a preset of it"
        raise _user_error(document, preset, data, ("optimiser", "start"), what, remedy)
    for finding in find_faults(problem):
        raise _user_error(document, preset, data, finding.keys, finding.what, finding.remedy)
    return _with_recording(problem, document)


_KEYS = "name a key with those above it, joined by dots: drive.frequency, drives.0.amplitude"


def _design(document: Document, data: Mapping[str, Any], number: int) -> dict[str, Any]:
    try:
        return designs.select_design(data, number)
    except LookupError as error:
        count = designs.design_count(data)
        remedy = f"give one from 1 to {count}" if count else "name a preset, or none"
        raise UserError(str(error), file=document.path, key="designs", remedy=remedy) from error
    except sweep_cases.SettingError as error:
        raise UserError(str(error), file=document.path, key="designs", remedy=_KEYS) from error


def _check_sweep(
    problem: Problem,
    sweep: Sweep,
    document: Document,
    data: Mapping[str, Any],
    preset: str | None,
) -> None:
    """Tries the first value of every parameter that a sweep sets, one at a time.

    It has a place in the file, and among the values that the file leaves out.
    """
    canonical = json.loads(canonical_json(problem, "sweep"))
    first = next(sweep_cases.list_settings(sweep))
    for key, word in first.items():
        place = ("sweep", sweep.form, key)
        try:
            Problem.model_validate(
                sweep_cases.apply_setting(data, {key: word}), context={FOLDER: document.path.parent}
            )
            sweep_cases.apply_setting(canonical, {key: word})
        except ValidationError as error:
            what, remedy = first_fault(error)
            raise _user_error(document, preset, data, place, what, remedy) from error
        except sweep_cases.SettingError as error:
            raise _user_error(document, preset, data, place, str(error), _KEYS) from error


def overlay_keys(
    base: Mapping[str, Any], overlay: Mapping[str, Any], above: KeyPath = ()
) -> dict[str, Any]:
    """Lays `overlay` over `base`, both below the keys `above`.

    Mappings merge, all else replaces, null removes a key or turns off what is on by default. The
    direction of a drive takes the place of its `directions`, and these of it.
    """
    replaced = _other_directions(overlay) if above[-1:] == ("drive",) else set()
    merged = {key: value for key, value in base.items() if key not in replaced}
    for key, value in overlay.items():
        below, path = merged.get(key), (*above, key)
        if value is None and path not in SWITCHES:
            merged.pop(key, None)
        elif isinstance(value, Mapping):
            merged[key] = overlay_keys(below if isinstance(below, Mapping) else {}, value, path)
        else:
            merged[key] = value
    return merged


def _other_directions(overlay: Mapping[str, Any]) -> set[str]:
    """Lists the keys that those of a drive stand instead of."""
    others = {"direction": "directions", "directions": "direction"}
    given = {others[key] for key, word in overlay.items() if key in others and word is not None}
    return given - overlay.keys()


def preset_names(path: str | Path) -> tuple[str, ...]:
    """Reads the names of the presets in a problem file.

    Raises:
        UserError: the file cannot be read.
    """
    presets = yaml_file.read_yaml(Path(path)).data.get("presets")
    return tuple(presets) if isinstance(presets, dict) else ()


def _presets(document: Document, found: object) -> dict[str, Any]:
    if found is None or isinstance(found, dict):
        return found or {}
    raise UserError(
        "presets are wanted here",
        file=document.path,
        line=document.line(("presets",)),
        key="presets",
        remedy="write `NAME:` and its keys below it",
    )


def _preset(document: Document, presets: dict[str, Any], name: str) -> dict[str, Any]:
    def refused(what: str, key: str, remedy: str) -> UserError:
        line = document.line(("presets", name))
        return UserError(what, file=document.path, line=line, key=key, remedy=remedy)

    if name not in presets:
        known = ", ".join(map(str, presets)) or "none"
        near = get_close_matches(name, [str(key) for key in presets], n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise refused(f"no preset {name!r}", "presets", f"{hint}presets here: {known}")
    if not isinstance(presets[name], dict):
        remedy = "write the keys that it changes below it"
        raise refused("keys and values are wanted here", f"presets.{name}", remedy)
    return dict(presets[name])


def load_section(path: Path, kind: type[Alone]) -> Alone:
    """Reads a section that is a YAML file of its own.

    Raises:
        UserError: naming the file, the key, the value and the remedy.
    """
    document = yaml_file.read_yaml(path)
    try:
        return kind.model_validate(document.data, context={FOLDER: document.path.parent})
    except ValidationError as error:
        raise explain_error(error, document, document.data, None) from error


def explain_error(
    error: ValidationError, document: Document, data: dict[str, Any], preset: str | None
) -> UserError:
    """Explains the first error of validation; `data` is the document with its preset."""
    first, *others = error.errors(include_url=False)
    keys = _real_keys(first["loc"], data, missing=_is_missing_key(first))
    what, remedy, below = _in_words(first)
    keys = (*keys, *below)
    if others:
        remedy += f" ({len(others)} more after this one)"
    return _user_error(document, preset, data, keys, what, remedy)


def first_fault(error: ValidationError) -> tuple[str, str]:
    """Explains the first error of validation: fault and remedy."""
    what, remedy, _ = _in_words(error.errors(include_url=False)[0])
    return what, remedy


_WORDS = {
    "missing": ("missing key", "add it"),
    "union_tag_not_found": ("the key `kind` is missing", "add it"),
    "union_tag_invalid": ("unknown kind", "give one of {expected_tags}"),
    "literal_error": ("not one of the choices", "give {expected}"),
    "model_type": ("keys and values are wanted here", "write them below it, indented"),
    "model_attributes_type": ("keys and values are wanted here", "write them below it, indented"),
    "dict_type": ("keys and values are wanted here", "write them below it, indented"),
    "tuple_type": ("a list is wanted here", "write it as [first, second]"),
    "list_type": ("a list is wanted here", "write it as [first, second]"),
    "string_too_short": ("nothing given", "write a text, or leave the key out"),
    "finite_number": ("not a finite number", "give a finite number"),
    "greater_than": ("too small", "give a number greater than {gt}"),
    "greater_than_equal": ("too small", "give a number of at least {ge}"),
    "less_than": ("too large", "give a number less than {lt}"),
    "less_than_equal": ("too large", "give a number of at most {le}"),
    "too_short": ("too few items", "give at least {min_length}"),
    "too_long": ("too many items", "give at most {max_length}"),
    "int_type": ("not a whole number", "give a whole number"),
    "float_type": ("not a number", "give a number"),
    "float_parsing": ("not a number", "give a number"),
    "string_type": ("not a text", "put it in quotes"),
    "bool_type": ("neither true nor false", "give true or false"),
    "bool_parsing": ("neither true nor false", "give true or false"),
}


def _in_words(error: ErrorDetails) -> tuple[str, str, KeyPath]:
    """Translates an error: the fault, the remedy, and the keys below its place."""
    context = error.get("ctx", {})
    if error["type"] == "problem":
        return context["what"], context["remedy"], context["keys"]
    if error["type"] == "missing" and not _is_missing_key(error):
        return "too few items", "write it as [first, second]", ()
    if error["type"] == "float_parsing":
        text = str(error["input"])
        if slip := units.misspelt_number(text) or units.misspelt_share(text):
            return *slip, ()
    what, remedy = _WORDS.get(error["type"], (error["msg"], "correct the value"))
    return what, remedy.format_map(context), ()


def _is_missing_key(error: ErrorDetails) -> bool:
    """Tells a key that is missing from an item that is, of which the list is to blame."""
    return error["type"] == "missing" and isinstance(error["loc"][-1], str)


def _real_keys(location: KeyPath, data: object, *, missing: bool) -> KeyPath:
    """Removes the tags of unions, which are no keys of the file, from a location."""
    keys: list[str | int] = []
    tag: object = None
    for part in location:
        if part == tag:  # a kind that is also the name of a key: `file`
            tag = None
            continue
        if (isinstance(data, Mapping) and part in data) or (
            isinstance(data, list) and isinstance(part, int) and part < len(data)
        ):
            data = data[part]  # type: ignore[index]
            keys.append(part)
            tag = data.get("kind") if isinstance(data, Mapping) else None
    return (*keys, location[-1]) if missing else tuple(keys)


def _user_error(
    document: Document,
    preset: str | None,
    data: Mapping[str, Any],
    keys: KeyPath,
    what: str,
    remedy: str,
) -> UserError:
    overlay: KeyPath = () if preset is None else ("presets", preset)
    place = keys if (*overlay, *keys) not in document.lines else (*overlay, *keys)
    return UserError(
        what,
        file=document.path,
        line=document.line(place),
        key=_dotted(place),
        value=_value(data, keys),
        remedy=remedy,
    )


def _dotted(keys: KeyPath) -> str:
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return text.removeprefix(".") or "(the whole file)"


def _value(data: object, keys: KeyPath) -> object:
    """Reads the value at `keys` if it is plain: a whole section would not help the reader."""
    for key in keys:
        if isinstance(data, Mapping):
            data = data.get(key)
        elif isinstance(data, list) and isinstance(key, int):
            data = data[key]
    return None if isinstance(data, Mapping) else data


def _with_recording(problem: Problem, document: Document) -> Problem:
    """Adds the content hash of the measured motion that a problem refers to, if any."""
    if not isinstance(problem.drive, SeveralDrives):
        return problem.model_copy(update={"drive": _hashed(problem.drive, document, ("drive",))})
    drives = tuple(
        _hashed(drive, document, ("drives", index))
        for index, drive in enumerate(problem.drive.drives)
    )
    return problem.model_copy(update={"drive": problem.drive.model_copy(update={"drives": drives})})


def _hashed(drive: SingleDrive, document: Document, keys: KeyPath) -> SingleDrive:
    """Adds the content hash of its file to a measured motion."""
    if not isinstance(drive, TimeSeriesDrive):
        return drive
    try:
        held = read_bounded(document.path.parent / drive.file, _LARGEST)
    except OSError as error:
        raise UserError(
            f"the measured motion cannot be read: {error.strerror}",
            file=document.path,
            line=document.line((*keys, "file")),
            key=_dotted((*keys, "file")),
            value=drive.file,
            remedy="give its path as seen from the problem file",
        ) from error
    found = hashlib.sha256(held).hexdigest()
    if drive.sha256 not in (None, found):
        raise UserError(
            f"{drive.file} is not the file that was meant: its SHA-256 is {found}",
            file=document.path,
            line=document.line((*keys, "sha256")),
            key=_dotted((*keys, "sha256")),
            value=drive.sha256,
            remedy="restore the file, or correct or remove the hash",
        )
    return drive.model_copy(update={"sha256": found})
