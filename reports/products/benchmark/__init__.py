"""Shows benchmarks: run time against error, growth, ablation, optimisers."""
