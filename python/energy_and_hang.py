"""Plots where a run's energy goes, and how deep the mail hangs.

    pip install mcap numpy matplotlib
    python3 python/energy_and_hang.py out/drop/log.mcap energy.png
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import chainmail_log


def hang(path):
    """Time (s), the lowest height of any ring's centre (m), and the number of contact histories, of every state."""
    rings = len(chainmail_log.scene(path)["scene"]["ring"])
    rows = [
        (
            state.header["sim_time_s"],
            state.bodies["position_m"][:rings, 1].min(initial=np.inf),
            len(state.contacts),
        )
        for state in chainmail_log.states(path)
    ]
    return np.array(rows).T


def main(log, picture):
    records = chainmail_log.steps(log)
    time = np.array([record["sim_time_s"] for record in records])
    figure, (energy, depth) = plt.subplots(2, sharex=True, figsize=(8, 6), layout="constrained")
    total = np.zeros_like(time)
    for name in ("kinetic", "gravity", "contact", "dissipated"):
        values = np.array([record[f"{name}_energy_j"] for record in records])
        total += values
        energy.plot(time, values, label=name)
    energy.plot(time, total, "k--", label="all")
    energy.set_ylabel("energy (J)")
    energy.legend()
    state_time, height, contacts = hang(log)
    depth.plot(state_time, height[0] - height)
    depth.set_xlabel("simulated time (s)")
    depth.set_ylabel("lowest ring, below its start (m)")
    figure.savefig(picture, dpi=120)
    print(f"{len(records)} steps, {len(height)} states")
    print(f"energy unaccounted for: {abs(total - total[0]).max():.3e} J at most")
    print(f"hang depth: {(height[0] - height).max():.6f} m at most")
    print(f"contact histories: {int(contacts.max())} at most")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
