# The paper's movies, of the studies that there are; every study in full, with its recordings.
rule movie:
    input:
        datasets=lambda wildcards: rule_inputs.datasets_of(
            studies.movies()[wildcards.movie]
        ),
        comparisons=lambda wildcards: rule_inputs.comparisons_of(
            studies.movies()[wildcards.movie]
        ),
    output:
        "results/movies/{movie}.mp4",
    log:
        "results/logs/movie_{movie}.log",
    threads: 1
    params:
        problems=lambda wildcards: [
            study.problem for study in studies.movies()[wildcards.movie]
        ],
        problem=lambda wildcards: rule_inputs.hashes_of(
            studies.movies()[wildcards.movie]
        ),
        source=source_hash("reports.products.movie.build"),
    message:
        "Drawing movie {wildcards.movie}"
    shell:
        "python -m reports.products.movie.build --problems {params.problems} --results results"
        " --comparisons {input.comparisons} --out {output} --log {log}"


rule movies:
    input:
        expand("results/movies/{movie}.mp4", movie=studies.movies()),
