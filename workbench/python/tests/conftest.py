"""What several tests need."""

from pathlib import Path

import pytest
import truing

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def root() -> Path:
    """The project's folder."""
    return ROOT


@pytest.fixture(scope="session")
def rig(root: Path) -> Path:
    """A robot's shooter wheel: the motor stands below some voltage."""
    return root / "data" / "rigs" / "spectrum_shooter"


@pytest.fixture(scope="session")
def found(rig: Path) -> truing.Result:
    """What is found on it, by files."""
    return truing.gap(rig / "model.toml", rig / "log.csv", holdout=[rig / "holdout.csv"])


@pytest.fixture(scope="session")
def case() -> truing.Case:
    """A drawn case that is small."""
    return next(truing.cases("single", 1, seed=3, rows=900))
