"""Measures run time, error and memory of the solvers side by side: ``python -m benchmarks``.

A suite (``benchmarks/suites``) names a scene, the methods that compute the same thing in different
ways, the reference that their errors are measured against, and the targets to be met.
"""
