from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pipeline.workflow import recordings
from pipeline.workflow.recordings import shown_recordings

VIRTUAL = "structure: cloaked\nvirtual: {}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Recordings of a study that has been given one."""
    made = tmp_path / "experiments/study/recordings"
    made.mkdir(parents=True)
    (made / "cloaked.yaml").write_text(VIRTUAL + "presets: [quick]\n")
    (made / "altered.yaml").write_text(VIRTUAL.replace("cloaked", "altered"))
    return made


def shown(folder: Path, study: str = "study") -> list[str]:
    return shown_recordings(study, folder.parents[2])


def test_a_preset_shows_those_that_name_it(folder: Path) -> None:
    assert shown(folder) == ["altered", "cloaked"]
    assert shown(folder, "study@quick") == ["cloaked"]
    assert shown(folder, "study@other") == []
    assert shown(folder, "another") == []
    (folder / "broken.yaml").write_text("structure: [")  # its stage will tell why
    (folder / "short.yaml").write_text(
        "structure: cloaked\nvirtual: { camera: { image: [720] } }\n"
    )
    assert shown(folder, "study@quick") == ["broken", "cloaked", "short"]


def test_a_film_takes_the_place_of_the_virtual_one_of_its_kind(folder: Path) -> None:
    (folder / "lab7.yaml").write_text("video: lab7.mp4\nstructure: altered\n")
    assert shown(folder) == ["cloaked", "lab7"]
    (folder / "lab8.yaml").write_text("video: lab8.mp4\nstructure: altered\n")
    assert shown(folder) == ["cloaked", "lab7", "lab8"]
    (folder / "lab9.yaml").write_text("video: lab9.mp4\nstructure: cloaked\ncase: 1\n")
    assert shown(folder) == ["cloaked", "lab7", "lab8", "lab9"]


def test_a_film_that_a_preset_does_not_show_replaces_nothing_there(folder: Path) -> None:
    (folder / "lab7.yaml").write_text("video: lab7.mp4\nstructure: cloaked\n")
    assert shown(folder) == ["altered", "lab7"]
    assert shown(folder, "study@quick") == ["cloaked"]


def test_tracking_depends_on_each_picture_of_a_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that is written anew leaves the folder's own time as it was."""
    monkeypatch.setattr(recordings, "WORK", folder.parents[2])
    (folder / "lab7.yaml").write_text("video: lab7\nframe_rate: 10 Hz\n")
    wanted: Any = SimpleNamespace(name="study", preset="", recording="lab7")
    beside = "experiments/study/recordings/lab7"
    (folder / "lab7").mkdir()
    assert "pictures" not in recordings.tracked(wanted)
    for name in ("frame10.png", "frame9.png", "notes.txt"):
        (folder / "lab7" / name).write_bytes(b"held")
    found = recordings.tracked(wanted)
    assert found["video"] == beside
    assert found["pictures"] == [f"{beside}/frame9.png", f"{beside}/frame10.png"]
    assert recordings.compared(wanted) == {"recording": f"{beside}.yaml"}
