"""Containers of others: files are written by the formats' own libraries, or by hand as their makers describe them."""

import json
import logging
import math
import sys
from datetime import datetime, time

import numpy as np
import pytest

from tests.importing import imported

JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
STEP = 0.01
TIMES = STEP * np.arange(40)
JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""
TF = """geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""


def angle(joint, time):
    return 0.1 * joint + time


def ros_bag(path, frames=("tracker",)):
    """Joints every 10 ms as /joint_states, their tip, m, every 40 ms as /tf; logged 3 and 33 ms after their stamps."""
    from mcap_ros2.writer import Writer

    def header(time):
        return {"stamp": {"sec": 1700000000 + int(time), "nanosec": round(1e9 * (time % 1))}, "frame_id": "base"}

    with path.open("wb") as file:
        writer = Writer(file)
        state = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        tf = writer.register_msgdef("tf2_msgs/msg/TFMessage", TF)
        for k, time in enumerate(TIMES):
            logged = int(1.7e18) + round(1e9 * time) + 3_000_000
            position = [angle(j, time) for j in range(6)]
            message = {
                "header": header(time),
                "name": [f"{j}_joint" for j in JOINTS],
                "position": position,
                "velocity": [1.0] * 6,
                "effort": [],
            }
            writer.write_message("/joint_states", state, message, logged, logged)
            if k % 4 == 0:
                rotation = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
                transforms = [
                    {
                        "header": header(time),
                        "child_frame_id": frame,
                        "transform": {"translation": {"x": 0.5 + time, "y": 0.25, "z": 0.1}, "rotation": rotation},
                    }
                    for frame in frames
                ]
                writer.write_message("/tf", tf, {"transforms": transforms}, logged + 30_000_000, logged)
        writer.finish()


def test_ros_joints_and_transforms(tmp_path, capsys):
    pytest.importorskip("mcap_ros2")
    ros_bag(tmp_path / "bag.mcap")
    got = imported(capsys, tmp_path / "x", tmp_path / "bag.mcap")
    assert got.code == 0, got.told
    log = got.logs["bag"]
    assert log["t_s"] == pytest.approx(0.04 * np.arange(10), abs=1e-6)
    for j, name in enumerate(JOINTS):
        assert log[f"act_{name}_rad"] == pytest.approx(angle(j, log["t_s"]), abs=1e-6)
    assert log["x_mm"] == pytest.approx(500 + 1000 * log["t_s"], abs=1e-3) and set(log["y_mm"]) == {250}
    assert "joined on time" in got.told and "orientation dropped" in got.told
    assert "6 columns dropped: joint_states.velocity.shoulder_pan_joint" in got.told


def test_fields_of_topics_are_named_topic_and_field(tmp_path, capsys):
    pytest.importorskip("mcap_ros2")
    ros_bag(tmp_path / "bag.mcap", frames=("camera", "tracker"))
    got = imported(capsys, tmp_path / "x", tmp_path / "bag.mcap")
    assert got.code == 2 and "it could be tf.camera.translation.x, tf.tracker.translation.x" in got.told
    words = [w for a in "xyz" for w in ("--column", f"{a}_mm=/tf.tracker.translation.{a}")]
    got = imported(capsys, tmp_path / "x", tmp_path / "bag.mcap", *words)
    assert got.code == 0 and got.logs["bag"]["x_mm"][0] == 500


def test_json_and_protobuf_channels(tmp_path, capsys):
    mcap = pytest.importorskip("mcap.writer")
    pytest.importorskip("mcap_protobuf")
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    file = descriptor_pb2.FileDescriptorProto(name="axis.proto", package="shop", syntax="proto3")
    kind = file.message_type.add(name="Axis")
    for number, field in enumerate("xyz", 1):
        kind.field.add(name=field, number=number, type=1, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    axis = message_factory.GetMessageClass(pool.FindMessageTypeByName("shop.Axis"))
    with (tmp_path / "run.mcap").open("wb") as out:
        writer = mcap.Writer(out)
        writer.start()
        described = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
        binary = writer.register_channel("/set", "protobuf", writer.register_schema("shop.Axis", "protobuf", described))
        text = writer.register_channel("/laser", "json", writer.register_schema("p", "jsonschema", b"{}"))
        foreign = writer.register_channel("/video", "h264", 0)
        for k in range(20):
            now = 10_000_000 * k
            writer.add_message(binary, now, axis(x=0.5 * k, y=1.0, z=2.0).SerializeToString(), now)
            writer.add_message(text, now, json.dumps({"p": [0.5 * k + 0.01, 1.0, 2.0]}).encode(), now)
            writer.add_message(foreign, now, b"\x00", now)
        writer.finish()
    words = [
        w for i, a in enumerate("xyz") for w in ("--column", f"cmd_{a}_mm=set.{a}", "--column", f"{a}_mm=laser.p.{i}")
    ]
    got = imported(capsys, tmp_path / "x", tmp_path / "run.mcap", *words, config="cartesian")
    assert got.code == 0, got.told
    log = got.logs["run"]
    assert log["x_mm"] - log["cmd_x_mm"] == pytest.approx(0.01) and log["t_s"][-1] == pytest.approx(0.19)
    assert "topics in an encoding that is not read: video" in got.told


def test_tdms_waveforms_and_units(tmp_path, capsys):
    nptdms = pytest.importorskip("nptdms")
    wave = {"wf_increment": 0.002, "wf_start_offset": 0.0}
    channels = [
        nptdms.ChannelObject("drive", f"cmd_{a}", np.arange(30) * 1e-3 * i, {**wave, "unit_string": "m"})
        for i, a in enumerate("xyz", 1)
    ]
    channels += [nptdms.ChannelObject("drive", f"act_{a}", np.arange(30.0) * i, wave) for i, a in enumerate("xyz", 1)]
    channels.append(nptdms.ChannelObject("drive", "remarks", ["a", "b"]))
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment(channels)
    got = imported(capsys, tmp_path / "x", tmp_path / "run.tdms", config="cartesian")
    assert got.code == 0, got.told
    log = got.logs["run"]
    assert log["t_s"] == pytest.approx(0.002 * np.arange(30))
    assert log["cmd_y_mm"] == pytest.approx(2 * np.arange(30)) and log["act_z_mm"] == pytest.approx(3 * np.arange(30))
    assert "1 channels without numbers dropped" in got.told and "segment" not in got.told
    with nptdms.TdmsWriter(tmp_path / "cut.tdms") as writer:
        writer.write_segment(channels[:-1])
    (tmp_path / "cut.tdms").write_bytes((tmp_path / "cut.tdms").read_bytes()[:-200])
    logging.disable(logging.CRITICAL)
    try:
        got = imported(capsys, tmp_path / "y", tmp_path / "cut.tdms", config="cartesian")
    finally:
        logging.disable(logging.NOTSET)
    assert (
        "the last segment is not complete" in got.told and "WARNING" not in got.told and len(got.told.splitlines()) == 2
    )
    wild = [nptdms.ChannelObject("d", f"{k}_{a}", np.array([0.0, 1e300]), wave) for a in "xyz" for k in ("cmd", "act")]
    with nptdms.TdmsWriter(tmp_path / "wild.tdms") as writer:
        writer.write_segment(wild)
    got = imported(capsys, tmp_path / "z", tmp_path / "wild.tdms", config="cartesian")
    assert got.code == 2 and "CC422" in got.told and "1e+300 in row 2 of column d.cmd_x" in got.told


def workbook(path, rows, more=()):
    book = pytest.importorskip("openpyxl").Workbook()
    for row in rows:
        book.active.append(row)
    for title in more:
        book.create_sheet(title).append(["a", "b"])
        book[title].append([1, 2])
    book.save(path)


def test_xlsx(tmp_path, capsys):
    head = ["Time", *(f"{j} [deg]" for j in JOINTS), "X", "Y (m)", "Z"]
    row = [90.0, 0, 0, 0, 0, 0, 1.5, 0.002, "3,25"]
    stamps = [datetime(2024, 5, 1, 12, 0, 0), datetime(2024, 5, 1, 12, 0, 30)]
    workbook(tmp_path / "poses.xlsx", [[], head, *([stamp, *row] for stamp in stamps), [None] * 10], more=["notes"])
    got = imported(capsys, tmp_path / "x", tmp_path / "poses.xlsx")
    assert got.code == 0, got.told
    log = got.logs["poses"]
    assert list(log["t_s"]) == [0, 30] and log["act_shoulder_pan_rad"][0] == pytest.approx(math.pi / 2)
    assert [log[f"{a}_mm"][0] for a in "xyz"] == [1.5, 2.0, 3.25]
    assert "dropped sheets: notes" in got.told
    workbook(tmp_path / "bad.xlsx", [[], head, [stamps[0], *row], [stamps[1], "n.a.", *row[1:]]])
    got = imported(capsys, tmp_path / "y", tmp_path / "bad.xlsx")
    assert got.code == 2 and "bad.xlsx:4:2: error[CC422]: 'n.a.' in column shoulder_pan [deg]" in got.told


def test_times_of_day_in_a_workbook_are_times(tmp_path, capsys):
    rows = [[time(12, 0, second), 0.1 * second, *[0] * 5, 100.0, 200.0, 300.0] for second in (0, 20, 50)]
    workbook(tmp_path / "poses.xlsx", [["Time", *JOINTS, "X", "Y", "Z"], *rows])
    got = imported(capsys, tmp_path / "x", tmp_path / "poses.xlsx")
    assert got.code == 0, got.told
    assert list(got.logs["poses"]["t_s"]) == [0, 20, 50]


def scope(mark="\t", comma=",", shared=False, file_time=False, last="EOF\r\n"):
    """A text export of TwinCAT Scope: two times of 1 ms and 2 ms; `shared`: channels of equal times share a column."""

    def number(value):
        return f"{value:.6g}".replace(".", comma)

    def cells(label, fast, slow):
        first = [label, fast[0], fast[1]] if shared else [label, fast[0], label, fast[1]]
        return mark.join([*first, label, slow])

    start = 132959733843760000
    lines = [f"Name{mark}run", f"File{mark}run.csv", f"Starttime of export{mark}{start}{mark}Montag", "", ""]
    lines.append(cells("Name", ("Axis X.SetPos", "Axis X.ActPos"), "Laser"))
    lines.append(cells("SymbolComment", ("", ""), ""))
    lines.append(cells("Data-Type", ("REAL64", "REAL64"), "REAL64"))
    lines.append(cells("SampleTime[ms]", ("1", "1"), "2"))
    lines.append(cells("Unit", ("mm (Length)", "(None)"), "m (Length)"))
    lines.append("")
    for k in range(20):
        now, late = ((start + 10_000 * t) if file_time else t for t in (k, 2 * k))
        now, late = (str(t) for t in (now, late))
        fast = [now, number(0.5 * k), number(0.5 * k - 0.25)] if shared else [
            now, number(0.5 * k), now, number(0.5 * k - 0.25)]  # fmt: skip
        lines.append(mark.join([*fast, *([late, number(0.001 * k)] if k < 10 else [])]))
    return ("\r\n".join(lines) + "\r\n" + last).encode()


NAMED = [
    *("--column", "cmd_x_mm=Axis X.SetPos", "--column", "act_x_mm=axis x.actpos", "--column", "x_mm=Laser"),
    *(
        w
        for a in "yz"
        for log in (f"cmd_{a}_mm", f"act_{a}_mm", f"{a}_mm")
        for w in ("--column", f"{log}=Axis X.SetPos")
    ),
]


@pytest.mark.parametrize(
    "kind",
    [{}, {"shared": True}, {"mark": ";"}, {"mark": ",", "comma": "."}, {"file_time": True}, {"last": ""}],
    ids=str,
)
def test_twincat_scope(tmp_path, capsys, kind):
    (tmp_path / "run.csv").write_bytes(scope(**kind))
    got = imported(capsys, tmp_path / "x", tmp_path / "run.csv", *NAMED, config="cartesian")
    assert got.code == 0, got.told
    log = got.logs["run"]
    assert log["t_s"] == pytest.approx(0.002 * np.arange(10), abs=1e-5)
    assert log["x_mm"] == pytest.approx(np.arange(10)) and log["cmd_x_mm"] == pytest.approx(np.arange(10), abs=0.01)
    assert log["act_x_mm"] == pytest.approx(np.arange(10) - 0.25, abs=0.01)


def test_a_bad_export_of_twincat_scope_is_refused_where_it_is_bad(tmp_path, capsys):
    def said(data):
        (tmp_path / "run.csv").write_bytes(data)
        got = imported(capsys, tmp_path / "x", tmp_path / "run.csv", *NAMED, config="cartesian")
        assert got.code == 2 and got.yaml is None
        return got.told

    assert "run.csv:15:3: error[CC422]: '1,x' in column Axis X.SetPos" in said(
        scope().replace(b"\t1,5\t", b"\t1,x\t", 1)
    )
    assert "CC452" in said(scope().split(b"Name\tAxis X.SetPos")[0] + b"SymbolName\t\r\n")
    without_times = scope(shared=True).replace(b"\r\nName\tAxis", b"\r\nAxis")
    assert "CC452" in said(without_times) and "with time columns" in said(without_times)
    assert "there is no column Laser" in said(scope().replace(b"\tLaser", b"\tLasser"))


@pytest.mark.parametrize("suffix", [".mcap", ".tdms", ".xlsx"])
@pytest.mark.parametrize(
    "content", [b"", b"nonsense", b"\x89MCAP0\r\n\x01\x02", b"PK\x03\x04\x00", b"TDSm\x0e\x00\x00\x00"]
)
def test_damaged_files(tmp_path, capsys, suffix, content):
    pytest.importorskip("mcap_ros2"), pytest.importorskip("nptdms"), pytest.importorskip("openpyxl")
    (tmp_path / f"run{suffix}").write_bytes(content)
    got = imported(capsys, tmp_path / "x", tmp_path / f"run{suffix}")
    assert got.code == 2 and "CC452" in got.told and f"run{suffix}:1:1" in got.told and got.yaml is None


def test_a_cut_container(tmp_path, capsys):
    pytest.importorskip("mcap_ros2")
    ros_bag(tmp_path / "bag.mcap")
    whole = (tmp_path / "bag.mcap").read_bytes()
    (tmp_path / "bag.mcap").write_bytes(whole[: len(whole) // 2])
    got = imported(capsys, tmp_path / "x", tmp_path / "bag.mcap")
    assert got.code == 2 and "CC452" in got.told


@pytest.mark.parametrize(
    ("name", "hint"), [("a.svdx", "TwinCAT Scope"), ("a.xls", ".xlsx"), ("a.db3", "ros2 bag"), ("a.bin", "CSV")]
)
def test_what_nothing_reads_is_said_with_the_way_round(tmp_path, capsys, name, hint):
    (tmp_path / name).write_bytes(b"\x00\x01")
    got = imported(capsys, tmp_path / "x", tmp_path / name)
    assert got.code == 2 and "CC452" in got.told and hint in got.told


@pytest.mark.parametrize(
    ("name", "module", "package"),
    [("a.mcap", "mcap.reader", "mcap"), ("a.tdms", "nptdms", "npTDMS"), ("a.xlsx", "openpyxl", "openpyxl")],
)
def test_a_missing_package_is_named_with_the_command_that_brings_it(
    tmp_path, capsys, monkeypatch, name, module, package
):
    monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / name).write_bytes(b"anything")
    got = imported(capsys, tmp_path / "x", tmp_path / name)
    assert got.code == 2 and f"need the package {package}" in got.told and "pip install 'camcomp[import]'" in got.told
