#!/usr/bin/env python3
"""Writes ../hrp2.urdf from parameters.toml. Standard library only: `python3 config/robots/hrp2/make_urdf.py`.

Masses, centres of mass, inertias, offsets and limits are the parameter file's. What it does not hold is here:
primitive shapes (for looks, and smaller ones for contact, that leave room between neighbours over the range
of each joint) and the fixed frames. ARM_JOINT6 opens the gripper and takes no part: it is fixed at zero.
"""

import math
import pathlib
import sys
import tomllib

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

VELOCITY_LIMIT_RAD_S = 3.0  # the source's placeholder for every joint

# Right limbs; the left ones mirror y. Link: (visuals, contact shapes).
CENTRAL = {
    "BODY": (
        [
            box((0.20, 0.26, 0.16), (-0.02, 0, 0.16), WHITE),
            box((0.15, 0.20, 0.08), (-0.01, 0, 0.04), DARK),
            cylinder(0.075, 0.10, (0.02, 0, 0.29), GREY),
        ],
        [box((0.20, 0.26, 0.18), (-0.02, 0, 0.16))],
    ),
    "CHEST_JOINT0": ([cylinder(0.06, 0.05, (0, 0, 0), DARK)], []),
    "CHEST_JOINT1": (
        [
            box((0.22, 0.30, 0.23), (-0.01, 0, 0.155), WHITE),
            box((0.13, 0.26, 0.26), (-0.185, 0, 0.15), ACCENT),
            box((0.02, 0.18, 0.10), (0.105, 0, 0.17), GREY),
            cylinder(0.055, 0.16, (0.008, 0, 0.181), DARK, ALONG_Y),
            cylinder(0.05, 0.44, (0.008, 0, 0.181), GREY, ALONG_Y),
        ],
        [box((0.22, 0.30, 0.22), (-0.01, 0, 0.15)), box((0.13, 0.26, 0.25), (-0.185, 0, 0.15))],
    ),
    "HEAD_JOINT0": ([cylinder(0.035, 0.06, (0, 0, -0.005), DARK)], []),
    "HEAD_JOINT1": (
        [
            sphere(0.085, (0, 0, 0.09), WHITE),
            box((0.05, 0.13, 0.045), (0.06, 0, 0.10), ACCENT),
            cylinder(0.05, 0.15, (-0.01, 0, 0.09), GREY, ALONG_Y),
        ],
        [sphere(0.085, (0, 0, 0.09))],
    ),
}
LIMBS = {
    "LEG_JOINT0": ([cylinder(0.045, 0.09, (0, 0, 0.03), GREY)], []),
    "LEG_JOINT1": ([sphere(0.052, (0, -0.01, 0), DARK)], []),
    "LEG_JOINT2": (
        [
            cylinder(0.055, 0.07, (0, -0.035, 0), GREY, ALONG_Y),
            box((0.12, 0.10, 0.24), (0.005, -0.06, -0.15), WHITE),
        ],
        [cylinder(0.055, 0.19, (0, -0.06, -0.145))],
    ),
    "LEG_JOINT3": (
        [
            cylinder(0.05, 0.12, (0, -0.055, 0), DARK, ALONG_Y),
            box((0.10, 0.09, 0.22), (0.012, -0.05, -0.145), WHITE),
        ],
        [cylinder(0.05, 0.17, (0.005, -0.05, -0.135))],
    ),
    "LEG_JOINT4": ([sphere(0.042, (0, 0, 0), DARK)], []),
    "LEG_JOINT5": ([box((0.08, 0.07, 0.07), (0, 0, -0.045), GREY)], []),
    "ARM_JOINT0": ([cylinder(0.06, 0.07, (0, 0.045, 0), GREY, ALONG_Y)], []),
    "ARM_JOINT1": ([sphere(0.058, (0, 0, 0), WHITE)], []),
    "ARM_JOINT2": (
        [cylinder(0.047, 0.17, (0, 0, -0.125), WHITE)],
        [cylinder(0.05, 0.18, (0, 0, -0.11))],
    ),
    "ARM_JOINT3": (
        [
            cylinder(0.045, 0.09, (0, 0, 0), DARK, ALONG_Y),
            cylinder(0.04, 0.17, (0, 0, -0.125), WHITE),
        ],
        [cylinder(0.045, 0.15, (0, 0, -0.115))],
    ),
    "ARM_JOINT4": ([cylinder(0.035, 0.05, (0, 0, -0.015), GREY)], []),
    "ARM_JOINT5": ([cylinder(0.03, 0.07, (0, 0, 0), DARK, ALONG_Y)], []),
    "ARM_JOINT6": ([box((0.015, 0.05, 0.06), (0, 0, -0.03), DARK)], []),
}
HAND = (
    [box((0.06, 0.075, 0.06), (0, 0, -0.06), WHITE), box((0.015, 0.05, 0.06), (-0.0219, 0, -0.115), DARK)],
    [box((0.06, 0.075, 0.06), (0, 0, -0.06))],
)
PALM_BELOW_WRIST_M = 0.085
SOLE_THICKNESS_M = 0.03


