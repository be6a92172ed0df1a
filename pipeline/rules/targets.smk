# What `snakemake TARGET` may ask for: every study with its presets, every figure of several.
for target, built in studies.targets().items():

    rule:
        name:
            target
        input:
            f"results/{built}/report/index.html",

    rule:
        name:
            f"{target}_fabrication"
        input:
            rule_inputs.product_pages(built, "fabrication"),

    rule:
        name:
            f"{target}_spectrum"
        input:
            rule_inputs.product_pages(built, "spectrum"),

    rule:
        name:
            f"{target}_sweep"
        input:
            rule_inputs.product_pages(built, "sweep"),

    rule:
        name:
            f"{target}_certificate"
        input:
            rule_inputs.product_pages(built, "certificate"),

    rule:
        name:
            f"{target}_recordings"
        input:
            recordings.recording_pages(built),


for study in sorted({built.partition("@")[0] for built in studies.targets().values()}):

    rule:
        name:
            f"{study}_gains"
        input:
            f"results/{study}/gains/index.html",

    rule:
        name:
            f"{study}_front"
        input:
            f"results/{study}/front/index.html",
