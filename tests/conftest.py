from __future__ import annotations

import pytest

from chainunit.fmu.export import export
from chainunit.models import MODELS


@pytest.fixture(scope="session")
def fmus(tmp_path_factory):
    """Both FMUs, in a folder whose name has spaces."""
    folder = tmp_path_factory.mktemp("path with spaces")
    return {name: export(model, folder / f"{name}.fmu") for name, model in MODELS.items()}
