"""Checks what other programs get: the documented snippets run, the reader gives the bits of the tables, viewers open the
export. Run by .ci/run with the packages of requirements.txt:

    python3 python/check.py target/release/chainmail
"""

import csv
import importlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
from google.protobuf import descriptor_pb2
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import chainmail_log

ROOT = pathlib.Path(__file__).resolve().parent.parent


def run(*arguments, cwd=None, **environment):
    environment = {**os.environ, **environment}
    done = subprocess.run([str(part) for part in arguments], cwd=cwd, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def expect(what, got, expected):
    if got != expected:
        sys.exit(f"{what}: {got}, where {expected} was expected")
    print(f"{what}: {got}")


def check_snippets(log, pull, folder):
    """The Python of docs/log-format.md, as it stands there."""
    snippets = re.findall(r"```python\n(.*?)```", (ROOT / "docs/log-format.md").read_text(), re.S)
    expect("documented snippets", len(snippets), 2)
    states = run(sys.executable, "-c", snippets[0], log).splitlines()
    last = states[-1].split()
    final = list(chainmail_log.states(log))[-1]
    expect("snippet, states", len(states), sum(1 for _ in chainmail_log.states(log)))
    expect("snippet, last height", float(last[2]), float(final.bodies["position_m"][:, 1].min()))
    run(sys.executable, "-c", snippets[1], pull, cwd=folder)
    expect("snippet, picture", (folder / "pull.png").read_bytes()[1:4], b"PNG")


def check_reader(chainmail, log, folder):
    """Every number of the states and records is that of the tables, bit for bit."""
    run(chainmail, "export", log, "--format", "csv", "--out", folder / "tables")
    rows = lambda name: list(csv.reader((folder / "tables" / name).open()))[1:]
    bodies, contacts = iter(rows("bodies.csv")), iter(rows("contacts.csv"))
    count = histories = 0
    for state in chainmail_log.states(log):
        for body in state.bodies:
            row = next(bodies)
            numbers = np.array(row[4:], float)
            assert int(row[0]) == state.header["step"], row
            assert numbers.tobytes() == b"".join(body[field].tobytes() for field in body.dtype.names), row
            count += 1
        for contact in state.contacts:
            row = next(contacts)
            assert np.array(row[7:], float).tobytes() == contact["spring_m"].tobytes(), row
            histories += 1
    expect("body rows beyond the states", next(bodies, None), None)
    expect("contact rows beyond the states", next(contacts, None), None)
    records = chainmail_log.steps(log)
    for row, record in zip(rows("steps.csv"), records, strict=True):
        assert float(row[4]) == record["kinetic_energy_j"] and row[-1] == record["chained_hash"], row
    summary = json.loads(run(chainmail, "info", log, "--json"))
    expect("contact histories are there", histories > 0, True)
    expect("step records", len(records), summary["steps"] + 1)
    expect("bodies of all states", count, summary["states"] * (summary["rings"] + summary["spheres"]))


def check_viewer(chainmail, log, folder):
    """The viewers' file: the published schemas read it, and nothing in it is unknown to them."""
    path = folder / "viewer.mcap"
    run(chainmail, "export", log, "--format", "viewer", "--out", path)
    states = {int(round(float(s.header["sim_time_s"]) * 1e9)): s for s in chainmail_log.states(log)}
    counts, poses = {}, 0
    with path.open("rb") as file:
        reader = make_reader(file)
        for schema in reader.get_summary().schemas.values():
            if schema.encoding == "protobuf":
                check_schema(schema)
        for schema, channel, message, decoded in decoded_messages(reader):
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            if schema.encoding == "protobuf":
                published = published_type(schema.name)()
                published.ParseFromString(message.data)
                # What the published type does not know would be kept apart, and lost here.
                published.DiscardUnknownFields()
                assert published.ByteSize() == len(message.data), f"{channel.topic}: unknown fields"
            if channel.topic == "/rings/poses":
                state = states[message.log_time]
                for pose, body in zip(decoded.poses, state.bodies):
                    got = [pose.position.x, pose.position.y, pose.position.z]
                    assert got == body["position_m"].tolist(), (message.log_time, got)
                    poses += 1
    summary = json.loads(run(chainmail, "info", log, "--json"))
    expect("viewer, pictures", counts["/camera/image"], summary["frames"])
    expect("viewer, calibrations", counts["/camera/calibration"], summary["frames"])
    expect("viewer, metrics", counts["/metrics"], summary["steps"] + 1)
    expect("viewer, scenes", counts["/scene"], 1)
    print(f"viewer, poses compared: {poses}")
    return path


def decoded_messages(reader):
    """Messages with JSON ones decoded, too."""
    factory = DecoderFactory()
    for schema, channel, message in reader.iter_messages():
        if schema.encoding == "protobuf":
            yield schema, channel, message, factory.decoder_for("protobuf", schema)(message.data)
        else:
            yield schema, channel, message, json.loads(message.data)


def published_type(name):
    short = name.removeprefix("foxglove.")
    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{short}_pb2"), short)


def check_schema(schema):
    """Each field that the file describes is, in name, number and type, one of the published schema."""
    files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
    for message in (message for file in files.file if file.package == "foxglove" for message in file.message_type):
        published = descriptor_pb2.DescriptorProto()
        published_type(f"foxglove.{message.name}").DESCRIPTOR.CopyToProto(published)
        known = {(f.name, f.number, f.type, f.label, f.type_name) for f in published.field}
        ours = {(f.name, f.number, f.type, f.label, f.type_name) for f in message.field}
        assert ours <= known, f"{message.name}: {ours - known}"
    print(f"schema {schema.name}: as published")


def check_rerun(viewer, folder):
    """Rerun opens the file and finds what it has pictures for."""
    rrd = folder / "viewer.rrd"
    # Rerun tells its makers how it is used unless it is asked not to; nobody's own settings are changed for that.
    home = {"XDG_CONFIG_HOME": str(folder), "XDG_DATA_HOME": str(folder)}
    rerun = lambda *arguments: run(sys.executable, "-m", "rerun", *arguments, **home)
    rerun("analytics", "disable")
    rerun("mcap", "convert", viewer, "-o", rrd)
    text = rerun("rrd", "print", rrd)
    for component in ("EncodedImage", "InstancePoses3D", "Transform3D", "Pinhole"):
        found = component in text
        expect(f"rerun, {component}", found, True)


def main(chainmail):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        short = ["--set", "time.duration_s=0.3", "--set", "render.width_px=64", "--set", "render.height_px=36"]
        short += ["--set", "material.steel.friction_coefficient=0.2"]
        run(chainmail, "run", ROOT / "scenes/two-rings.toml", "--out", folder / "run", *short)
        log = folder / "run/log.mcap"
        pull = ["--set", "time.duration_s=0.02", "--no-render"]
        run(chainmail, "run", ROOT / "scenes/pull.toml", "--out", folder / "pull", *pull)
        check_snippets(log, folder / "pull/log.mcap", folder)
        check_reader(chainmail, log, folder)
        script = ROOT / "python/energy_and_hang.py"
        print(run(sys.executable, script, log, folder / "energy.png").strip())
        expect("energy_and_hang.py, picture", (folder / "energy.png").read_bytes()[1:4], b"PNG")
        check_rerun(check_viewer(chainmail, log, folder), folder)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]).resolve())
