#!/usr/bin/env python3
"""Writes ../jvrc1.urdf: `python3 config/robots/jvrc1/make_urdf.py`. Standard library only.

A humanoid of the class of JVRC-1, the model of the Japan Virtual Robotics Challenge: 1.7 m, 62 kg, arms of seven joints,
a waist of three. Lengths, masses, inertias and limits are those that its model gives (jvrc_description, CNRS and AIST),
rounded; efforts, 100 Nm everywhere, and the sizes of feet are that model's placeholders. What it does not hold is here:
primitive shapes, for looks and, smaller, for contact; sensors and palms. Fingers are one with the hand, closed.
"""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
sys.path.append(str(HERE.parent))

from urdf import (  # noqa: E402, beside the folder of this file
    ACCENT,
    ALONG_Y,
    DARK,
    GREY,
    MATERIALS,
    WHITE,
    box,
    cylinder,
    fixed,
    joint_xml,
    link_xml,
    mirrored,
    number,
    sphere,
    triple,
)

EFFORT_NM = 100
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)

# Joint, which names the link that it moves: parent, axis, offset, limits [deg], speed [rad/s], mass [kg], centre of
# mass, inertia about it (xx, yy, zz), what it looks like, what it touches with.
CENTRAL = {
    "WAIST_Y": ("PELVIS", Z, (0, 0, 0.192), (-45, 45), 8.9, 1, (0, 0, -0.07), (0.00173, 0.00173, 0.0032),
                [cylinder(0.07, 0.06, (0, 0, -0.06), DARK)], []),
    "WAIST_P": ("WAIST_Y", Y, (0, 0, 0), (-30, 60), 8.9, 1, (0, 0, 0), (0.00245, 0.00243, 0.00243),
                [cylinder(0.05, 0.12, (0, 0, 0), GREY, ALONG_Y)], []),
    "WAIST_R": ("WAIST_P", X, (0, 0, 0), (-50, 50), 9.4, 10, (0.02, 0, 0.24), (0.157, 0.101, 0.137),
                [box((0.20, 0.30, 0.26), (0.01, 0, 0.22), WHITE), box((0.10, 0.26, 0.24), (-0.13, 0, 0.25), ACCENT),
                 cylinder(0.05, 0.46, (0, 0, 0.33), GREY, ALONG_Y)],
                [box((0.20, 0.30, 0.24), (0.01, 0, 0.22))]),
    "NECK_Y": ("WAIST_R", Z, (-0.003, 0, 0.453), (-70, 70), 5.2, 0.5, (0, 0, -0.05), (0.00073, 0.00073, 0.00063),
               [cylinder(0.035, 0.08, (0, 0, -0.03), DARK)], []),
    "NECK_R": ("NECK_Y", X, (0, 0, 0), (-50, 50), 5.8, 0.5, (0, 0, 0), (0.0005, 0.0005, 0.0005), [], []),
    "NECK_P": ("NECK_R", Y, (0, 0, 0), (-50, 60), 5.8, 2, (0.01, 0, 0.11), (0.00968, 0.00968, 0.00968),
               [sphere(0.09, (0.01, 0, 0.10), WHITE), box((0.05, 0.13, 0.05), (0.08, 0, 0.11), DARK)],
               [sphere(0.09, (0.01, 0, 0.10))]),
}
# Right ones; the left ones mirror y, and with it the limits about x and z.
LIMBS = {
    "HIP_P": ("PELVIS", Y, (0, -0.096, 0), (-120, 45), 12.6, 1, (0, 0, 0), (0.00196, 0.00196, 0.00196),
              [sphere(0.055, (0, 0, 0), DARK)], []),
    "HIP_R": ("HIP_P", X, (0, 0, 0), (-45, 20), 8.9, 1, (0, 0, 0), (0.00196, 0.00196, 0.00196), [], []),
    "HIP_Y": ("HIP_R", Z, (0, 0, 0), (-30, 45), 8.9, 3, (0.01, 0, -0.22), (0.0319, 0.0345, 0.00865),
              [box((0.11, 0.10, 0.28), (0, 0, -0.19), WHITE)], [cylinder(0.055, 0.22, (0, 0, -0.19))]),
    "KNEE": ("HIP_Y", Y, (-0.02, 0, -0.389), (0, 150), 14.7, 3, (0.04, 0, -0.16), (0.0319, 0.0345, 0.00865),
             [cylinder(0.05, 0.11, (0, 0, 0), DARK, ALONG_Y), box((0.10, 0.09, 0.24), (0.03, 0, -0.18), WHITE)],
             [cylinder(0.05, 0.20, (0.03, 0, -0.17))]),
    "ANKLE_R": ("KNEE", X, (0.04, 0, -0.357), (-35, 45), 15.2, 1, (0, 0, 0), (0.00064, 0.00064, 0.00064),
                [sphere(0.042, (0, 0, 0), DARK)], []),
    "ANKLE_P": ("ANKLE_R", Y, (0, 0, 0), (-85, 55), 14.2, 1.5, (0.03, 0, -0.07), (0.00142, 0.00562, 0.00622),
                [box((0.09, 0.07, 0.06), (0.01, 0, -0.045), GREY)], []),
    "SHOULDER_P": ("WAIST_R", Y, (0, -0.24, 0.33), (-180, 60), 8.9, 1, (0, 0, 0), (0.00196, 0.00196, 0.00196),
                   [cylinder(0.055, 0.08, (0, 0.02, 0), GREY, ALONG_Y)], []),
    "SHOULDER_R": ("SHOULDER_P", X, (0, 0, 0), (-100, 10), 8.9, 1, (0, 0, 0), (0.00196, 0.00196, 0.00196),
                   [sphere(0.055, (0, 0, 0), WHITE)], []),
    "SHOULDER_Y": ("SHOULDER_R", Z, (0, 0, 0), (-90, 90), 4.2, 2, (-0.01, 0, -0.19), (0.0137, 0.0146, 0.00635),
                   [cylinder(0.047, 0.20, (0, 0, -0.15), WHITE)], [cylinder(0.047, 0.18, (0, 0, -0.15))]),
    "ELBOW_P": ("SHOULDER_Y", Y, (0.004, 0, -0.305), (-145, 0), 9.4, 1, (-0.02, 0, -0.10), (0.0107, 0.0107, 0.0027),
                [cylinder(0.045, 0.09, (0, 0, 0), DARK, ALONG_Y), cylinder(0.04, 0.14, (0, 0, -0.12), WHITE)],
                [cylinder(0.042, 0.12, (0, 0, -0.12))]),
    "ELBOW_Y": ("ELBOW_P", Z, (-0.004, 0, -0.239), (-110, 110), 3.7, 1, (0, 0, 0), (0.00064, 0.00064, 0.00064),
                [cylinder(0.036, 0.06, (0, 0, 0.01), GREY)], []),
    "WRIST_R": ("ELBOW_Y", X, (0, 0, 0), (-110, 110), 5.8, 0.5, (0, 0, 0), (0.00032, 0.00032, 0.00032), [], []),
    # With the mass of the closed fingers, 1.2 kg.
    "WRIST_Y": ("WRIST_R", Z, (0, 0, 0), (-150, 150), 3.7, 1.7, (0, 0, -0.09), (0.0025, 0.0028, 0.0012), [], []),
}
PELVIS = {"mass": 10, "com": (-0.01, 0, 0.034), "inertia": (0.0896, 0.0896, 0.1125, 0, 0, 0)}
PELVIS_LOOKS = [box((0.18, 0.24, 0.14), (-0.01, 0, 0.05), WHITE)]
PELVIS_CONTACTS = [box((0.17, 0.22, 0.14), (-0.01, 0, 0.06))]
HAND_LOOKS = [box((0.08, 0.035, 0.10), (0, 0, -0.07), GREY), box((0.07, 0.05, 0.04), (0, 0, -0.115), DARK)]
HAND_CONTACTS = [box((0.07, 0.04, 0.09), (0, 0, -0.07))]
PALM_BELOW_WRIST_M = 0.13
SOLE = {"x": (-0.075, 0.135), "y": (-0.05, 0.05), "z": -0.10, "thickness": 0.02}