def shapes_of(name):
    if name in CENTRAL:
        return CENTRAL[name]
    visuals, contacts = LIMBS[name[1:]]
    if name[0] == "L":
        return [mirrored(s) for s in visuals], [mirrored(s) for s in contacts]
    return visuals, contacts


def main():
    parameters = tomllib.loads((HERE / "parameters.toml").read_text())
    out = [
        '<?xml version="1.0"?>',
        "<!-- Written by hrp2/make_urdf.py from hrp2/parameters.toml: change those, not this. -->",
        '<robot name="hrp2">',
    ]
    out += [f'  <material name="{n}"><color rgba="{c}"/></material>' for n, c in MATERIALS.items()]

    for link in parameters["link"]:
        name = link["name"]
        visuals, contacts = shapes_of(name)
        out += link_xml(name, link, visuals, contacts)
        if "parent" not in link:
            continue
        if name.endswith("ARM_JOINT6"):
            hand = f"{name[0].lower()}_hand"
            out += fixed(hand, name, link["offset"], name=name)
            continue
        lower, upper = (math.radians(degrees) for degrees in link["limit_deg"])
        moving = (
            f'    <axis xyz="{triple(link["axis"])}"/>',
            f'    <limit lower="{number(lower)}" upper="{number(upper)}" '
            f'effort="{number(link["torque_max"])}" velocity="{number(VELOCITY_LIMIT_RAD_S)}"/>',
        )
        out += joint_xml(name, "revolute", link["parent"], name, link["offset"], moving)

    sole = parameters["sole"]
    for side, mirror in (("r", 1), ("l", -1)):
        wrist, ankle = f"{side.upper()}ARM_JOINT5", f"{side.upper()}LEG_JOINT5"
        hand_visuals, hand_contacts = ([mirrored(s) for s in shapes] if mirror < 0 else shapes for shapes in HAND)
        # The wrist sensor weighs nothing; what it carries is the hand with its gripper.
        out += link_xml(f"{side}_wrist_sensor") + fixed(wrist, f"{side}_wrist_sensor")
        out += link_xml(f"{side}_hand", None, hand_visuals, hand_contacts)
        out += fixed(f"{side}_wrist_sensor", f"{side}_hand")
        out += link_xml(f"{side}_palm") + fixed(f"{side}_hand", f"{side}_palm", (0, 0, -PALM_BELOW_WRIST_M))
        # Outboard of the ankle sensor is only the sole's contact shape, without mass: the sensor reads
        # the ground.
        sole_size = (sole["x_max"] - sole["x_min"], sole["y_max"] - sole["y_min"], SOLE_THICKNESS_M)
        sole_centre = (
            (sole["x_max"] + sole["x_min"]) / 2,
            mirror * (sole["y_max"] + sole["y_min"]) / 2,
            SOLE_THICKNESS_M / 2,
        )
        out += link_xml(f"{side}_ankle_sensor")
        out += fixed(ankle, f"{side}_ankle_sensor", (0, 0, parameters["foot_force_sensor_z"]))
        out += link_xml(
            f"{side}_sole", None, [box(sole_size, sole_centre, DARK)], [box(sole_size, sole_centre)]
        )
        out += fixed(f"{side}_ankle_sensor", f"{side}_sole", (0, 0, sole["z"] - parameters["foot_force_sensor_z"]))
    out += link_xml("imu") + fixed("CHEST_JOINT1", "imu", parameters["imu_offset"])
    out.append("</robot>")
    (HERE.parent / "hrp2.urdf").write_text("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
