# Measured specimens beside their prediction: experiments/validation. make validation builds the page.
rule validation:
    input:
        "results/validation/index.html",


rule validate_samples:
    input:
        measured=lambda wildcards: calibration_inputs.measured_files("hinge_statics"),
        description="experiments/validation/hinges.yaml",
    output:
        "results/validation/hinges.nc",
    log:
        "results/validation/logs/hinges.log",
    threads: 1
    params:
        source=source_hash("pipeline.stages.validate"),
    message:
        "Finding the constants of the measured samples, and predicting another (minutes)"
    shell:
        "python -m pipeline validate samples {input.description} --out {output} --log {log}"


rule validate_cycles:
    input:
        measured=lambda wildcards: calibration_inputs.measured_files("textile_morpher"),
        description="experiments/validation/morpher.yaml",
    output:
        "results/validation/morpher.nc",
    log:
        "results/validation/logs/morpher.log",
    threads: 1
    params:
        source=source_hash("pipeline.stages.validate"),
    message:
        "Measuring the load cycles of the shape morpher"
    shell:
        "python -m pipeline validate cycles {input.description} --out {output} --log {log}"


rule validate_pictures:
    input:
        measured=calibration_inputs.measured_files("escapement", "*.*")
        + calibration_inputs.measured_files("photographs", "*.png"),
        description="experiments/validation/pictures.yaml",
    output:
        "results/validation/pictures.nc",
    log:
        "results/validation/logs/pictures.log",
    threads: 1
    params:
        source=source_hash("pipeline.stages.validate"),
    message:
        "Tracking the parts of an escapement, and locating a specimen in a photograph"
    shell:
        "python -m pipeline validate pictures {input.description} --out {output} --log {log}"


rule validation_page:
    input:
        samples="results/validation/hinges.nc",
        cycles="results/validation/morpher.nc",
        pictures="results/validation/pictures.nc",
    output:
        "results/validation/prediction.svg",
        page="results/validation/index.html",
    log:
        "results/validation/logs/page.log",
    threads: 1
    params:
        folder=subpath(output.page, parent=True),
        source=source_hash(REPORTS["validation"].module),
    message:
        "Drawing the validation on measured specimens"
    shell:
        "python -m reports validation --samples {input.samples} --cycles {input.cycles}"
        " --pictures {input.pictures} --folder experiments/validation"
        " --out-dir {params.folder} --log {log}"
