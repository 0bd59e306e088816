"""An arm on a gear motor in MuJoCo: `dcmotor`, dry and viscous loss of the gear, gravity. The encoder sits at the motor."""
import math
import mujoco
import lockstep

SUPPLY = 12.0  # V
GEAR = 20.0
STEP_S = 0.25e-3
# At the arm: 0.2 Nm of gear loss and up to 0.12 Nm of weight are 0.57 V and 0.34 V at the terminals.
ARM = f"""<mujoco>
  <option timestep="{STEP_S}" integrator="implicitfast"/>
  <worldbody><body>
    <joint name="arm" axis="0 1 0" armature="0.004" damping="0.002" frictionloss="0.2" solreffriction="0.002 1"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.14" size="0.008" mass="0.06"/>
    <geom type="sphere" pos="0 0 -0.14" size="0.012" mass="0.06"/>
  </body></worldbody>
  <actuator><dcmotor name="motor" joint="arm" gear="{GEAR}" resistance="2" motorconst="0.035 0.035" inductance="0.0004 0"/></actuator>
</mujoco>"""

model = mujoco.MjModel.from_xml_string(ARM)
data = mujoco.MjData(model)


def motor(duty, bridge, tick_s):
    # An open bridge: the group of the motor exerts nothing.
    model.opt.disableactuator = 1 if bridge == lockstep.OPEN else 0
    data.ctrl[0] = duty * SUPPLY if bridge == lockstep.DRIVEN else 0.0
    for _ in range(round(tick_s / STEP_S)):
        mujoco.mj_step(model, data)
    return GEAR * data.qpos[0], math.nan, SUPPLY


lockstep.answer(motor, 2048)
