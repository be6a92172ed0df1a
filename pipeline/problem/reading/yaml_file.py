"""Reads a YAML file safely: plain data only, bounded, with the line of every key."""

import re
from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from pipeline.runtime import UserError, read_bounded, refusal

_LARGEST = 256 * 1024
_DEEPEST = 100
"""Levels of nesting that are followed: libyaml overflows its stack at some ten thousand."""
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f\ud800-\udfff]")
"""Characters that no text of a file should have: escapes may write them, terminals obey them."""

_AMBIGUOUS = re.compile(
    r"[-+]?0[0-9_]+|[-+]?0[bo][0-7_]+|[-+]?[0-9][0-9_]*_[0-9_.]*"
    r"|[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?|[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}(\D.*)?"
)
"""Plain words that YAML 1.1 and 1.2 read differently: 0036 is 30 or 36, 3:0 is 180 or a text."""

KeyPath = tuple[str | int, ...]


@dataclass(frozen=True)
class Document:
    """Holds the mapping in a YAML file, with the line (from one) of its keys and items."""

    path: Path
    data: dict[str, Any]
    lines: dict[KeyPath, int]

    def line(self, keys: KeyPath) -> int | None:
        """Finds the line of a key, or of the nearest key above it."""
        for length in range(len(keys), 0, -1):
            if (line := self.lines.get(keys[:length])) is not None:
                return line
        return None


class _Loader(yaml.CSafeLoader):
    """Loads plain data only, and every key once, of what passed `_check_events`."""

    def construct_scalar(self, node: yaml.ScalarNode | yaml.MappingNode) -> str:
        if isinstance(node, yaml.ScalarNode) and _CONTROL.search(node.value):
            raise _fault("control characters are not supported", node)
        if (
            isinstance(node, yaml.ScalarNode)
            and not node.style
            and _AMBIGUOUS.fullmatch(node.value)
        ):
            what = f"{node.value} reads in two ways: write a plain number, or a text in quotes"
            raise _fault(what, node)
        return super().construct_scalar(node)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _fault("a key must be one word", key)
            if key.value == "<<":
                raise _fault("merging (<<) is not supported", key)
            if key.value in seen:
                raise _fault(f"the key {key.value!r} is given twice", key)
            seen.add(key.value)
        return super().construct_mapping(node, deep)


_Loader.yaml_implicit_resolvers = {
    first: [pair for pair in pairs if pair[0] != "tag:yaml.org,2002:bool"]
    for first, pairs in yaml.CSafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(  # of YAML 1.2: yes, no, on and off are texts
    "tag:yaml.org,2002:bool", re.compile("true|True|TRUE|false|False|FALSE"), list("tTfF")
)


def _refuse(event: yaml.Event) -> None:
    """Refuses aliases, which can expand without bound, and tags, which ask for other types."""
    if isinstance(event, yaml.AliasEvent):
        what = "aliases (*name)"
    elif getattr(event, "tag", None) is not None:
        what = "tags (!name)"
    else:
        return
    raise _not_supported(f"{what} are not supported", event)


def _not_supported(what: str, event: yaml.Event) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=what, problem_mark=event.start_mark)  # type: ignore[arg-type]


def _fault(what: str, node: yaml.Node) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=what, problem_mark=node.start_mark)


def read_yaml(path: Path) -> Document:
    """Reads the mapping in a YAML file.

    Raises:
        UserError: no such file, too large, not UTF-8, not YAML, a duplicate key, or not a mapping.
    """
    text = _text(path)
    try:
        _check_events(text)
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            data = None if node is None else loader.construct_document(node)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        raise _syntax_error(path, error) from error
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise UserError(f"not YAML: {error}", file=path, remedy="write plain YAML text") from error
    if node is None or not isinstance(data, dict):
        remedy = "write keys and values, such as `lattice:` and its keys below it"
        raise UserError("the file does not hold keys and values", file=path, remedy=remedy)
    return Document(path, data, dict(_lines(node, ())))


def read_quickly(path: Path) -> dict[str, Any]:
    """Reads the mapping in a YAML file fast; an empty one where `read` would refuse it."""
    try:
        text = _text(path)
        _check_events(text)
        data = yaml.load(text, Loader=yaml.CSafeLoader)
    except (UserError, yaml.YAMLError, ValueError, OverflowError):
        return {}
    return data if isinstance(data, dict) else {}


def _check_events(text: str) -> None:
    """Refuses aliases, tags and deep nesting before a loader in C meets them."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.CSafeLoader):
        _refuse(event)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            raise _not_supported("nested too deeply", event)


def _text(path: Path) -> str:
    try:
        return read_bounded(path, _LARGEST).decode("utf-8")
    except FileNotFoundError as error:
        raise UserError("no such file", file=path, remedy="check the path") from error
    except IsADirectoryError as error:
        raise UserError("a folder, not a file", file=path, remedy="name the YAML file") from error
    except UnicodeDecodeError as error:
        raise UserError("not a UTF-8 text", file=path, remedy="save it as UTF-8") from error
    except OSError as error:
        raise refusal(path, error) from error


def _syntax_error(path: Path, error: yaml.MarkedYAMLError) -> UserError:
    mark = error.problem_mark or error.context_mark
    told = ", ".join(part for part in (error.context, error.problem) if part)
    return UserError(
        f"not valid YAML: {told}",
        file=path,
        line=None if mark is None else mark.line + 1,
        remedy="correct the text there or just above (colons, indentation, quotes, repetitions)",
    )


def _lines(node: yaml.Node, keys: KeyPath) -> Iterator[tuple[KeyPath, int]]:
    if isinstance(node, yaml.MappingNode):
        children = [(key.value, key.start_mark, value) for key, value in node.value]
    elif isinstance(node, yaml.SequenceNode):
        children = [(index, item.start_mark, item) for index, item in enumerate(node.value)]
    else:
        return
    for key, mark, child in children:
        yield (*keys, key), mark.line + 1
        yield from _lines(child, (*keys, key))
