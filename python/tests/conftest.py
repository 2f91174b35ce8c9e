from pathlib import Path

import numpy as np
import pytest

import meniscus

DATA = Path(__file__).parents[2] / "examples" / "data"


def ball_points(spacing=.05, radius=8):
    """A ball of particles on a lattice, (n, 3) float64."""
    steps = np.arange(-radius, radius + 1)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[(grid**2).sum(axis=1) <= radius**2] * spacing


@pytest.fixture(scope="session")
def device():
    return meniscus.default_device()


@pytest.fixture(scope="session")
def dam():
    return DATA / "dam" / "frame_015.ply"


@pytest.fixture
def points():
    return ball_points()


@pytest.fixture
def camera():
    return meniscus.Camera.look_at((0, 0, 2), (0, 0, 0), fov=40, size=(96, 72))
