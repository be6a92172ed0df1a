import errno
import os
import shutil
from pathlib import Path

import pytest
import yaml
from snakemake.iocontainers import Wildcards

from pipeline.workflow.product_checks import check_products
from pipeline.workflow.rule_inputs import check_writable, figure_hash, products, shown_datasets
from tests.tables import cases, refused, some
from tests.workflow.conftest import Sandbox

STUDY = {"design": 2, "select": 1, "simulate": 1, "as_built": 1, "sweep": 4, "sweep_gather": 1}
STUDY |= {"sweep_constants": 1, "virtual_specimen": 2, "film_render": 2, "track": 2, "compare": 2}
STUDY |= {"monte_carlo": 2, "monte_carlo_gather": 1, "report": 1, "fig2": 1}


def only(*rules: str) -> dict[str, int]:
    return {rule: STUDY[rule] for rule in (*rules, "fig2")}


def test_studies_from_nothing(sandbox: Sandbox) -> None:
    assert sandbox.planned("fig2") == STUDY
    assert sandbox.planned("fig2@quick")["sweep"] == 3  # its map has no part without a frequency
    packages = {"fabricate": 2, "fabrication_page": 1, "fig2_fabrication": 1}
    others = {"measure": 12, "benchmark": 1, "index": 1}
    planned = sandbox.planned("fig2_fabrication", "benchmark", "index")
    assert planned == {"design": 2, "select": 1, **packages, **others}
    planned = sandbox.planned("fig6@quick")
    assert planned["joint_report"] == 1
    assert planned["simulate"] == 2
    assert not {"redesign", "report"} & planned.keys()
    planned = sandbox.planned("fig3@quick")
    assert planned["design"] == planned["simulate"] == 2
    assert planned["family_report"] == 1
    assert "report" not in planned
    front = sandbox.planned("fig2_front")
    counts = {"front": 1, "front_page": 1, "fig2_front": 1, "certify": 2}
    assert front == {"design": 23, "select": 22, **counts}
    assert sandbox.planned("fig2@unbiased_size")["family_report"] == 1
    alone = sandbox.planned("fig3@quick.2")
    assert alone["design"] == alone["report"] == 1
    planned = sandbox.planned("all")
    assert planned["all"] == 1
    assert planned["joint_report"] == 1
    figures = list((sandbox.root / "experiments").glob("fig[0-9]/problem.yaml"))
    assert planned["family_report"] == 1
    assert planned["report"] + 1 == len(figures)  # none of the variants
    assert planned["movie"] == 4


def test_a_figure_of_several_is_drawn_again_for_its_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.workflow.rule_inputs.WORK", tmp_path)
    figure = tmp_path / "experiments/fig6/figure.yaml"
    (figure.parent.with_name("fig2")).mkdir(parents=True)
    (figure.parent.with_name("fig2") / "problem.yaml").touch()
    figure.parent.mkdir()
    words = ("title: One\nstudies: [fig2]", "studies: [fig2] # as before\ntitle: One",
             "title: Two\nstudies: [fig2]", "title: [")  # fmt: skip
    hashes = [
        figure_hash(Wildcards(fromdict={"name": "fig6"}))
        for text in words
        if figure.write_text(text)
    ]
    assert hashes[0] == hashes[1] != hashes[2] != hashes[3] == ""


def test_products_have_rules_where_they_are_asked_for() -> None:
    assert products(["fig2_sweep", "fig4"]) == {"fig2_sweep": ["results/fig2/sweep/index.html"]}
    listed = products(["--list-target-rules"])
    assert {"fig2_sweep", "fig3@quick.2_fabrication", "fig6_recordings", "fig7_front"} <= set(
        listed
    )


@cases("workflow", "target, place, key, what, remedy")
def test_a_product_that_is_not_asked_for_is_refused_at_once(
    target: str, place: str, key: str | None, what: str, remedy: str
) -> None:
    with refused(what, key, remedy) as caught:
        check_products(["--dry-run", target])
    assert caught.value.file == f"experiments/{place}"


