"""Names what a target publishes: a page, and the studies that this shows."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.problem.reading import joint_figure
from pipeline.runtime import ROOT
from pipeline.workflow import studies, target_words


@dataclass(frozen=True)
class Publication:
    """Holds the names of a page and of the studies that this shows."""

    target: str
    """Names the folder of the page below results/."""
    studies: tuple[studies.Study, ...]

    @classmethod
    def of(cls, word: str) -> Publication:
        """Finds what a word of the command line builds.

        Raises:
            UserError: it builds nothing, or a problem is faulty.
        """
        target = target_words.built_by(word)
        members = tuple(studies.together().get(target) or [studies.Study.parse(target)])
        for study in members:
            studies.problem_of(study)
        return cls(target, members)

    @property
    def folders(self) -> list[str]:
        """Lists the folders of the page and of the studies, below results/."""
        return list(dict.fromkeys([self.target, *map(str, self.studies)]))

    @property
    def inputs(self) -> list[str]:
        """Lists the files that tell what was asked for."""
        figure = f"experiments/{studies.Study.parse(self.target).name}/figure.yaml"
        joint = [figure] if self.target in studies.joints() else []
        return [*joint, *dict.fromkeys(study.problem for study in self.studies)]

    @property
    def about(self) -> tuple[str, str]:
        """Gives the title, and a description."""
        first = self.inputs[0]
        joint = self.target in studies.joints()
        asked = (
            joint_figure.load_joint_figure(ROOT / first)
            if joint
            else studies.problem_of(self.studies[0])
        )
        return f"{asked.title} ({self.target})", asked.doc or asked.title
