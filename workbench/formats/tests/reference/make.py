"""Writes the files of this folder, and beside each what the format's own reader finds in it.

    pip install pyarrow mcap mcap-ros2-support pyulog scipy h5py hdf5storage robotpy-wpiutil
    python make.py

`NAME.EXT.json` holds the columns by name; an empty cell is null, what is not finite a string.
"""

import csv
import datetime
import decimal
import json
import math
import random
import struct
from pathlib import Path

import h5py
import hdf5storage
import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
import scipy.io
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer as RosWriter
from pyulog import ULog
from wpiutil.log import DataLogReader

HERE = Path(__file__).parent
RIG = HERE.parents[3] / "data/rigs/frc501_drive/log.csv"
random.seed(7)


def number(value):
    """A cell as JSON holds it."""
    if value is None:
        return None
    value = float(value)
    if math.isnan(value):
        return None
    return value if math.isfinite(value) else repr(value)


def expect(name, columns):
    found = {key: [number(value) for value in values] for key, values in columns.items()}
    (HERE / f"{name}.json").write_text(json.dumps(found, separators=(",", ":")) + "\n")


def rig():
    """One run of a rig: time, volts, speed."""
    rows = list(csv.DictReader(RIG.open()))
    runs = {}
    for row in rows:
        runs.setdefault(row["run"], []).append(row)
    run = max(runs.values(), key=len)[:120]
    start = round(float(run[0]["t_s"]) * 1e6)
    stamps = [round(float(row["t_s"]) * 1e6) - start for row in run]
    return stamps, [float(row["u_v"]) for row in run], [float(row["omega_rad_s"]) for row in run]


STAMPS, VOLTS, SPEED = rig()
SECONDS = [stamp / 1e6 for stamp in STAMPS]
SERIES = {"t_s": SECONDS, "u_v": VOLTS, "omega_rad_s": SPEED}


def rig_csv():
    lines = ["t_s,u_v,omega_rad_s"]
    lines += [f"{t:.6f},{u!r},{w!r}" for t, u, w in zip(SECONDS, VOLTS, SPEED)]
    (HERE / "rig.csv").write_text("\n".join(lines) + "\n")


# --- Arrow and Parquet ---------------------------------------------------------------------------------------------------


def seconds(value):
    if isinstance(value, datetime.timedelta):
        return value / datetime.timedelta(seconds=1)
    return value


def flat(name, column, into):
    """Columns of an Arrow column, as Python reads them."""
    kind = column.type
    if pa.types.is_dictionary(kind):
        column, kind = column.cast(kind.value_type), kind.value_type
    if pa.types.is_struct(kind):
        for field in kind:
            flat(f"{name}.{field.name}", pa.array([None if row is None else row[field.name] for row in column.to_pylist()], field.type), into)
    elif pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
        rows = column.to_pylist()
        width = max((len(row) for row in rows if row is not None), default=0)
        if not 0 < width <= 64:
            return
        for k in range(width):
            cells = [row[k] if row is not None and k < len(row) else None for row in rows]
            flat(name if width == 1 else f"{name}_{k}", pa.array(cells, kind.value_type), into)
    elif pa.types.is_timestamp(kind) or pa.types.is_date(kind) or pa.types.is_time(kind):
        if pa.types.is_date(kind):
            ticks, whole = 1 / 86400, column.cast(pa.int32()).to_pylist()
        else:
            ticks = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[kind.unit]
            whole = column.cast(pa.int64() if kind.bit_width == 64 else pa.int32()).to_pylist()
        first = next((value for value in whole if value is not None), 0)
        into[name] = [None if value is None else (value - first) / ticks for value in whole]
    elif pa.types.is_duration(kind):
        into[name] = [None if value is None else value / 10**6 for value in column.cast(pa.int64()).to_pylist()]
    elif pa.types.is_string(kind) or pa.types.is_large_string(kind):
        into[name] = [None if value in (None, "", "idle") else float(value) for value in column.to_pylist()]
    elif not pa.types.is_binary(kind):
        into[name] = column.to_pylist()


def arrow_columns(table):
    into = {}
    for name in table.column_names:
        flat(name, table[name].combine_chunks(), into)
    return into


