from pathlib import Path

from pipeline.runtime import CaseLog, SweepResult, case_log

FOUND = {
    number: SweepResult(number / 7, 1.0, -number / 9, "ok, more or less") for number in range(5)
}


def test_a_damaged_line_is_computed_again_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "part_0.csv"
    with CaseLog(path, ["drive.frequency", "lattice, in words"]) as book:
        book.add((number, [f"{number} Hz", "a, b"], found) for number, found in FOUND.items())
    assert case_log.known(tmp_path) == FOUND
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    for at in range(1, len(lines)):
        damaged = lines[at].replace("1.0", "1.5")
        path.write_text("".join([*lines[:at], damaged, *lines[at + 1 :]]), encoding="utf-8")
        assert case_log.known(tmp_path) == {k: each for k, each in FOUND.items() if k != at - 1}
    path.write_bytes(text.encode()[:-20])
    assert case_log.known(tmp_path) == {k: each for k, each in FOUND.items() if k != 4}
