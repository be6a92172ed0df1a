# A recording that was filmed is tracked from its own folder; one that is virtual is rendered first,
# of a specimen of its own where it describes one. Of all that follows a design this takes longest,
# and tracking waits for it: it begins before copies and sweeps.
rule virtual_specimen:
    input:
        recording="experiments/{name}/recordings/{recording}.yaml",
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        "results/{name}{preset}/recordings/{recording}_specimen.nc",
    log:
        "results/{name}{preset}/logs/specimen_{recording}.log",
    priority: 1
    threads: 1
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("virtual_specimen"),
        source=source_hash("pipeline.stages.virtual_specimen"),
    message:
        "Simulating the specimen of {wildcards.recording} of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline virtual_specimen {input.recording} {params.study} --design {input.design}"
        " --out {output} --log {log}"


rule film_weigh:
    input:
        recording="experiments/{name}/recordings/{recording}.yaml",
        response=recordings.filmed,
    output:
        "results/{name}{preset}/recordings/{recording}_load.csv",
    log:
        "results/{name}{preset}/logs/weigh_{recording}.log",
    threads: 1
    params:
        source=source_hash("pipeline.stages.film"),
    message:
        "Weighing {wildcards.recording} of {wildcards.name}{wildcards.preset} (synthetic)"
    shell:
        "python -m pipeline film weigh {input.recording} --response {input.response}"
        " --out {output} --log {log}"


rule film_render:
    input:
        recording="experiments/{name}/recordings/{recording}.yaml",
        design="results/{name}{preset}/design.nc",
        response=recordings.filmed,
    output:
        video="results/{name}{preset}/recordings/{recording}.mp4",
        recording="results/{name}{preset}/recordings/{recording}.yaml",
        truth="results/{name}{preset}/recordings/{recording}_truth.nc",
    log:
        "results/{name}{preset}/logs/render_{recording}.log",
    priority: 1
    threads: 1
    params:
        source=source_hash("pipeline.stages.film"),
    message:
        "Rendering {wildcards.recording} of {wildcards.name}{wildcards.preset} (synthetic)"
    shell:
        "python -m pipeline film render {input.recording} --design {input.design}"
        " --response {input.response} --out {output.video} --log {log}"


rule track:
    input:
        unpack(recordings.tracked),
    output:
        track="results/{name}{preset}/recordings/{recording}/track.nc",
        table="results/{name}{preset}/recordings/{recording}/track.csv",
    log:
        "results/{name}{preset}/logs/track_{recording}.log",
    threads: 2
    params:
        source=source_hash("pipeline.stages.track"),
    message:
        "Tracking {wildcards.recording} of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline track {input.recording} --design {input.design:q}"
        " --out {output.track} --no-report --log {log}"


rule track_report:
    input:
        unpack(recordings.tracked),
        track="results/{name}{preset}/recordings/{recording}/track.nc",
    output:
        page="results/{name}{preset}/recordings/{recording}/index.html",
        overlay="results/{name}{preset}/recordings/{recording}/overlay.mp4",
    log:
        "results/{name}{preset}/logs/track_report_{recording}.log",
    threads: 1
    params:
        folder=subpath(output.page, parent=True),
        source=source_hash(REPORTS["tracking"].module),
    message:
        "Drawing overlay and quality of {wildcards.recording} of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports tracking --track {input.track} --video {input.video:q}"
        " --out-dir {params.folder} --log {log}"