@pytest.mark.parametrize(
    "target",
    ["fig2_sweep", "fig7_spectrum", "fig2@unbiased_certificate", "fig2_gains", "fig2_front",
     "fig4@quick_recordings", "kagome_fabrication", "results/fig2/sweep.nc", "fig9_sweep"],
)  # fmt: skip
def test_products_that_are_asked_for_are_left_alone(target: str) -> None:
    check_products([target])


def test_a_product_is_refused_before_the_first_job(sandbox: Sandbox) -> None:
    ended = sandbox.run("kagome_sweep")
    assert ended.returncode == 1
    assert "error: the study asks for no sweep\n" in ended.stderr
    assert not (sandbox.root / "results").exists()


def test_datasets_and_designs_are_those_that_the_problem_asks_for(sandbox: Sandbox) -> None:
    problem = sandbox.root / "experiments/fig5/problem.yaml"
    problem.write_text(problem.read_text().replace("law: geometric", "law: angle"))
    planned = sandbox.planned("fig5@quick")
    assert planned["simulate"] == 2  # by the angle law, then with contact on distance
    assert planned["redesign"] == 1
    before, _, rest = sandbox.problem.read_text().partition("\nsweep:\n")
    rest = rest[rest.index("report:") :]
    sandbox.problem.write_text(f"{before}\nrobustness:\n  samples: 5\n\n{rest}")
    planned = sandbox.planned("fig2")
    assert planned["monte_carlo"] == 2
    assert planned["monte_carlo_gather"] == 1
    assert not {"sweep", "sweep_gather"} & planned.keys()


def test_preset_has_its_own_targets_and_folder(sandbox: Sandbox) -> None:
    response = "results/fig2@quick/response.nc"
    ended = sandbox.run(response)
    assert ended.returncode == 0, ended.stderr
    assert "preset='quick'" in (sandbox.root / response).read_text()
    planned = sandbox.planned("fig2_quick")
    assert planned["fig2_quick"] == planned["report"] == 1
    assert not {"design", "select", "simulate"} & planned.keys()


def test_second_run_has_nothing_to_do(built: Sandbox) -> None:
    os.utime(built.problem)
    assert (built.root / "results/fig2/report/fig2.pdf").exists()
    assert "Nothing to be done" in built.run("fig2").stderr


@pytest.mark.parametrize(
    ("name", "made"),
    some(
        [
            ("scatter.nc", only("monte_carlo", "monte_carlo_gather", "report")),
            ("response.nc", only("simulate", "compare", "report")),
            ("recordings/cloaked/comparison.nc", only("report") | {"compare": 1}),
        ],
        1,
    ),
)
def test_a_dataset_that_is_missing_is_made_again_though_its_page_is_there(
    built: Sandbox, name: str, made: dict[str, int]
) -> None:
    (built.root / "results/fig2" / name).unlink()
    assert built.planned("fig2") == made


def test_targets_show_what_their_pages_do() -> None:
    both = {f"results/fig6_{void}@quick/response.nc" for void in ("heart", "shamrock")}
    assert both <= set(shown_datasets("fig6@quick"))
    assert "results/fig3@quick.2/design.nc" in shown_datasets("fig3@quick")
    assert "results/fig2/recordings/cloaked/comparison.nc" in shown_datasets("fig2")


SHOWN = ("simulate", "as_built", "virtual_specimen", "film_render", "track", "compare", "report")


@pytest.mark.parametrize(
    ("old", "new", "rerun"),
    some(
        [
            ("evaluations: 60", "evaluations: 61", STUDY | {"design": 1}),
            ("cycles: 4", "cycles: 3", only(*SHOWN)),
            ("amplitude: 4.5 mm", "amplitude: 0.45 cm", {}),
            ("points: 15", "points: 14", only("sweep", "sweep_gather", "report")),
            ("title: Shielding", "title: Hiding", only("report")),
            ("amplitude: 4.5 mm", "amplitude: 4.4 mm", STUDY),
            ("# Figure 2", "# The second figure", {}),
        ],
        3,
    ),
)
def test_edits_rerun_dependents(built: Sandbox, old: str, new: str, rerun: dict[str, int]) -> None:
    built.edit(old, new)
    assert built.planned("fig2") == rerun


