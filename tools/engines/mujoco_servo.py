"""An exported servo in MuJoCo, driven row by row."""
import importlib.util, math
import mujoco
import numpy as np


class Servo:
    """parts: into how many the advised step is divided. A row that is no multiple of the step has the next shorter step that fits."""

    def __init__(self, xml, row_s, parts=1):
        mujoco.set_mjcb_control(None)
        mujoco.set_mjcb_act_bias(None)
        self.model = mujoco.MjModel.from_xml_path(str(xml))
        self.steps = math.ceil(row_s / self.model.opt.timestep - 1e-6) * parts
        self.model.opt.timestep = row_s / self.steps
        self.data = mujoco.MjData(self.model)
        path = xml.with_name(xml.stem + "_helper.py")
        self.helper = None
        if path.exists():
            spec = importlib.util.spec_from_file_location("helper", path)
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            self.helper = module.install(self.model)
        self.read = getattr(self.helper, "read", None)
        self.motor = self.model.actuator("motor").id
        self.places = [self.model.sensor(name).adr[0] for name in ("speed", "angle")]

    def driven(self, volts):
        """Holds each of the inputs for one row. At the start of each row: the speed and angle shown, the motor's torque, and its current as
        far as the helper knows it, else no number."""
        rows = [self.shown()]
        for level in volts[:-1]:
            self.data.ctrl[0] = level
            for _ in range(self.steps):
                mujoco.mj_step(self.model, self.data)
            rows.append(self.shown())
        return np.array(rows).T

    def shown(self):
        torque = self.data.actuator_force[self.motor]
        current = getattr(self.helper, "current", np.nan)
        # Sensors are those of the start of a step; this brings them up to its end.
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        mujoco.mj_sensorPos(self.model, self.data)
        mujoco.mj_sensorVel(self.model, self.data)
        speed, angle = (self.data.sensordata[place] for place in self.places)
        return self.read(self.data) if self.read else speed, angle, torque, current
