from tests.e2e.conftest import fresh, undisturbed

__all__ = ["fresh", "undisturbed"]
