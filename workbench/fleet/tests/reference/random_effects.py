"""The random-effects fits that `tests/spread.rs` compares with: `python random_effects.py > random_effects.json`.

Paule-Mandel, DerSimonian-Laird and the Hartung-Knapp standard error are those of statsmodels; statsmodels has no REML, so the restricted
likelihood is written out from Viechtbauer 2005, eq. 9, and minimised by scipy. Needs `pip install statsmodels`.
"""

import json

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import chi2, t
from statsmodels.stats.meta_analysis import combine_effects


def restricted(tau2, y, v):
    """Minus twice the restricted log-likelihood, but for a constant."""
    w = 1 / (v + tau2)
    mean = (w * y).sum() / w.sum()
    return np.log(v + tau2).sum() + np.log(w.sum()) + (w * (y - mean) ** 2).sum()


def reml(y, v):
    top = 10 * y.var()
    coarse = np.linspace(0, top, 2001)
    place = int(np.argmin([restricted(tau2, y, v) for tau2 in coarse]))
    if place == 0 and restricted(1e-9 * top, y, v) >= restricted(0, y, v):
        return 0.0
    step = coarse[1]
    bounds = (max(0.0, coarse[place] - step), coarse[place] + step)
    return minimize_scalar(restricted, bounds=bounds, args=(y, v), method="bounded", options=dict(xatol=1e-14 * top)).x


def q_profile(y, v):
    def q(tau2):
        w = 1 / (v + tau2)
        return (w * (y - (w * y).sum() / w.sum()) ** 2).sum()

    def end(level):
        wanted = chi2.ppf(level, len(y) - 1)
        return 0.0 if q(0) <= wanted else brentq(lambda tau2: q(tau2) - wanted, 0, 1e4 * y.var(), xtol=1e-15, rtol=1e-14)

    return [end(0.975) ** 0.5, end(0.025) ** 0.5]


def told(y, v, tau2, method):
    # statsmodels takes a τ² of another estimator by adding it to the variances and asking for fixed effects.
    fit = combine_effects(y, v + tau2, method_re="chi2", use_t=True)
    half = t.ppf(0.975, len(y) - 1) * fit.sd_eff_w_fe_hksj
    mean = fit.mean_effect_fe
    return dict(method=method, mean=mean, mean_interval=[mean - half, mean + half], between=tau2**0.5)


def case(seed, units, tau, sigma, few=False):
    random = np.random.default_rng(seed)
    v = (sigma * np.exp(random.normal(0, 0.7, units))) ** 2
    y = 3 + random.normal(0, tau, units) + random.normal(0, 1, units) * v**0.5
    paule_mandel = combine_effects(y, v, method_re="iterated", atol=1e-13, maxiter=1000)
    moments = combine_effects(y, v, method_re="chi2")
    fits = [
        told(y, v, reml(y, v), "reml"),
        told(y, v, max(paule_mandel.tau2, 0), "paule-mandel"),
        told(y, v, max(moments.tau2, 0), "dersimonian-laird"),
    ]
    return dict(y=list(y), v=list(v), between_interval=q_profile(y, v), fits=fits)


cases = [case(1, 12, 0.5, 0.3), case(2, 200, 1.0, 0.5), case(3, 8, 0.0, 1.0), case(4, 5, 2.0, 0.01), case(5, 30, 1e-3, 1e-3)]
print(json.dumps(cases, indent=1))
