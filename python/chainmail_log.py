"""Reads a chainmail log with `mcap` and `numpy` alone: states, contact histories, step records, the scene.

The layout is that of docs/log-format.md; the channel's metadata holds the numpy dtypes, so nothing is written down twice.
"""

import json
from dataclasses import dataclass

import numpy as np
from mcap.reader import make_reader


@dataclass
class State:
    """One state. SI units, World frame."""

    header: np.void
    """`step`, `sim_time_s`, `dissipated_energy_j`, `state_hash`."""
    bodies: np.ndarray
    """`position_m` (n, 3), `orientation` (n, 4: x, y, z, w), the two velocities: rings first, then the others."""
    contacts: np.ndarray
    """Contact histories: `body_a`, `body_b`, `arc`, `mid_cos`, `mid_sin`, `spring_m`; empty without friction."""


def _dtype(channel, key):
    fields = json.loads(channel.metadata[key])
    return np.dtype([tuple(field[:2]) + tuple(map(tuple, field[2:])) for field in fields])


def _messages(path, topic):
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=[topic]):
            yield channel, message


def states(path):
    """Every state of a log, in order."""
    for channel, message in _messages(path, "/state"):
        data = message.data
        header, body, contact = (_dtype(channel, key) for key in ("header_dtype", "ring_dtype", "contact_dtype"))
        at = header.itemsize
        count = int.from_bytes(data[at : at + 8], "little")
        bodies = np.frombuffer(data, body, count, at + 8)
        at += 8 + count * body.itemsize
        contacts = np.frombuffer(data, contact, int.from_bytes(data[at : at + 8], "little"), at + 8)
        if at + 8 + contacts.nbytes != len(data):
            raise ValueError(f"{path}: a state of {len(data)} bytes, where {at + 8 + contacts.nbytes} were expected")
        yield State(np.frombuffer(data, header, 1)[0], bodies, contacts)


def steps(path):
    """Every step record of a log, as dictionaries, in order."""
    return [json.loads(message.data) for _, message in _messages(path, "/step")]


def scene(path):
    """The scene record: `scene`, `plan`, `version`, `layout_hash`."""
    return next(json.loads(message.data) for _, message in _messages(path, "/scene"))
