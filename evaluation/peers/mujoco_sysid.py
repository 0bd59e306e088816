"""MuJoCo's system identification: one hinge with motor, back-EMF, damping, armature friction loss, a late sensor."""

from __future__ import annotations

import contextlib
import io
import math
from importlib.metadata import version
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from common import Array, Case, Model, NotOffered, Record, aligned, as_sensed, held_out_fit, main

#: Steps a time constant at least; MuJoCo integrates damping implicitly.
FINE = 10
#: m/s².
GRAVITY = 9.81

#: The drive acts through a motor. While the bridge is driven, back-EMF brakes: an actuator whose gain is proportional
#: to the speed.
MJCF = """
<mujoco>
  <option timestep="{step}" integrator="implicitfast" gravity="0 0 -{gravity}"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <inertial pos="0 0 0" mass="1e-9" diaginertia="1e-12 1e-12 1e-12"/>
      <joint name="hinge" type="hinge" axis="0 1 0" armature="{armature}" damping="{damping}" frictionloss="{friction}"
             solreffriction="{hard} 1" solimpfriction="0.99 0.999 0.001 0.5 2"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="drive" joint="hinge" gear="{drive}"/>
    <general name="brake" joint="hinge" gaintype="affine" gainprm="0 0 {brake}" biastype="none"/>
  </actuator>
  <sensor><jointvel name="speed" joint="hinge"/></sensor>
</mujoco>
"""


def spec(case: Case, model: Model, record: Record) -> Any:
    row = float(np.median(np.diff(record.t)))
    inner = row / max(1, math.ceil(row * FINE / model.time_constant()))
    text = MJCF.format(
        hard=2 * inner, step=inner, gravity=GRAVITY, armature=model.j, damping=model.b, friction=0.02 * torque(model, record),
        drive=model.kt / model.r, brake=-model.kt * model.ke / model.r,
    )  # fmt: skip
    return mujoco.MjSpec.from_string(text)


def torque(model: Model, record: Record) -> float:
    """The torque of the largest input at rest."""
    return model.kt / model.r * float(np.max(np.abs(record.u)))


def modifier(name: str) -> Any:
    """How a parameter reaches the specification."""

    def joint(specification: Any, parameter: Any) -> None:
        setattr(specification.joint("hinge"), name, parameter.value[0])

    def drive(specification: Any, parameter: Any) -> None:
        specification.actuator("drive").gear[0] = parameter.value[0]

    def brake(specification: Any, parameter: Any) -> None:
        specification.actuator("brake").gainprm[2] = -parameter.value[0]

    def damping(specification: Any, parameter: Any) -> None:
        specification.joint("hinge").damping[0] = parameter.value[0]

    return {"drive": drive, "brake": brake, "damping": damping}.get(name, joint)


def parameters(case: Case, model: Model, record: Record, friction: float) -> Any:
    """What is identified. The inertia sets the scale of the others and stays, as does the viscous part that no coast shows."""
    span = 5.0
    made = sysid.ParameterDict()

    def add(name: str, nominal: float, low: float, high: float, frozen: bool = False) -> None:
        made.add(sysid.Parameter(name, nominal, low, high, frozen=frozen, modifier=modifier(name)))

    add("drive", model.kt / model.r, model.kt / model.r / span, model.kt / model.r * span)
    if model.ke > 0.0:
        back = model.kt * model.ke / model.r
        add("brake", back, back / span, back * span)
    add("damping", model.b, model.b / span, model.b * span, frozen=model.ke > 0.0 and record.driven.min() == 1.0)
    add("frictionloss", friction * torque(model, record), 0.0, torque(model, record))
    if "gravity" in case.structure:
        most = torque(model, record) / GRAVITY
        add("pendulum", most, 1e-3 * most, 5 * most)
        made["pendulum"].modifier = hung
    tau = model.time_constant()
    made.add(sysid.Parameter("delay", 0.02 * tau, 0.0, 0.7 * tau, modifier=None))
    return made


def hung(specification: Any, parameter: Any) -> None:
    """The pendulum's m·l, kg m, as a thousandfold mass 1 mm below the hinge: the armature stands for its inertia."""
    body = specification.bodies[1]
    body.mass, body.ipos = parameter.value[0] * 1e3, [0, 0, -1e-3]


