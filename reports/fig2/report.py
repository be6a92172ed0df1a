"""The report on shielding from a shaken source, over load directions and frequencies."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from reports.facts import Fact
from reports.fig2 import content, facts, figure, tables
from reports.page import Page
from reports.study import Study
from reports.tables import Table


class Shielding:
    """Figure 2 of the paper (`reports.kinds.Kind`)."""

    def facts(self, study: Study) -> list[Fact]:
        """See `reports.kinds.Kind`."""
        return facts.collect(study)

    def tables(self, study: Study) -> list[Table]:
        """See `reports.kinds.Kind`."""
        return tables.build(study)

    def figure(self, study: Study) -> Figure:
        """See `reports.kinds.Kind`."""
        return figure.build(study)

    def page(
        self, study: Study, facts: Sequence[Fact], tables: Sequence[Table], svg: str,
        figure_files: Sequence[str],
    ) -> Page:  # fmt: skip
        """See `reports.kinds.Kind`."""
        return content.build(study, facts, tables, svg, figure_files)
