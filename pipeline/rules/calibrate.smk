# Constants of the specimens from measurements; those that are virtual are computed first.
rule calibrate:
    input:
        expand(
            "results/calibration/{calibration}/fit.svg",
            calibration=calibration_inputs.calibrations(),
        ),


rule calibrate_synthesise:
    input:
        unpack(calibration_inputs.named_by),
        description="experiments/calibration/{calibration}.yaml",
    output:
        directory("results/calibration/{calibration}/data"),
    log:
        "results/calibration/{calibration}/logs/synthesise.log",
    threads: 1
    params:
        source=source_hash("pipeline.stages.calibrate"),
    message:
        "Computing measurements for {wildcards.calibration} (synthetic)"
    shell:
        "python -m pipeline calibrate synthesise {input.description} --out-dir {output} --log {log}"


rule calibrate_fit:
    input:
        unpack(calibration_inputs.measurements),
    output:
        dataset="results/calibration/{calibration}/calibration.nc",
        material="results/calibration/{calibration}/calibration.yaml",
    log:
        "results/calibration/{calibration}/logs/calibration.log",
    threads: 1
    params:
        description=calibration_inputs.description,
        source=source_hash("pipeline.stages.calibrate"),
    message:
        "Finding the constants of {wildcards.calibration}"
    shell:
        "python -m pipeline calibrate {params.description} --out {output.dataset} --log {log}"


rule calibration_figure:
    input:
        "results/calibration/{calibration}/calibration.nc",
    output:
        multiext("results/calibration/{calibration}/fit", ".pdf", ".svg", ".png"),
    log:
        "results/calibration/{calibration}/logs/figure.log",
    threads: 1
    params:
        folder=subpath(output[0], parent=True),
        source=source_hash(REPORTS["calibration"].module),
    message:
        "Drawing the fit of {wildcards.calibration}"
    shell:
        "python -m reports calibration --calibration {input} --out-dir {params.folder}"
        " --log {log}"