@pytest.mark.slow
def test_gains_have_the_titles_of_today(built: Sandbox) -> None:
    gains = "results/fig2/gains.nc"
    ended = built.run(gains)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert built.planned(gains) == {}
    built.edit("Shielding with units and ligaments as they come out", "Another title")
    assert built.planned(gains) == {"robust_gains": 1}


def test_edited_source_reruns_what_imports_it(built: Sandbox) -> None:
    module = built.root / "reports/figures/study_report.py"
    module.write_text(module.read_text() + "\n")
    assert built.planned("fig2") == only("report")


def test_faulty_problem_is_one_message_even_if_results_exist(built: Sandbox) -> None:
    built.edit("axial_stiffness: 120 N/mm", "axial_stiffness: -120 N/mm")
    for ended in (built.run("fig2"), built.resume("fig2")):
        assert ended.returncode != 0
        assert "experiments/fig2/problem.yaml, line" in ended.stderr
        assert "material.axial_stiffness" in ended.stderr
        assert "Traceback" not in ended.stderr


def test_a_run_without_a_target_names_those_that_there_are(sandbox: Sandbox) -> None:
    for words in ([], ["--dry-run"]):
        ended = sandbox.run(*words)
        assert ended.returncode == 1
        assert "error: nothing to build\n  remedy: name a target: fig2, fig3" in ended.stderr
        assert "Nothing to be done" not in ended.stderr
        assert "Exception" not in ended.stderr


def test_measured_constants_are_read_before_anything_runs(sandbox: Sandbox) -> None:
    asked = yaml.safe_load(sandbox.problem.read_bytes())["report"]["measured_constants"]["file"]
    constants = sandbox.problem.parent / asked
    text = constants.read_text()
    constants.write_text(text.replace("axial_stiffness", "axial"))
    ended = sandbox.run("--dry-run", "fig2")
    assert ended.returncode == 1
    assert "error: columns are missing" in ended.stderr
    assert "key:    report.measured_constants.file" in ended.stderr
    assert "Exception" not in ended.stderr
    constants.unlink()
    ended = sandbox.run("--dry-run", "fig2@quick", "fig2")
    assert ended.returncode == 1
    assert "error: no such file" in ended.stderr
    assert sandbox.run("--dry-run", "fig2@as_built").returncode == 0


@pytest.mark.parametrize("name", some(["$(touch pwned)", "a; touch pwned", "my-cloak"], 1))
def test_names_that_targets_cannot_have_are_refused(sandbox: Sandbox, name: str) -> None:
    experiments = sandbox.root / "experiments"
    shutil.copytree(experiments / "fig2", experiments / name)
    ended = sandbox.run("--dry-run", name)
    assert ended.returncode == 1
    assert "the name of a study may have letters, digits and underscores only" in ended.stderr
    shutil.move(experiments / name, experiments / "sound")
    recordings = experiments / "sound/recordings"
    shutil.copy(recordings / "cloaked.yaml", recordings / f"{name}.yaml")
    ended = sandbox.run("--dry-run", "sound")
    assert ended.returncode == 1
    assert f"sound/recordings/{name}.yaml" in ended.stderr
    assert "remedy: name it " in ended.stderr
    assert not list(sandbox.root.rglob("pwned"))
    ended = sandbox.run("fig2@edge4")
    assert ended.returncode != 0
    assert "did you mean 'edge3'?" in ended.stderr


