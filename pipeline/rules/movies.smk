# The paper's movies, of the studies that there are; every study in full, with its recordings.
MOVIES = studies.present(paper_movies())


rule movie:
    input:
        datasets=lambda wildcards: rule_inputs.datasets_of(MOVIES[wildcards.movie]),
        comparisons=lambda wildcards: rule_inputs.comparisons_of(
            MOVIES[wildcards.movie]
        ),
    output:
        "results/movies/{movie}.mp4",
    log:
        "results/logs/movie_{movie}.log",
    threads: 1
    params:
        problems=lambda wildcards: [study.problem for study in MOVIES[wildcards.movie]],
        problem=lambda wildcards: rule_inputs.hashes_of(MOVIES[wildcards.movie]),
        source=source_hash(REPORTS["movie"].module),
    message:
        "Drawing movie {wildcards.movie}"
    shell:
        "python -m reports movie --problems {params.problems} --results results"
        " --comparisons {input.comparisons} --out {output} --log {log}"


rule movies:
    input:
        expand("results/movies/{movie}.mp4", movie=MOVIES),