def sequences(case: Case, model: Model, record: Record, specification: Any) -> Any:
    """Every run as a trajectory from its first measured row; the speed stands at the time at which it was true."""
    compiled = specification.compile()
    speed, place = aligned(record, model), record.position()
    names, states, controls, sensors = [], [], [], []
    for number, run in enumerate(record.runs()):
        t = record.t[run] - record.t[run][0]
        if len(t) < 5:
            continue
        keep = np.flatnonzero(np.diff(t, prepend=-1.0) > 0)
        control = np.column_stack([record.u[run] * record.driven[run], record.driven[run]])[keep]
        names.append(f"run {number}")
        states.append(sysid.create_initial_state(compiled, place[run][:1], speed[run][:1], None))
        controls.append(sysid.TimeSeries.from_control_names(t[keep], control, compiled))
        sensors.append(sysid.TimeSeries.from_names(t[keep], speed[run][keep, None], compiled))
    return sysid.ModelSequences("motor", specification, names, states, controls, sensors)


def rolled(record: Record, model: Model, compiled: Any, delay: float) -> Array:
    """The free run with MuJoCo's own step; a late sensor shows what was."""
    shown, place = [np.empty_like(record.y) for _ in range(2)], record.position()
    data, step = mujoco.MjData(compiled), compiled.opt.timestep
    for run in record.runs():
        mujoco.mj_resetData(compiled, data)
        data.qpos[0], data.qvel[0] = place[run][0], record.y[run][0]
        t = record.t[run] - record.t[run][0]
        times = np.arange(0.0, t[-1] + 1.5 * step, step)
        held = np.minimum(np.searchsorted(t, times + 1e-9, side="right") - 1, len(t) - 1)
        u, driven = record.u[run] * record.driven[run], record.driven[run]
        trace = np.empty((len(times), 2))
        for k, row in enumerate(held):
            trace[k] = data.qvel[0], data.qpos[0]
            data.ctrl[:] = u[row], driven[row]
            mujoco.mj_step(compiled, data)
        for out, values in zip(shown, trace.T):
            out[run] = np.interp(t - delay, times, values)
    return as_sensed(record, model, shown[0], shown[1])


def identified(case: Case, model: Model, record: Record, friction: float) -> tuple[float, Any, Any, Any]:
    """One optimisation from a friction loss, as a part of the largest torque: cost, parameters, result, residuals."""
    start = parameters(case, model, record, friction)
    transform = sysid.SignalTransform()
    transform.delay("speed", start["delay"])
    residual = sysid.build_residual_fn(
        models_sequences=[sequences(case, model, record, spec(case, model, record))],
        modify_residual=transform.apply, n_threads=1,
    )  # fmt: skip
    with contextlib.redirect_stdout(io.StringIO()):
        found, result = sysid.optimize(start, residual, optimizer="mujoco", verbose=False, max_iters=30, x_scale="jac")
    residuals, _, _ = residual(result.x, found)
    flat = [part.ravel() for part in residuals]
    return float(sum(part @ part for part in flat)), found, result, flat


def answer(case: Case) -> dict[str, Any]:
    if case.static:
        raise NotOffered("a table of steady states is no trajectory")
    record, model = case.log(), case.model()
    starts = (0.02, 0.2) if case.group == "rig" else (0.02,)
    runs = [identified(case, model, record, friction) for friction in starts]
    _, found, result, residuals = min(runs, key=lambda run: run[0])
    _, half = sysid.calculate_intervals(residuals, result.jac)
    free = [name for name in found.keys() if not found[name].frozen]
    compiled = sysid.apply_param_modifiers(found, spec(case, model, record))
    values = {name: float(found[name].value[0]) for name in free}
    return {
        "fit": held_out_fit(case, lambda held_out: rolled(held_out, model, compiled, values["delay"])),
        "values": values,
        "intervals": in_our_words({name: (values[name], float(h)) for name, h in zip(free, half)}),
    }


def in_our_words(found: dict[str, tuple[float, float]]) -> dict[str, list[float]]:
    """95 % intervals of the numbers that the library has too."""
    words = {"frictionloss": "coulomb_friction.level_nm", "delay": "transport_delay.seconds"}
    return {words[name]: [value - half, value + half] for name, (value, half) in found.items() if name in words}


if __name__ == "__main__":
    main("mujoco.sysid", f"mujoco {version('mujoco')}", answer, warm_up=False)
