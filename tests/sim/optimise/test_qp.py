"""Steps of quadratic programs are the same bits on every processor."""

import numpy as np
import pytest
import scipy.sparse as sp

from sim.core import instruction_set
from sim.optimise import qp


@pytest.mark.skipif(not instruction_set.can_pin(), reason="the processor has other instructions")
def test_solvers_are_of_the_pinned_instructions() -> None:
    """Piqp takes AVX-512 where a processor has it: another design came out there."""
    assert qp._solvers().DenseSolver.__module__ == "piqp.piqp_python_avx2"


def test_a_step_keeps_to_its_constraints() -> None:
    matrix, least = sp.csr_array(np.array([[1.0, 1.0]])), np.array([1.0])
    bounds = np.full(2, -5.0), np.full(2, 5.0)
    dense = qp.dense_step(np.diag([1.0, 3.0]), np.zeros(2), matrix, least, *bounds)
    shortest = qp.shortest_step(np.zeros(2), matrix, least, *bounds)
    assert dense is not None
    assert shortest is not None
    np.testing.assert_allclose(dense.step, [0.75, 0.25], atol=1e-8)
    np.testing.assert_allclose(dense.multipliers, [0.75], atol=1e-8)
    np.testing.assert_allclose(shortest.step, [0.5, 0.5], atol=1e-8)
