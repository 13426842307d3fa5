"""Shared by all tests: modules beside this file can be imported by name."""

import pytest

from designed_products import Designed, designer


@pytest.fixture(scope="session")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Designed:
    """Whole designs by the command line, each made once a session."""
    return designer(tmp_path_factory)
