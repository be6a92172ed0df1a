# The paper's movies, of the studies that there are; every study in full, with its recordings.
rule movie:
    input:
        datasets=screened,
        comparisons=screened_comparisons,
    output:
        "results/movies/{movie}.mp4",
    log:
        "results/logs/movie_{movie}.log",
    threads: 1
    params:
        problems=lambda wildcards: [
            study.problem for study in movies()[wildcards.movie]
        ],
        problem=screened_hashes,
        source=source_hash("reports.movie.build"),
    message:
        "Drawing movie {wildcards.movie}"
    shell:
        "python -m reports.movie.build --problems {params.problems} --results results"
        " --comparisons {input.comparisons} --out {output} --log {log}"


rule movies:
    input:
        expand("results/movies/{movie}.mp4", movie=movies()),
