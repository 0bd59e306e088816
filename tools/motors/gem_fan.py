"""A permanently excited motor with a fan in gym-electric-motor: its converter, its motor, its load with friction and air drag, and a
supply that sags."""
import math
import numpy as np
from gym_electric_motor.physical_systems import converters, electric_motors, mechanical_loads, solvers, voltage_supplies
from gym_electric_motor.physical_systems.physical_systems import DcMotorSystem
import lockstep

SUPPLY = 24.0  # V
TICK_S = 1e-3
# 0.03 Nm of friction are 0.9 V at the terminals; the air takes 0.04 Nm at 150 rad/s.
LOAD = {"a": 0.03, "b": 2.0e-5, "c": 1.8e-6, "j_load": 6.0e-5}

system = DcMotorSystem(
    converter=converters.ContFourQuadrantConverter(),
    motor=electric_motors.DcPermanentlyExcitedMotor(
        motor_parameter={"r_a": 3.0, "l_a": 1.5e-3, "psi_e": 0.1, "j_rotor": 4.0e-5},
        limit_values={"omega": 400.0, "i": 12.0, "u": SUPPLY, "torque": 2.0},
    ),
    load=mechanical_loads.PolynomialStaticLoad(load_parameter=LOAD, limits={"omega": 400.0}),
    supply=voltage_supplies.RCVoltageSupply(u_nominal=SUPPLY, supply_parameter={"R": 0.3, "C": 0.02}),
    ode_solver=solvers.ScipyOdeSolver("dopri5", rtol=1e-6, atol=1e-8),
    tau=TICK_S,
)
system.reset()
solver, load = system._ode_solver, system.mechanical_load
angle = 0.0


def coast(tick_s):
    """An open bridge, which its converters lack: no current, and the load's own equation."""
    omega, parts = solver.y[0], 10
    for _ in range(parts):
        omega += load.mechanical_ode(solver.t, np.array([omega]), 0.0)[0] * tick_s / parts
    system.supply.get_voltage(system._t, 0.0)
    system._t += tick_s
    solver.set_initial_value(np.array([omega, 0.0]), system._t)


def motor(duty, bridge, tick_s):
    global angle
    before = solver.y[0]
    if bridge == lockstep.OPEN:
        coast(tick_s)
    else:
        system.simulate([duty if bridge == lockstep.DRIVEN else 0.0])
    angle += (before + solver.y[0]) / 2.0 * tick_s
    return angle, math.nan, float(system.supply._u_sup[0])


lockstep.answer(motor, 4096)
