#!/usr/bin/env python3
"""Writes pinocchio_*.json: what Pinocchio says of HRP-2, and of a tree with what HRP-2 has not, in random
postures.

    python3 -m venv venv && venv/bin/pip install pin==4.1.0 && venv/bin/python make_goldens.py

Conventions of the file: quaternions w first; velocities of the base are those of the root link's origin, in
world axes (Pinocchio's are in the root link's axes); Jacobians in world axes, linear before angular, at the
frame's origin, as a list of [column, six entries] of the columns that are not zero.
"""

import json
import pathlib

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[3]


def rounded(values):
    return [round(float(v), 12) + 0.0 for v in np.asarray(values).ravel()]


def pose(placement):
    q = pin.Quaternion(placement.rotation).normalized()
    if q.w < 0:
        q = pin.Quaternion(-q.coeffs())
    return rounded([*placement.translation, q.w, q.x, q.y, q.z])


def columns(jacobian):
    return [[i, *rounded(c)] for i, c in enumerate(jacobian.T) if np.abs(c).max() > 1e-14]


def write(urdf, jacobian_frames, count):
    model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    data = model.createData()
    joints = list(model.names)[2:]
    links = [f for f in model.frames if f.type == pin.FrameType.BODY and f.name != "universe"]
    rng = np.random.default_rng(1)

    postures = []
    for _ in range(count):
        q = pin.neutral(model)
        q[:3] = np.round(rng.uniform(-2, 2, 3), 6)
        quaternion = rng.normal(size=4)
        q[3:7] = quaternion / np.linalg.norm(quaternion)
        for name in joints:
            i = model.idx_qs[model.getJointId(name)]
            q[i] = np.round(rng.uniform(model.lowerPositionLimit[i], model.upperPositionLimit[i]), 6)
        pin.forwardKinematics(model, data, q)
        pin.updateFramePlacements(model, data)
        pin.computeJointJacobians(model, data, q)
        com_jacobian = pin.jacobianCenterOfMass(model, data, q).copy()

        to_local = np.eye(model.nv)
        to_local[:3, :3] = to_local[3:6, 3:6] = data.oMi[1].rotation.T
        jacobian = lambda name: pin.getFrameJacobian(
            model, data, model.getFrameId(name, pin.FrameType.BODY), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        postures.append(
            {
                "base_pose": [*map(float, [*q[:3], q[6], *q[3:6]])],
                "q": [float(q[model.idx_qs[model.getJointId(name)]]) for name in joints],
                "frame_poses": [pose(data.oMf[model.getFrameId(f.name, pin.FrameType.BODY)]) for f in links],
                "frame_jacobians": [columns(jacobian(name) @ to_local) for name in jacobian_frames],
                "com": rounded(pin.centerOfMass(model, data, q)),
                "com_jacobian": [rounded(c) for c in (com_jacobian @ to_local).T],
            }
        )
    # Columns follow Pinocchio's order of joints, which the file names.
    assert joints == sorted(joints, key=lambda name: model.idx_vs[model.getJointId(name)])
    out = {
        "joints": joints,
        "frames": [f.name for f in links],
        "jacobian_frames": jacobian_frames,
        "postures": postures,
    }
    (HERE / f"pinocchio_{urdf.stem}.json").write_text(json.dumps(out, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    write(ROOT / "config/robots/hrp2.urdf", ["r_palm", "l_palm", "r_sole", "l_sole", "imu"], 100)
    write(HERE / "skew_tree.urdf", ["tool", "slide", "bracket", "tail"], 10)