def moving(name, parent, axis, offset, limits_deg, speed, mass, com, inertia, looks, contacts):
    lower, upper = (math.radians(degrees) for degrees in limits_deg)
    inertial = {"mass": mass, "com": com, "inertia": (*inertia, 0, 0, 0)}
    limits = (
        f'    <axis xyz="{triple(axis)}"/>',
        f'    <limit lower="{number(lower)}" upper="{number(upper)}" effort="{number(EFFORT_NM)}" '
        f'velocity="{number(speed)}"/>',
    )
    return link_xml(f"{name}_LINK", inertial, looks, contacts) + joint_xml(
        name, "revolute", f"{parent}_LINK", f"{name}_LINK", offset, limits
    )


def limb(side, name):
    parent, axis, (x, y, z), limits, speed, mass, (cx, cy, cz), inertia, looks, contacts = LIMBS[name]
    parent = parent if parent in ("PELVIS", "WAIST_R") else f"{side}_{parent}"
    if side == "L":
        y, cy = -y, -cy
        looks, contacts = [mirrored(s) for s in looks], [mirrored(s) for s in contacts]
        limits = limits if axis == Y else (-limits[1], -limits[0])
    return moving(
        f"{side}_{name}", parent, axis, (x, y, z), limits, speed, mass, (cx, cy, cz), inertia, looks, contacts
    )


def main():
    out = [
        '<?xml version="1.0"?>',
        "<!-- Written by jvrc1/make_urdf.py: change that, not this. -->",
        '<robot name="jvrc1">',
    ]
    out += [f'  <material name="{n}"><color rgba="{c}"/></material>' for n, c in MATERIALS.items()]
    out += link_xml("PELVIS_LINK", PELVIS, PELVIS_LOOKS, PELVIS_CONTACTS)
    for name, description in CENTRAL.items():
        out += moving(name, *description)
    for side in ("R", "L"):
        for name in LIMBS:
            out += limb(side, name)
        # Sensors weigh nothing. What the wrist's carries is the hand, what the ankle's carries the sole's contact shape.
        hand = f"{side}_HAND"
        out += link_xml(hand, None, HAND_LOOKS, HAND_CONTACTS) + fixed(f"{side}_WRIST_Y_LINK", hand)
        out += link_xml(f"{side}_PALM") + fixed(hand, f"{side}_PALM", (0, 0, -PALM_BELOW_WRIST_M))
        (x0, x1), (y0, y1) = SOLE["x"], SOLE["y"]
        sole = box((x1 - x0, y1 - y0, SOLE["thickness"]), ((x0 + x1) / 2, (y0 + y1) / 2, SOLE["thickness"] / 2), DARK)
        out += link_xml(f"{side}_ANKLE_SENSOR")
        out += fixed(f"{side}_ANKLE_P_LINK", f"{side}_ANKLE_SENSOR", (0, 0, SOLE["z"]))
        out += link_xml(f"{side}_SOLE", None, [sole], [sole])
        out += fixed(f"{side}_ANKLE_SENSOR", f"{side}_SOLE")
    out += link_xml("IMU") + fixed("PELVIS_LINK", "IMU")
    out.append("</robot>")
    (HERE.parent / "jvrc1.urdf").write_text("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
