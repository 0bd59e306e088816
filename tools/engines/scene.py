"""A picture: the servo of the data sheet beside the identified one, both driven alike. `scene.py NOMINAL.xml FOUND.xml PICTURE.png`."""
import math, os, struct, sys, zlib

os.environ.setdefault("MUJOCO_GL", "egl")
import mujoco
import numpy as np

MOMENTS_S = (0.0, 0.5, 1.0, 1.5)
SCENE = """<mujoco><visual><headlight ambient="0.5 0.5 0.5" diffuse="0.6 0.6 0.6"/></visual>
<asset><texture type="skybox" builtin="flat" rgb1="1 1 1" rgb2="1 1 1" width="8" height="8"/></asset>
<worldbody>{}</worldbody></mujoco>"""
SERVO = """<body pos="{x} 0 0"><geom type="box" pos="0 0 -0.03" size="0.035 0.025 0.02" rgba="0.25 0.25 0.28 1"/>
<body><joint axis="0 0 1"/><geom type="cylinder" size="0.014 0.012" rgba="0.6 0.6 0.6 1"/>
<geom type="box" pos="0.03 0 0.012" size="0.035 0.006 0.004" rgba="{colour} 1"/></body></body>"""


def angles(path):
    """Where the shaft is at each moment, under a slow sine of 1.6 V."""
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    at = []
    for moment in MOMENTS_S:
        while data.time < moment - 1e-9:
            data.ctrl[0] = 1.6 * math.sin(2 * math.pi * data.time / 2)
            mujoco.mj_step(model, data)
        at.append(data.qpos[0])
    return at


def png(path, image):
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    part = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", zlib.compress(rows, 9)) + part(b"IEND", b""))


nominal, found, picture = sys.argv[1:4]
servos = SERVO.format(x=-0.07, colour="0.5 0.5 0.5") + SERVO.format(x=0.07, colour="0.85 0.3 0.2")
model = mujoco.MjModel.from_xml_string(SCENE.format(servos))
data = mujoco.MjData(model)
camera = mujoco.MjvCamera()
camera.distance, camera.elevation, camera.azimuth = 0.27, -55, 90
frames = []
with mujoco.Renderer(model, 150, 250) as renderer:
    for place in zip(angles(nominal), angles(found)):
        data.qpos[:] = place
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera)
        frames.append(renderer.render())
png(picture, np.concatenate(frames, axis=1))
print([f"{a:.2f}" for a in angles(nominal)], [f"{a:.2f}" for a in angles(found)])
