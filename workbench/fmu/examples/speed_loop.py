"""A PI speed loop around an identified motor, in Python through FMPy.

    truing export --to fmu3 result/model.extended.toml --out motor.fmu
    pip install fmpy
    python speed_loop.py motor.fmu
"""
import sys

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

PERIOD_S = 0.001
LIMIT_V = 12.0

fmu = sys.argv[1]
target = float(sys.argv[2]) if len(sys.argv) > 2 else 50.0  # rad/s

description = fmpy.read_model_description(fmu)
at = {variable.name: variable.valueReference for variable in description.modelVariables}
three = description.fmiVersion.startswith("3")
motor = (FMU3Slave if three else FMU2Slave)(
    guid=description.guid,
    unzipDirectory=fmpy.extract(fmu),
    modelIdentifier=description.coSimulation.modelIdentifier,
    instanceName="motor",
)
motor.instantiate()
if three:
    motor.enterInitializationMode(startTime=0.0)
    get, put = motor.getFloat64, motor.setFloat64
else:
    motor.setupExperiment(startTime=0.0)
    motor.enterInitializationMode()
    get, put = motor.getReal, motor.setReal
motor.exitInitializationMode()

# Gains for a motor of some tens of rad/s per volt: V per rad/s, V per rad.
proportional, integral = 0.05, 1.0
held = 0.0
for step in range(2000):
    goal = target if step < 1000 else -target
    error = goal - get([at["speed"]])[0]
    wanted = proportional * error + held
    voltage = max(-LIMIT_V, min(LIMIT_V, wanted))
    if voltage == wanted:  # No winding up while the voltage is at its limit.
        held += integral * error * PERIOD_S
    put([at["voltage"]], [voltage])
    motor.doStep(currentCommunicationPoint=step * PERIOD_S, communicationStepSize=PERIOD_S)
    if step % 100 == 99:
        speed, angle = get([at["speed"], at["angle"]])
        print(f"{(step + 1) * PERIOD_S:5.2f} s  goal {goal:6.1f}  speed {speed:7.2f} rad/s  angle {angle:7.2f} rad  {voltage:6.2f} V")
motor.terminate()
motor.freeInstance()
