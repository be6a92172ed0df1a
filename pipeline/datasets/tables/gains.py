"""Lists variables of the gains of designs that hold against more than the study asks for."""

from __future__ import annotations

from pipeline.datasets.tables.variables import ENERGY, Table, Variable, names

_PRESET = ("preset",)

GAINS: Table = {
    "preset": names("preset", "preset that asks for more than the study's own drive"),
    "asks": Variable(_PRESET, "1", "what it asks for, in its title's words", "str"),
    "loads": Variable(_PRESET, "1", "loads that the loss is over, each of all directions", "int64"),
    "copies": Variable(
        _PRESET, "1", "imperfect copies that the loss is the mean of, 0: the perfect one", "int64"
    ),
    "loss_plain": Variable(
        _PRESET, "1", "loss under what the preset asks for, of the study's own design", also=ENERGY
    ),
    "loss_own": Variable(
        _PRESET, "1", "loss under what the preset asks for, of the preset's design", also=ENERGY
    ),
    "loss_altered": Variable(
        _PRESET, "1", "loss under what the preset asks for, before any design", also=ENERGY
    ),
    "price": Variable(
        _PRESET, "1", "loss under the study's own drive, of the preset's design", also=ENERGY
    ),
    "loss_drive": Variable(
        (), "1", "loss under the study's own drive, of the study's own design", also=ENERGY
    ),
}
