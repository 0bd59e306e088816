"""A motor with the friction of Canudas de Wit and others (LuGre, 1995), solved by scipy: bristles that bend, slip and hold less at speed."""
import math
from scipy.integrate import ode
import lockstep

SUPPLY = 12.0  # V
RESISTANCE = 2.0  # ohm
CONSTANT = 0.05  # Nm/A and Vs/rad
INERTIA = 8.0e-5  # kg m^2
STIFFNESS, BRISTLE, VISCOUS = 40.0, 0.06, 3.0e-5  # Nm/rad, Nms/rad, Nms/rad
COULOMB, STATIC, STRIBECK = 0.015, 0.024, 3.0  # Nm, Nm, rad/s


def derivative(_t, state, volts, closed):
    _theta, omega, bend = state
    current = closed * (volts - CONSTANT * omega) / RESISTANCE
    holds = COULOMB + (STATIC - COULOMB) * math.exp(-((omega / STRIBECK) ** 2))
    bends = omega - STIFFNESS * abs(omega) / holds * bend
    friction = STIFFNESS * bend + BRISTLE * bends + VISCOUS * omega
    return [omega, (CONSTANT * current - friction) / INERTIA, bends]


solver = ode(derivative).set_integrator("lsoda", rtol=1e-6, atol=1e-9, nsteps=10_000)
state = [0.0, 0.0, 0.0]


def motor(duty, bridge, tick_s):
    global state
    volts = duty * SUPPLY if bridge == lockstep.DRIVEN else 0.0
    solver.set_initial_value(state, 0.0).set_f_params(volts, float(bridge != lockstep.OPEN))
    state = solver.integrate(tick_s)
    return state[0], math.nan, SUPPLY


lockstep.answer(motor, 4096)
