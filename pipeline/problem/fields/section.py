"""Defines the base of all sections of a problem: frozen, strict about keys, with remedies."""

import inspect
import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import ClassVar

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, model_validator
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue, SkipJsonSchema
from pydantic_core import CoreSchema

from pipeline.problem.fields.quantities import fault

_ATTRIBUTES = re.compile(r"\n*^Attributes:\n", re.MULTILINE)
_KEY = re.compile(r"^    (\w+): (.+(?:\n {8}.+)*)", re.MULTILINE)


class Section(BaseModel):
    """Refuses unknown keys, with the nearest known one; no value can be changed."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        frozen=True, extra="forbid", validate_by_name=False, validate_by_alias=True
    )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Adds to the schema the meaning of every key by the docstring."""
        made = handler(core_schema)
        whole = handler.resolve_ref_schema(made)
        whole["description"] = _summary(cls)
        told = _meanings(cls)
        for name, field in cls.model_fields.items():
            if (key := field.alias or name) in whole["properties"] and name in told:
                whole["properties"][key]["description"] = told[name]
        return made

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return data
        known = {field.alias or name: field for name, field in cls.model_fields.items()}
        for key in data:
            if key not in known:
                offered = [name for name, field in known.items() if not _is_internal(field)]
                near = get_close_matches(str(key), offered, n=1, cutoff=0.8)
                hint = f"did you mean {near[0]!r}? " if near else ""
                raise fault("unknown key", f"{hint}known here: {', '.join(offered)}", str(key))
        return data


def exactly_one(section: Section, *names: str) -> None:
    """Refuses a section that gives none or several of the alternatives `names`.

    Raises:
        PydanticCustomError: naming the alternatives.
    """
    given = [name for name in names if getattr(section, name) is not None]
    if len(given) != 1:
        what = "nothing given" if not given else f"{' and '.join(given)} exclude each other"
        raise fault(what, f"give exactly one of: {', '.join(names)}")


def _is_internal(field: FieldInfo) -> bool:
    """Tells a field that no file holds: what was read from another one."""
    return any(isinstance(each, SkipJsonSchema) for each in field.metadata)  # type: ignore[misc]


def _summary(section: type) -> str:
    """Takes the text before the attributes from a docstring, a line for each paragraph."""
    told = _ATTRIBUTES.split(inspect.cleandoc(section.__doc__ or ""))[0]
    return "\n\n".join(map(_on_one_line, told.split("\n\n")))


def _meanings(section: type) -> dict[str, str]:
    """Takes the meaning of each attribute from the docstrings, those of the bases first."""
    found: dict[str, str] = {}
    for base in reversed(section.__mro__):
        listed = _ATTRIBUTES.split(inspect.cleandoc(base.__doc__ or ""))[1:]
        found |= {key: _on_one_line(told) for part in listed for key, told in _KEY.findall(part)}
    return found


def _on_one_line(text: str) -> str:
    return " ".join(text.split())
