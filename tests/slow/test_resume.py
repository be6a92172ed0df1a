"""Builds that are ended at every moment of their work, one after the other."""

from tests.e2e.checkout import Checkout
from tests.e2e.test_resume import ENDS, check_ends


def test_no_end_at_any_moment_changes_the_results(undisturbed: Checkout, fresh: Checkout) -> None:
    check_ends(ENDS, undisturbed, fresh)
