"""Runs an exported URDF in PyBullet and Drake beside `truing simulate`; what is not installed is skipped by name.

The joint is given the torque of the motor, as the comment in the file says, in every step.
"""
import argparse, math, pathlib, re, subprocess
import numpy as np

ROW_S, STEP_S = 1e-3, 1e-4


def motor(xml):
    """Torque per volt and per speed, from the comment."""
    numbers = re.search(r"torque, N m: (\S+) N m/V · u − (\S+) N m s/rad", xml.read_text())
    return float(numbers[1]), float(numbers[2])


def pybullet(xml, u):
    import pybullet as bullet
    bullet.connect(bullet.DIRECT)
    bullet.setTimeStep(STEP_S)
    body = bullet.loadURDF(str(xml), useFixedBase=True, flags=bullet.URDF_USE_INERTIA_FROM_FILE)
    # Bullet's own damping of a body, and its limit of 100 rad/s, are no part of the file.
    for link in (-1, 0):
        bullet.changeDynamics(body, link, linearDamping=0, angularDamping=0, maxJointVelocity=1e4)
    friction = bullet.getJointInfo(body, 0)[7]
    bullet.setJointMotorControl2(body, 0, bullet.VELOCITY_CONTROL, targetVelocity=0, force=friction)
    per_volt, per_speed = motor(xml)
    speed = [0.0]
    for volts in u[:-1]:
        for _ in range(round(ROW_S / STEP_S)):
            now = bullet.getJointState(body, 0)[1]
            bullet.setJointMotorControl2(body, 0, bullet.TORQUE_CONTROL, force=per_volt * volts - per_speed * now)
            bullet.stepSimulation()
        speed.append(bullet.getJointState(body, 0)[1])
    bullet.disconnect()
    return np.array(speed)


def drake(xml, u):
    from pydrake.all import AddMultibodyPlantSceneGraph, DiagramBuilder, Parser, Simulator
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=STEP_S)
    Parser(plant).AddModels(str(xml))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    joint = plant.GetJointByName("shaft")
    actuator = plant.AddJointActuator("motor", joint)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    per_volt, per_speed = motor(xml)
    friction, inertia = (float(re.search(f'{key}="([^"]+)"', xml.read_text())[1]) for key in ("friction", "izz"))
    port, speed, time = plant.get_actuation_input_port(), [0.0], 0.0
    for volts in u[:-1]:
        for _ in range(round(ROW_S / STEP_S)):
            now = joint.get_angular_rate(context)
            torque = per_volt * volts - per_speed * now
            # Drake reads no friction: what stops the shaft within the step, at most the level.
            torque -= min(max(torque + inertia * now / STEP_S, -friction), friction)
            port.FixValue(context, [torque])
            time += STEP_S
            simulator.AdvanceTo(time)
        speed.append(joint.get_angular_rate(context))
    return np.array(speed)


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("--truing", required=True)
    ask.add_argument("--folder", type=pathlib.Path, required=True)
    chosen = ask.parse_args()
    folder = chosen.folder
    for name in ("nominal", "one_viscous_friction", "one_coulomb_friction"):
        model, xml = folder / f"{name}.toml", folder / f"{name}.urdf"
        subprocess.run([chosen.truing, "export", "--to", "urdf", model, "--out", xml], check=True)
        truth = folder / f"{name}.csv"
        subprocess.run([chosen.truing, "simulate", "--model", model, "--input", folder / "input.csv", "--out", truth], check=True)
        table = np.genfromtxt(truth, delimiter=",", names=True)
        for engine in (pybullet, drake):
            try:
                speed = engine(xml, table["u_v"])
            except ImportError:
                print(f"skipped: {engine.__name__} is not installed")
                continue
            wanted = table["omega_rad_s"]
            error = 100 * math.sqrt(np.mean((speed - wanted) ** 2) / np.mean(wanted**2))
            print(f"{engine.__name__:9} {name:24} {error:.3f} %", flush=True)


main()
