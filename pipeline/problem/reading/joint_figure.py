"""Reads figures of several studies side by side: `figure.yaml` in a folder of experiments."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, StringConstraints, ValidationError

from pipeline.problem.fields import Section
from pipeline.problem.reading import yaml_file
from pipeline.runtime import UserError

_Name = Annotated[str, StringConstraints(pattern=r"^\w+$")]


class JointFigure(Section):
    """A figure of several studies.

    Attributes:
        title: of figure and page.
        doc: what it shows, in some sentences.
        studies: names of their folders, in the order in which they are shown.
    """

    title: str = ""
    doc: str = ""
    studies: Annotated[tuple[_Name, ...], Field(min_length=1)]


def load_joint_figure(path: Path) -> JointFigure:
    """Reads the figure in a YAML file.

    Raises:
        UserError: naming the file, the key and the remedy.
    """
    document = yaml_file.read_yaml(path)
    try:
        joint = JointFigure.model_validate(document.data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"]))
        remedy = "give title, doc and studies, a list of folders beside this one"
        raise UserError(first["msg"], file=path, key=key or None, remedy=remedy) from error
    for name in joint.studies:
        if not (path.parent.parent / name / "problem.yaml").is_file():
            raise UserError(
                f"there is no study {name!r}",
                file=path,
                line=document.line(("studies",)),
                key="studies",
                remedy="name folders of experiments that hold a problem.yaml",
            )
    return joint