def test_folder_that_cannot_be_made_is_one_message(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("a file in the place of the folder")
    with pytest.raises(SystemExit, match=r"error: results cannot be written[^|]*remedy"):
        check_writable(str(tmp_path / "results"))


def test_full_disk_is_one_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(SystemExit, match="No space left on device"):
        check_writable(str(tmp_path))
    assert not list(tmp_path.iterdir())


def test_clean_removes_what_was_built_and_nothing_else(built: Sandbox) -> None:
    ended = built.run("clean")
    assert ended.returncode == 0, ended.stderr
    assert not (built.root / "results").exists()
    assert built.problem.exists()


MEASURED = """\
spacing: 15 mm
material:
  density: 6.18 kg/m^2
  axial_stiffness: 120 N/mm
  shear_stiffness: 1.2 N/mm
  bending_stiffness: 1.5 N mm/rad
  damping: {ratio: 0.02}
fit: [damping_ratio]
data: [{kind: free_decay, name: decay, file: decay.csv}]
"""


def test_only_what_is_virtual_is_computed_first(sandbox: Sandbox) -> None:
    folder = sandbox.root / "experiments/calibration"
    virtual = len(list(folder.glob("*.yaml")))
    (folder / "mine.yaml").write_text(MEASURED)
    (folder / "decay.csv").write_text("time (s),angle (deg)\n")
    planned = sandbox.planned("calibrate")
    assert planned["calibrate_synthesise"] == virtual > 0
    assert planned["calibrate_fit"] == planned["calibration_figure"] == virtual + 1


def leave(sandbox: Sandbox, text: str, video: str = "run1.mp4") -> None:
    """Leaves one recording, of a video beside it."""
    folder = sandbox.root / "experiments/fig2/recordings"
    for path in folder.iterdir():
        path.unlink()
    (folder / "run1.yaml").write_text(text, encoding="utf-8")
    (folder / video).write_bytes(b"video")


def test_virtual_recordings_are_rendered_and_tracked(sandbox: Sandbox) -> None:
    planned = sandbox.planned("fig2_recordings")
    count = len(list((sandbox.root / "experiments/fig2/recordings").glob("*.yaml")))
    assert planned["film_render"] == planned["track"] == planned["track_report"] == count > 0
    assert planned["virtual_specimen"] == count
    assert not {"simulate", "film_weigh"} & planned.keys()
    planned = sandbox.planned("fig4_recordings")  # with a virtual load cell
    assert planned["film_weigh"] == planned["virtual_specimen"] == planned["track"] == 2


def test_a_video_that_is_dropped_in_is_tracked(sandbox: Sandbox) -> None:
    """It may bring its own design."""
    tracked, folder = {"track": 1, "track_report": 1, "fig2_recordings": 1}, "fig2/recordings"
    leave(sandbox, "video: run1.mp4\nload_cell: {file: load.csv}\n")
    (sandbox.root / "experiments" / folder / "load.csv").write_text("time,force\n")
    assert sandbox.planned("fig2_recordings") == tracked | {"design": 2, "select": 1}
    leave(sandbox, "video: run1.mp4\ndesign: own.nc\n")
    (sandbox.root / "experiments" / folder / "own.nc").write_bytes(b"design")
    assert sandbox.planned("fig2_recordings") == tracked


def test_files_beside_a_recording_may_have_spaces(built: Sandbox) -> None:
    names = ("run 1 (grün).mp4", "it's mine.nc", "load $1.csv")
    text = 'video: "{}"\ndesign: "{}"\nload_cell: {{file: "{}"}}\n'
    leave(built, text.format(*names), names[0])
    for name in names[1:]:
        (built.root / "experiments/fig2/recordings" / name).write_bytes(b"held")
    ended = built.run("results/fig2/recordings/run1/track.nc")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    told = (built.root / "results/fig2/recordings/run1/track.nc").read_text()
    assert names[1] in told


def test_results_are_removed_where_none_can_be_written(sandbox: Sandbox) -> None:
    results = sandbox.root / "results"
    results.symlink_to("nowhere")  # no folder can be made, as on a full disk
    ended = sandbox.run("clean")
    assert ended.returncode == 0, ended.stderr
    assert not results.is_symlink()
