"""The stages: each module reads datasets, calls `sim`, and writes a dataset."""

from pipeline.runtime import keep_old_commands, pin

pin()
keep_old_commands(
    "pipeline",
    {
        **{
            name: name
            for name in (
                *("design", "select", "simulate", "sweep", "verify", "spectrum", "fabricate"),
                *("track", "calibrate", "compare", "run", "reproduce", "new", "schema"),
                *("markers", "reference"),
            )
        },
        "reconsider": "redesign",
        "scatter": "monte_carlo",
        "gains": "robust_gains",
        "specimen": "virtual_specimen",
        "virtual_lab": "film",
    },
)
