"""Figures, tables and pages built from the datasets of a study."""

from pipeline.runtime import keep_old_commands

_PAGES = (
    *("sweep", "spectrum", "tracking", "fabrication", "calibration"),
    *("framework", "movie", "index", "benchmark", "stress"),
)
keep_old_commands(
    "reports",
    {
        **{f"{name}.build": name for name in _PAGES},
        "build": "study",
        "joint.build": "several-studies",
        "family.build": "several-designs",
        "gains.build": "robust-gains",
    },
)
