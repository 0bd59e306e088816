"""The lock-step of `--motor exec:` for the motors beside this file: one 16-byte little-endian frame in and one out every control tick."""
import math
import struct
import sys

OPEN, DRIVEN, SHORTED = 0, 1, 2


def answer(motor, counts_per_rev):
    """Until the input ends. `motor(duty, bridge, tick_s)` passes one tick; it returns angle in rad, current in A, supply in V."""
    read, write = sys.stdin.buffer.read, sys.stdout.buffer
    while len(frame := read(16)) == 16:
        _tick, duty, bridge, tick_s = struct.unpack("<IfB3xf", frame)
        angle, current, supply = motor(duty, bridge, tick_s)
        count = math.floor(angle / (2.0 * math.pi) * counts_per_rev)
        count = (count + 2**31) % 2**32 - 2**31
        write.write(struct.pack("<iffI", count, current, supply, 0))
        write.flush()
