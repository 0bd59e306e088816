"""A wrong number of the model file, told from the coefficients of the acceleration equation."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from common import Array, Model
from terms import Term

#: A parameter counts as wrong from here on, tolerances: the rule of docs/naming.md.
WRONG = 4.5
#: What may be wrong, as exponents of the ratio in kt/(r j), kt ke/(r j) and b/j; a speed's scale acts as the drive's gain.
EXPONENTS = {
    "drive_gain": (1, 0, 0),
    "resistance": (-1, -1, 0),
    "motor_gain": (1, 2, 0),
    "inertia": (-1, -1, -1),
    "viscous_friction": (0, 0, 1),
}


def shifted(model: Model, terms: list[Term], found: Array, covariance: Array) -> list[str]:
    """The one parameter that explains best why the coefficients are not those of the model file, if it is plainly wrong."""
    if model.fitted or model.ke == 0.0:
        return []
    names = [term.name for term in terms]
    own = [name for name in ("u", "w", "w d") if name in names]
    places = [names.index(name) for name in own]
    if not own:
        return []
    weight = np.linalg.pinv(covariance[np.ix_(places, places)], hermitian=True)
    root = np.linalg.cholesky(weight + 1e-12 * np.trace(weight) * np.eye(len(places)))
    claimed = np.array([model.kt / model.r, model.kt * model.ke / model.r, model.b]) / model.j
    powers = np.array(list(EXPONENTS.values()), dtype=float)

    def expected(logs: Array) -> Array:
        drive, back, viscous = claimed * np.exp(logs @ powers)
        terms = {"u": drive, "w": -viscous if "w d" in names else -viscous - back, "w d": -back}
        return np.array([terms[name] for name in own])

    def cost(wide: int | None) -> tuple[float, float]:
        spread = np.full(len(powers), model.tolerance)
        spread[0] = 1e-6
        if wide is not None:
            spread[wide] = 1.0
        result = least_squares(
            lambda logs: np.concatenate([root.T @ (found[places] - expected(logs)), logs / spread]), np.zeros(len(powers))
        )
        return 2 * float(result.cost), 0.0 if wide is None else float(result.x[wide])

    offers = [(*cost(place), name) for place, name in enumerate(EXPONENTS)]
    best, log_ratio, name = min(offers)
    plain = cost(None)[0] - best > np.log(1000.0) and abs(log_ratio) > np.log1p(WRONG * model.tolerance)
    return [name] if plain else []
