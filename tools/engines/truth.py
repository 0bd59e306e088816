"""What `truing simulate` says, and how far it would be moved by next to nothing."""
import re, subprocess
import numpy as np


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def simulated(truing, model, given):
    """Speed at each row of the input in the file `given`."""
    out = model.with_suffix(".csv")
    subprocess.run([truing, "simulate", "--model", model, "--input", given, "--out", out], check=True)
    return np.genfromtxt(out, delimiter=",", names=True)["omega_rad_s"]


def moved(truing, model, given, wanted):
    """What a resistance of 0.05 % more does to the speed, rms: where it is much, the case tells nothing of the engine."""
    near = model.with_name("near.toml")
    near.write_text(re.sub(r"R_ohm = (\S+)", lambda it: f"R_ohm = {float(it[1]) * 1.0005!r}", model.read_text()))
    speed = simulated(truing, near, given)
    near.unlink()
    near.with_suffix(".csv").unlink()
    return rms(speed - wanted)
