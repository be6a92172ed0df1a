"""A folder in which another user has built is refused in one sentence."""

import os
from pathlib import Path

import pytest

from pipeline.runtime import UserError
from pipeline.workflow.runs import write_access


@pytest.mark.parametrize(
    ("protected", "owner", "told"),
    [
        (".snakemake/metadata", 1, r"another user .* works in this folder"),
        (".snakemake", 1, r"another user .* works in this folder"),
        (".snakemake/metadata", 0, "no permission"),
    ],
)
def test_it_is_told_who_built_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, protected: str, owner: int, told: str
) -> None:
    """Whoever tests may be root, who can write anywhere."""
    (tmp_path / ".snakemake/metadata").mkdir(parents=True)
    write_access.check(tmp_path)
    own = os.getuid()
    monkeypatch.setattr(os, "access", lambda path, _: path != tmp_path / protected)
    monkeypatch.setattr(os, "getuid", lambda: own + owner)
    with pytest.raises(UserError, match=told) as refused:
        write_access.check(tmp_path)
    assert refused.value.file == str(tmp_path / protected)
    assert ("clone of your own" in str(refused.value)) is bool(owner)


def test_a_folder_in_which_nobody_has_built_is_to_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_access.check(tmp_path)
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(UserError, match="no permission"):
        write_access.check(tmp_path)
