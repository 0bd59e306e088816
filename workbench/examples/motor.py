#!/usr/bin/env python3
"""A brushed DC motor as a program: `truing commission --motor "exec:python3 motor.py" --config axis.toml`.

One 16-byte little-endian frame in and one out every control tick, until the input ends:
in:  u32 tick, f32 duty, u8 bridge (0 open, 1 driven, 2 shorted), 3 zeros, f32 tick length in s
out: i32 encoder count, f32 winding current in A, f32 supply in V (NaN: not measured), u32 flags for the log
"""
import math
import struct
import sys

SUPPLY = 12.0  # V
RESISTANCE = 2.0  # ohm
KT = 0.05  # Nm/A and Vs/rad
INERTIA = 1.0e-4  # kg m^2
VISCOUS = 2.0e-5  # Nms/rad
FRICTION = 0.025  # Nm; the dead zone in volts is FRICTION * RESISTANCE / KT = 1.0 V
LIMIT = 9.5  # V at the terminals: more voltage brings no more speed
COUNTS_PER_REV = 2048
STEPS = 4  # per tick

theta, omega = 0.0, 0.0


def current(volts, bridge):
    """The winding without inductance; open: no current."""
    return 0.0 if bridge == 0 else (volts - KT * omega) / RESISTANCE


def advance(volts, bridge, dt):
    """Coulomb friction holds the shaft, or takes speed until it would turn its sign."""
    global theta, omega
    torque = KT * current(volts, bridge) - VISCOUS * omega
    free = omega + torque / INERTIA * dt
    loss = FRICTION / INERTIA * dt
    omega = math.copysign(max(abs(free) - loss, 0.0), free)
    theta += omega * dt


def main():
    read, write = sys.stdin.buffer.read, sys.stdout.buffer
    while True:
        frame = read(16)
        if len(frame) < 16:
            return  # end of input: stop
        _tick, duty, bridge, tick_s = struct.unpack("<IfB3xf", frame)
        volts = max(-LIMIT, min(LIMIT, duty * SUPPLY)) if bridge == 1 else 0.0
        for _ in range(STEPS):
            advance(volts, bridge, tick_s / STEPS)
        count = math.floor(theta / (2.0 * math.pi) * COUNTS_PER_REV)
        count = (count + 2**31) % 2**32 - 2**31
        write.write(struct.pack("<iffI", count, math.nan, SUPPLY, 0))
        write.flush()


main()
