# A motor for the tests that need a program behind `exec:`: speed follows the voltage beyond a dead zone, an open bridge
# lets it coast. It tells in the files `motor.pid`, `motor.tick` and `motor.end` of its folder how it goes.
#
# motor_program.py COAST_S [TICK what]: from that tick on `die`, `hang`, `text`, `nan`, `jam`; or it meets a `wall`
# 5 rad behind where it is, and may `lose` a count in fifty besides.
import math, os, struct, sys, time

coast_s = float(sys.argv[1])
bad_tick, bad = (int(sys.argv[2]), sys.argv[3]) if len(sys.argv) > 3 else (1 << 40, "")
open("motor.pid", "w").write(str(os.getpid()))
source, sink = sys.stdin.buffer, sys.stdout.buffer
speed = angle = lost = 0.0
wall = -math.inf
supply = 12.0
bridge = 0
while len(frame := source.read(16)) == 16:
    tick, duty, bridge, dt = struct.unpack("<IfBxxxf", frame)
    volts = duty * supply
    beyond = math.copysign(max(abs(volts) - 1.0, 0.0), volts)
    target, tau = (0.0, coast_s) if bridge == 0 else (6.0 * beyond, 0.08)
    speed += (target - speed) * dt / tau
    if tick >= bad_tick and bad == "die":
        sys.exit(3)
    if tick >= bad_tick and bad == "hang":
        open("motor.hangs", "w").close()
        time.sleep(600)
    if tick >= bad_tick and bad == "jam":
        speed = 0.0
    angle += speed * dt
    if tick == bad_tick and bad in ("wall", "lose"):
        wall = angle - 5.0
    if angle < wall:
        angle, speed = wall, 0.0
    if tick >= bad_tick and bad == "lose":
        lost += 0.02 * abs(speed) * dt
    if tick >= bad_tick and bad == "text":
        sink.write(b"model loaded...\n")
    seen = math.nan if tick >= bad_tick and bad == "nan" else supply
    sink.write(struct.pack("<iffI", math.floor((angle - lost) * 2048 / math.tau), math.nan, seen, 0))
    sink.flush()
    if tick % 100 == 0:
        open("motor.tick", "w").write(str(tick))
open("motor.end", "w").write(f"bridge {bridge}")
