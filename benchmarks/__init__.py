"""Run time, error and memory of the solvers, measured side by side: ``python -m benchmarks``.

A benchmark is a file in ``benchmarks/suites``: it names a scene, the candidates that compute the
same thing in different ways, the reference that their errors are measured against, and the targets
to be met.
"""
