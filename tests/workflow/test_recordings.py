"""Recordings of a study: a video and its YAML are all that it takes."""

from tests.workflow.conftest import Sandbox

TRACKED = {"track": 1, "track_report": 1, "fig2_recordings": 1}
ONLY_DESIGN = {"design": 2, "select": 1}


def only(sandbox: Sandbox, text: str, video: str = "run1.mp4") -> None:
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
    only(sandbox, "video: run1.mp4\nload_cell: {file: load.csv}\n")
    (sandbox.root / "experiments/fig2/recordings/load.csv").write_text("time,force\n")
    assert sandbox.planned("fig2_recordings") == TRACKED | ONLY_DESIGN


def test_a_recording_may_bring_its_own_design(sandbox: Sandbox) -> None:
    only(sandbox, "video: run1.mp4\ndesign: own.nc\n")
    (sandbox.root / "experiments/fig2/recordings/own.nc").write_bytes(b"design")
    assert sandbox.planned("fig2_recordings") == TRACKED


def test_files_beside_a_recording_may_have_spaces(built: Sandbox) -> None:
    names = ("run 1 (grün).mp4", "it's mine.nc", "load $1.csv")
    text = 'video: "{}"\ndesign: "{}"\nload_cell: {{file: "{}"}}\n'
    only(built, text.format(*names), names[0])
    for name in names[1:]:
        (built.root / "experiments/fig2/recordings" / name).write_bytes(b"held")
    ended = built.run("results/fig2/recordings/run1/track.nc")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    told = (built.root / "results/fig2/recordings/run1/track.nc").read_text()
    assert names[1] in told
