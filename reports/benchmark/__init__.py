"""The page on benchmarks: run time against error, growth, what is skipped, optimisers, tracking."""