def lerobot():
    n = 36
    state = [[random.uniform(-2, 2) for _ in range(6)] for _ in range(n)]
    action = [[random.uniform(-2, 2) for _ in range(6)] for _ in range(n)]
    return pa.table(
        {
            "observation.state": pa.array(state, pa.list_(pa.float32(), 6)),
            "action": pa.array(action, pa.list_(pa.float32())),
            "timestamp": pa.array([k / 30 for k in range(n)], pa.float32()),
            "frame_index": pa.array(range(n), pa.int64()),
            "episode_index": pa.array([k // 18 for k in range(n)], pa.int64()),
            "next.done": pa.array([k % 18 == 17 for k in range(n)], pa.bool_()),
        }
    )


def kinds():
    n = 40
    holes = [None if k % 7 == 3 else k for k in range(n)]
    start = 1_700_000_000_123_456_789
    pick = lambda make: [None if k is None else make(k) for k in holes]
    return pa.table(
        {
            "stamp": pa.array([start + 1_000_001 * k for k in range(n)], pa.timestamp("ns", "UTC")),
            "i8": pa.array(pick(lambda k: k - 20), pa.int8()),
            "u64": pa.array(pick(lambda k: 2**63 + 3 * k), pa.uint64()),
            "i64": pa.array(pick(lambda k: -(2**53) - 5 * k), pa.int64()),
            "u16": pa.array(pick(lambda k: 1000 * k), pa.uint16()),
            "f16": pa.array(np.array([k / 8 for k in range(n)], np.float16)),
            "f64": pa.array([math.nan if k == 5 else math.inf if k == 9 else k / 3 for k in range(n)]),
            "price": pa.array(pick(lambda k: decimal.Decimal(k) / 100 - 3), pa.decimal128(9, 2)),
            "words": pa.array(pick(lambda k: "idle" if k == 2 else str(k / 10)), pa.string()),
            "coded": pa.array(pick(lambda k: str(k % 3)), pa.string()).dictionary_encode(),
            "motor": pa.array(
                [None if k == 4 else {"q": k / 7, "pid": {"p": k, "i": None}, "w": [k, k + 0.5]} for k in range(n)],
                pa.struct({"q": pa.float64(), "pid": pa.struct({"p": pa.int32(), "i": pa.float32()}), "w": pa.list_(pa.float64())}),
            ),
            "image": pa.array([bytes([k]) for k in range(n)], pa.binary()),
            "motor.q": pa.array(range(n), pa.int32()),
        }
    )


def times():
    n = 30
    day = datetime.date(2024, 2, 28)
    return pa.table(
        {
            "day": pa.array([day + datetime.timedelta(days=k) for k in range(n)], pa.date32()),
            "clock": pa.array([1000 * k + 7 for k in range(n)], pa.time32("ms")),
            "fine": pa.array([1000 * k + 1 for k in range(n)], pa.time64("ns")),
            "lasted": pa.array([250 * k for k in range(n)], pa.duration("us")),
            "t_ms": pa.array([None if k == 0 else 5 + 20 * k for k in range(n)], pa.timestamp("ms")),
            "large": pa.array([[k / 4] for k in range(n)], pa.large_list(pa.float32())),
            "many": pa.array([[0.0] * 65 for _ in range(n)], pa.list_(pa.float64())),
        }
    )


def arrow_files():
    tables = {"lerobot": lerobot(), "kinds": kinds(), "times": times(), "rig": pa.table(SERIES)}
    pressed = {"lerobot": "zstd", "kinds": "snappy", "times": "gzip", "rig": "lz4"}
    for name, table in tables.items():
        pq.write_table(table, HERE / f"{name}.parquet", compression=pressed[name], row_group_size=25)
        expected = arrow_columns(pq.read_table(HERE / f"{name}.parquet"))
        if name == "kinds":
            names = table.column_names
            again = pq.read_table(HERE / f"{name}.parquet").column(len(names) - 1).to_pylist()
            first = [None if row is None else row["q"] for row in table["motor"].to_pylist()]
            expected["motor.q"], expected["motor.q_2"] = first, again
        expect(f"{name}.parquet", expected)
        feather = HERE / f"{name}.feather"
        pa.feather.write_feather(table, feather, compression={"lerobot": "zstd", "rig": "uncompressed"}.get(name, "lz4"), chunksize=16)
        expect(f"{name}.feather", expected)
    with pa.OSFile(str(HERE / "lerobot.arrows"), "wb") as sink, pa.ipc.new_stream(sink, tables["lerobot"].schema) as writer:
        writer.write_table(tables["lerobot"], max_chunksize=20)
    expect("lerobot.arrows", arrow_columns(pa.ipc.open_stream(HERE / "lerobot.arrows").read_all()))


# --- Signals at their own rates --------------------------------------------------------------------------------------------


def union(streams, ticks):
    """`streams`: topic, then stamps and columns of each. One table of all stamps; messages of one time stay apart."""
    rows, keyed = set(), {}
    for topic, (stamps, columns) in streams.items():
        seen, keys = {}, []
        for stamp in stamps:
            keys.append((stamp, seen.get(stamp, 0)))
            seen[stamp] = seen.get(stamp, 0) + 1
        keyed[topic] = keys
        rows |= set(keys)
    rows = sorted(rows)
    table = {"t_s": [(stamp - rows[0][0]) / ticks for stamp, _ in rows]}
    for topic, (_, columns) in streams.items():
        for name, values in columns.items():
            cells = dict(zip(keyed[topic], values))
            table[f"{topic.lstrip('/')}{name}"] = [cells.get(row) for row in rows]
    return table


def leaves(value, path, into):
    """Numbers in a message, by path."""
    if hasattr(value, "__slots__") or hasattr(value, "__dict__") and not isinstance(value, (int, float, str, bytes)):
        for name in getattr(value, "__slots__", None) or vars(value):
            leaves(getattr(value, name), f"{path}.{name}", into)
    elif isinstance(value, dict):
        for name, inner in value.items():
            leaves(inner, f"{path}.{name}", into)
    elif isinstance(value, (list, tuple, bytes, bytearray, np.ndarray)):
        if len(value) <= 64:
            for k, inner in enumerate(value):
                leaves(inner, f"{path}_{k}", into)
    elif isinstance(value, str):
        try:
            into[path] = float(value)
        except ValueError:
            pass
    elif value is not None:
        into[path] = value


def mcap_columns(path, own_stamps):
    streams = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.message_encoding == "json":
                decoded = json.loads(message.data)
            elif channel.message_encoding == "cdr":
                decoded = DecoderFactory().decoder_for("cdr", schema)(message.data)
            else:
                continue
            found = {}
            leaves(decoded, "", found)
            stamp = message.log_time
            if own_stamps:
                stamp = int(found[".header.stamp.sec"]) * 10**9 + int(found[".header.stamp.nanosec"])
            stamps, columns = streams.setdefault(channel.topic, ([], {}))
            for name in found:
                columns.setdefault(name, [None] * len(stamps))
            stamps.append(stamp)
            for name, values in columns.items():
                values.append(found.get(name))
    return union({topic: it for topic, it in streams.items() if it[1]}, 10**9)


def json_mcap(name, topics, compression, chunk=600):
    path = HERE / name
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, chunk_size=chunk)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        ids = {topic: writer.register_channel(topic, "json", schema) for topic, _, _ in topics}
        other = writer.register_channel("/camera", "protobuf", writer.register_schema("c", "protobuf", b"x"))
        writer.add_message(other, 1, b"abc", 1)
        for topic, stamp, message in topics:
            writer.add_message(ids[topic], stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    expect(name, mcap_columns(path, False))


JOINTS = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
EVERYTHING = """# all that a definition may hold
uint8 MODE_A=1
string WORD = "a=b"
bool on
byte raw
char letter
int8 i8
int16 i16
uint32 u32
int64 i64
uint64 u64 7
float32 f32
string text
string<=8 short "x"
float64[3] three
int16[] some
uint8[] image
Inner inner
Inner[2] two
Inner[<=4] few
Empty empty
float64 last
===
MSG: test_msgs/Inner
int8 small
float64 x
string[] names
===
MSG: test_msgs/Empty
"""


def joint(k, sec=1_700_000_000):
    ns = 123_456_789 + 10_000_001 * k
    stamp = {"sec": sec + ns // 10**9, "nanosec": ns % 10**9}
    return {
        "header": {"stamp": stamp, "frame_id": "base"},
        "name": ["a", "b"],
        "position": [math.sin(k / 5), k / 3],
        "velocity": [math.cos(k / 5), math.nan if k == 3 else 0.1 * k],
        "effort": [0.5] if k % 4 == 0 else [],
    }


def everything(k):
    inner = lambda j: {"small": j - 3, "x": j / 3, "names": ["n"] * (j % 3)}
    return {
        "on": k % 2 == 0, "raw": 200, "letter": 65, "i8": -k, "i16": -300 * k, "u32": 4_000_000_000 + k,
        "i64": -(2**60) + k, "u64": 2**63 + k, "f32": k / 3, "text": str(k / 7) if k % 2 else "idle", "short": "y" * (k % 8),
        "three": [k, k + 0.1, k + 0.2], "some": list(range(k % 5)), "image": bytes(100), "inner": inner(k),
        "two": [inner(k), inner(k + 1)], "few": [inner(j) for j in range(k % 4)], "empty": {}, "last": k * 1e-3,
    }


def ros_mcap(name, topics, own_stamps, compression, chunk=900):
    path = HERE / name
    with path.open("wb") as file:
        writer = RosWriter(file, chunk_size=chunk, compression=compression)
        schemas = {}
        for k, (topic, kind, text, message) in enumerate(topics):
            if kind not in schemas:
                schemas[kind] = writer.register_msgdef(kind, text)
            stamp = 1_700_000_000_000_000_000 + 10_000_000 * k
            writer.write_message(topic, schemas[kind], message, stamp, stamp, k)
        writer.finish()
    expect(name, mcap_columns(path, own_stamps))


def mcap_files():
    messages = []
    for k in range(40):
        messages.append(("/motor", 10**9 + 10_000_000 * k, {"u": k / 3, "w": {"deg": -k, "ok": k % 2 == 0}, "q": [k, 0.5], "who": "me", "n": None}))
        if k % 4 == 1:
            messages.append(("/battery", 10**9 + 10_000_000 * k, {"volts": 12 - k / 100, "text": "7.25"}))
    json_mcap("json.mcap", messages, CompressionType.ZSTD)
    plain = [("/motor/state", 1_000 * stamp, {"u_v": u, "omega_rad_s": w}) for stamp, u, w in zip(STAMPS, VOLTS, SPEED)]
    json_mcap("rig.mcap", plain, CompressionType.LZ4, 4000)
    joints = [("/joint_states", "sensor_msgs/msg/JointState", JOINTS, joint(k)) for k in range(40)]
    ros_mcap("joints.mcap", joints, True, CompressionType.LZ4)
    mixed = []
    for k in range(30):
        mixed.append(("/joint_states", "sensor_msgs/msg/JointState", JOINTS, joint(k)))
        if k % 3 == 0:
            mixed.append(("/command", "std_msgs/msg/Float64", "float64 data", {"data": k / 9}))
        mixed.append(("/everything", "test_msgs/msg/Everything", EVERYTHING, everything(k)))
    ros_mcap("mixed.mcap", mixed, False, CompressionType.NONE, 5000)


# --- ULog ---------------------------------------------------------------------------------------------------------------


def ulog_message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog_bytes(formats, subscriptions, rows):
    out = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1000))
    out += ulog_message("B", bytes(40))
    for text in formats:
        out += ulog_message("F", text.encode())
    key = b"char[4] ver_sw"
    out += ulog_message("I", bytes([len(key)]) + key + b"abcd")
    key = b"float MC_P"
    out += ulog_message("P", bytes([len(key)]) + key + struct.pack("<f", 0.25))
    for number_, instance, name in subscriptions:
        out += ulog_message("A", struct.pack("<BH", instance, number_) + name.encode())
    for number_, body in rows:
        out += ulog_message("D", struct.pack("<H", number_) + body)
        if random.random() < 0.05:
            out += ulog_message("L", struct.pack("<BQ", ord("6"), 5) + b"hello")
            out += ulog_message("S", bytes(range(8)))
    return bytes(out)


def ulog_columns(path):
    streams = {}
    for data in ULog(str(path)).data_list:
        topic = data.name + (f"_{data.multi_id}" if data.multi_id else "")
        columns = {}
        for field in data.field_data:
            name = field.field_name.replace("[", "_").replace("]", "")
            if field.field_name != "timestamp" and field.type_str != "char" and not name.startswith("big_"):
                columns["." + name] = data.data[field.field_name].tolist()
        streams[topic] = (data.data["timestamp"].tolist(), columns)
    return union(streams, 10**6)


def ulog_files():
    formats = ["actuator:uint64_t timestamp;float[4] control;uint8_t[5] _padding0;", "esc:uint64_t timestamp;int32_t rpm;float volts;bool on;int8_t t;uint8_t[2] _padding0;"]
    rows = []
    for k in range(50):
        rows.append((0, struct.pack("<Q4f", 5000 + 4000 * k, k / 3, -k, 0.1, math.nan if k == 4 else 1)))
        if k % 2 == 0:
            for instance in (1, 2):
                rows.append((instance, struct.pack("<Qif?b", 5000 + 4000 * k + instance, -100 * k * instance, 12.5 - k / 9, k % 4 == 0, -k)))
    write = lambda name, data: ((HERE / name).write_bytes(data), expect(name, ulog_columns(HERE / name)))
    write("esc.ulg", ulog_bytes(formats, [(0, 0, "actuator"), (1, 0, "esc"), (2, 1, "esc")], rows))
    formats = ["vec:double x;int64_t y;", "pose:uint64_t timestamp;vec p;vec[2] more;uint16_t n;char[4] word;uint64_t u;int16_t s;uint32_t w;float[70] big;"]
    body = lambda k: struct.pack("<Qdqdqdq", 100 + k * k, k / 7, -(2**40) - k, 1, 2, 3, 4) + struct.pack("<H4sQhI70f", k, b"abcd", 2**63 + k, -k, 2**31 + k, *([0.5] * 70))
    write("pose.ulg", ulog_bytes(formats, [(7, 0, "pose")], [(7, body(k)) for k in range(30)]))
    rows = [(0, struct.pack("<Qdd", stamp + 10**6, u, w)) for stamp, u, w in zip(STAMPS, VOLTS, SPEED)]
    write("rig.ulg", ulog_bytes(["motor:uint64_t timestamp;double u_v;double omega_rad_s;"], [(0, 0, "motor")], rows))


# --- MATLAB ---------------------------------------------------------------------------------------------------------------


def mat_leaves(name, value, into):
    if isinstance(value, np.ndarray) and value.dtype.names:
        if value.size == 1:
            for field in value.dtype.names:
                mat_leaves(f"{name}.{field}", value[field].item(), into)
    elif isinstance(value, dict):
        for field, inner in value.items():
            mat_leaves(f"{name}.{field}", inner, into)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        into[name] = value


def mat_columns(variables, rows):
    found, columns = {}, {}
    for name, value in variables.items():
        if not name.startswith("__"):
            mat_leaves(name, value, found)
    for name, value in found.items():
        value = np.atleast_2d(np.squeeze(value))
        if value.shape[0] == rows and value.shape[1] <= 64:
            value = value.T
        if value.shape[1] != rows or value.shape[0] > 64:
            continue
        for k, row in enumerate(value):
            columns[name if len(value) == 1 else f"{name}_{k}"] = row.tolist()
    return columns


def mat_files():
    n = 50
    t = np.arange(n) * 0.01
    motors = {
        "t": t.reshape(-1, 1), "u": np.round(12 * np.sin(t)).astype(np.int8), "w": (100 * t).astype(np.float32),
        "count": (np.arange(n) * 1000).astype(np.uint32), "on": t > 0.2, "whole": np.arange(n, dtype=np.float64),
        "big": (np.arange(n) - 2**60).astype(np.int64), "holes": np.where(t == 0.05, np.nan, t), "gain": 3.5, "title": "rig", "state": np.random.default_rng(1).normal(size=(n, 3)),
        "lying": np.random.default_rng(2).normal(size=(2, n)), "other": np.arange(7), "cells": np.array([1, "a"], dtype=object), "z": t + 1j,
    }
    nested = {"data": {"time": t, "motor": {"u": 12 * t, "w": t**2, "name": "x", "Kt": 0.1}, "note": "abc"}, "extra": np.arange(n)}
    for name, variables, pressed in (("motors.mat", motors, False), ("pressed.mat", motors, True), ("nested.mat", nested, True), ("rig.mat", {k: np.array(v) for k, v in SERIES.items()}, True)):
        scipy.io.savemat(HERE / name, variables, do_compression=pressed, oned_as="column")
        expect(name, mat_columns(scipy.io.loadmat(HERE / name), len(t) if name != "rig.mat" else len(SECONDS)))
    plain = {key: value for key, value in motors.items() if key not in ("z", "cells")}
    options = dict(format="7.3", oned_as="column", store_python_metadata=False, matlab_compatible=True)
    for name, variables in (("motors73.mat", plain), ("nested73.mat", nested), ("rig73.mat", {k: np.array(v) for k, v in SERIES.items()})):
        (HERE / name).unlink(missing_ok=True)
        hdf5storage.savemat(str(HERE / name), variables, structured_numpy_ndarray_as_struct=True, **options)
        expect(name, mat_columns(h5_variables(HERE / name), len(t) if name != "rig73.mat" else len(SECONDS)))


def h5_variables(path):
    def node(item):
        if isinstance(item, h5py.Group):
            return {name: node(inner) for name, inner in item.items() if not name.startswith("#")}
        wanted = item.attrs.get("MATLAB_class", b"") not in (b"char", b"cell")
        return item[()].T if wanted and item.dtype.kind in "fiub" else "text"

    with h5py.File(path) as file:
        return node(file)


# --- FRC -----------------------------------------------------------------------------------------------------------------


def wpilog_columns(path):
    streams, entries = {}, {}
    for record in DataLogReader(str(path)):
        if record.isStart():
            data = record.getStartData()
            entries[data.entry] = (data.name, data.type)
        elif not record.isControl():
            name, kind = entries[record.getEntry()]
            found = wpilog_values(record, kind)
            if found is None:
                continue
            stamps, columns = streams.setdefault(name, ([], {}))
            for key in found:
                columns.setdefault(key, [None] * len(stamps))
            stamps.append(record.getTimestamp())
            for key, values in columns.items():
                values.append(found.get(key))
    return union(streams, 10**6)


def wpilog_values(record, kind):
    plain = {"double": "getDouble", "float": "getFloat", "int64": "getInteger", "boolean": "getBoolean"}
    if kind in plain:
        return {"": getattr(record, plain[kind])()}
    if kind.endswith("[]") and kind[:-2] in plain:
        values = getattr(record, plain[kind[:-2]] + "Array")()
        return {f"_{k}": value for k, value in enumerate(values)}
    if kind == "string":
        try:
            return {"": float(record.getString())}
        except ValueError:
            return None
    return None


class WpiWriter:
    """The few records that are needed, after the specification of the format."""

    def __init__(self):
        self.out, self.ids = bytearray(b"WPILOG" + struct.pack("<HI", 0x100, 3) + b"{ }"), 0

    def record(self, entry, stamp, body):
        width = lambda value: max(1, (value.bit_length() + 7) // 8)
        widths = [width(entry), width(len(body)), width(stamp)]
        self.out.append(widths[0] - 1 | widths[1] - 1 << 2 | widths[2] - 1 << 4)
        for value, count in zip((entry, len(body), stamp), widths):
            self.out += value.to_bytes(count, "little")
        self.out += body

    def start(self, name, kind):
        self.ids += 1
        text = lambda word: struct.pack("<I", len(word)) + word.encode()
        self.record(0, 1, struct.pack("<BI", 0, self.ids) + text(name) + text(kind) + text(""))
        return self.ids

    def put(self, entry, stamp, code, *values):
        self.record(entry, stamp, struct.pack(f"<{len(values)}{code}", *values))


def wpilog_file(name, fill):
    log = WpiWriter()
    fill(log)
    (HERE / name).write_bytes(bytes(log.out))
    expect(name, wpilog_columns(HERE / name))


def wpilog_files():
    def drive(log):
        volts, speed, count = log.start("/drive/volts", "double"), log.start("/drive/speed", "float"), log.start("count", "int64")
        on, state, pose = log.start("NT:/on", "boolean"), log.start("state", "string"), log.start("pose", "struct:Pose2d")
        for k in range(60):
            log.put(volts, 1000 + 20_000 * k, "d", k / 3)
            if k % 2:
                log.put(speed, 1000 + 20_000 * k, "f", k / 7)
                log.put(count, 1003 + 20_000 * k, "q", -(2**40) * k)
            log.put(on, 2**33 + k, "B", k % 5 == 0)
            log.record(state, 7000, b"quasistatic-forward")
            log.put(pose, 1000 + k, "d", 1, 2, 3)
        log.record(0, 9, struct.pack("<BI", 1, count))
        log.put(log.start("count", "int64"), 2**33, "q", 5)

    def lists(log):
        modules, ints, singles = log.start("modules", "double[]"), log.start("ints", "int64[]"), log.start("singles", "float[]")
        flags, text = log.start("flags", "boolean[]"), log.start("text", "string")
        for k in range(40):
            log.put(modules, 500 * k + 1, "d", *[k, k / 3, -k / 9][: 1 + k % 3])
            log.put(ints, 500 * k + 1, "q", k, -k)
            log.put(singles, 500 * k + 1, "f", *[k / 7] * 4)
            log.put(flags, 500 * (k // 2) + 1, "B", True, False, k % 2 == 0)
            log.record(text, 900 * k + 1, str(k / 10).encode())

    def rig_log(log):
        volts, speed = log.start("u_v", "double"), log.start("omega_rad_s", "double")
        for stamp, u, w in zip(STAMPS, VOLTS, SPEED):
            log.put(volts, stamp + 77, "d", u)
            log.put(speed, stamp + 77, "d", w)

    wpilog_file("drive.wpilog", drive)
    wpilog_file("lists.wpilog", lists)
    wpilog_file("rig.wpilog", rig_log)


TESTS = ["fast-backward", "fast-forward", "slow-backward", "slow-forward"]


def sysid_files():
    def save(name, kind, units, factor, tests, names, scaled, unit=1.0):
        data = {**tests, "sysid": True, "test": kind, "units": units, "unitsPerRotation": factor}
        path = HERE / name
        path.write_text(json.dumps(data, separators=(",", ":")))
        data = json.loads(path.read_text())
        columns = {key: [] for key in ["run", *names]}
        for run, test in enumerate(test for test in data if "-" in test):
            for row in data[test]:
                columns["run"].append(run)
                for key, value in zip(names, row):
                    columns[key].append(value * (factor * unit) if key in scaled else value)
        expect(name, columns)

    rows = lambda width: [[k / 50] + [random.uniform(-9, 9) for _ in range(width - 1)] for k in range(12)]
    four = lambda: {test: rows(4) for test in TESTS}
    save("arm.json", "Arm", "Degrees", 360.0, four(), ["t_s", "u_v", "theta_deg", "omega_deg_s"], {"theta_deg", "omega_deg_s"})
    save("elevator.json", "Elevator", "Inches", 5.5, four(), ["t_s", "u_v", "q_m", "v_m_s"], {"q_m", "v_m_s"}, 0.0254)
    drive = ["t_s", "left_voltage", "right_voltage", "left_position", "right_position", "left_velocity", "right_velocity", "angle", "angular_rate"]
    save("drivetrain.json", "Drivetrain", "Meters", 0.478, {test: rows(9) for test in TESTS}, drive, set(drive[3:7]))
    run = [[t, u, 0.0, w] for t, u, w in zip(SECONDS, VOLTS, SPEED)]
    save("rig.json", "Simple", "Radians", 1, {"quasistatic-forward": run}, ["t_s", "u_v", "theta_rad", "omega_rad_s"], set())


rig_csv()
arrow_files()
mcap_files()
ulog_files()
mat_files()
wpilog_files()
sysid_files()
print(sum(path.stat().st_size for path in HERE.iterdir()) // 1000, "kB")
