import dataclasses

from reports.figures.several_designs.designs import DesignSeries, SeriesDesign
from reports.figures.several_designs.facts import design_series_facts
from reports.study import StudyResults


def test_losses_that_are_energies_have_their_unit(study: StudyResults) -> None:
    objective = study.problem.objective.model_copy(update={"kind": "strain_energy"})
    problem = study.problem.model_copy(update={"objective": objective})
    design = SeriesDesign(1, "60 mm", dataclasses.replace(study, problem=problem))
    series = DesignSeries("fig3", "fig3", problem, "cloak.disc.radius", [design])
    known = {fact.key: fact for fact in design_series_facts(series)}
    for key in ("design_1.loss", "design_1.loss_altered"):
        assert known[key].unit == "N mm"
        assert known[key].ours.endswith(" N mm")
