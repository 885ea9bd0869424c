"""Golden gains of preview control (Kajita 2003), by scipy's Riccati solver.

Writes preview_gains.json beside this file. Needs numpy and scipy:
    python preview_gains.py
"""

import json
import pathlib

import numpy as np
from scipy.linalg import solve_discrete_are

GRAVITY = 9.81


def gains(dt, height, horizon, q, r):
    A = np.array([[1, dt, dt**2 / 2], [0, 1, dt], [0, 0, 1]])
    B = np.array([[dt**3 / 6], [dt**2 / 2], [dt]])
    C = np.array([[1, 0, -height / GRAVITY]])
    At = np.block([[np.eye(1), C @ A], [np.zeros((3, 1)), A]])
    Bt = np.vstack([C @ B, B])
    Q = np.diag([q, 0, 0, 0])
    P = solve_discrete_are(At, Bt, Q, np.array([[r]]))
    S = r + Bt.T @ P @ Bt
    K = np.linalg.solve(S, Bt.T @ P @ At)
    Ac = At - Bt @ K
    # Without the tail: the library adds to the last gain all that would follow.
    X = -P[:, [0]]
    preview = []
    for _ in range(round(horizon / dt)):
        preview.append((np.linalg.solve(S, Bt.T @ X)).item())
        X = Ac.T @ X
    return {
        "control_period_s": dt,
        "com_height_m": height,
        "horizon_s": horizon,
        "error_weight": q,
        "jerk_weight": r,
        "gain_error": K[0, 0],
        "gain_state": K[0, 1:].tolist(),
        "gain_preview": preview,
    }


cases = [
    gains(0.005, 0.79, 1.6, 1.0, 1e-6),
    gains(0.005, 0.72, 1.6, 1.0, 1e-6),
    gains(0.002, 0.79, 1.0, 1.0, 1e-8),
    gains(0.01, 0.5, 1.0, 10.0, 1e-5),
]
path = pathlib.Path(__file__).with_suffix(".json")
path.write_text(json.dumps(cases, indent=1) + "\n")
