"""A URDF as text, of primitive shapes: what the make_urdf.py of every robot here is written with. Standard library only."""

import math

WHITE, GREY, DARK, ACCENT = "white", "grey", "dark", "accent"
MATERIALS = {
    WHITE: "0.92 0.92 0.90 1",
    GREY: "0.55 0.57 0.60 1",
    DARK: "0.20 0.21 0.23 1",
    ACCENT: "0.16 0.31 0.55 1",
}


def box(size, at, material=None, rpy=(0, 0, 0)):
    return ("box", size, at, rpy, material)


def cylinder(radius, length, at, material=None, rpy=(0, 0, 0)):
    return ("cylinder", (radius, length), at, rpy, material)


def sphere(radius, at, material=None):
    return ("sphere", (radius,), at, (0, 0, 0), material)


ALONG_Y = (math.pi / 2, 0, 0)


def number(value):
    return repr(round(float(value), 12) + 0.0)


def triple(values):
    return " ".join(number(v) for v in values)


def mirrored(shape):
    kind, size, (x, y, z), (roll, pitch, yaw), material = shape
    return (kind, size, (x, -y, z), (-roll, pitch, -yaw), material)


def shape_xml(tag, shape):
    kind, size, at, rpy, material = shape
    attributes = {
        "box": lambda: f'size="{triple(size)}"',
        "cylinder": lambda: f'radius="{number(size[0])}" length="{number(size[1])}"',
        "sphere": lambda: f'radius="{number(size[0])}"',
    }[kind]()
    lines = [
        f"    <{tag}>",
        f'      <origin xyz="{triple(at)}" rpy="{triple(rpy)}"/>',
        f"      <geometry><{kind} {attributes}/></geometry>",
    ]
    if tag == "visual":
        lines.append(f'      <material name="{material}"/>')
    return lines + [f"    </{tag}>"]


def link_xml(name, inertial=None, visuals=(), contacts=()):
    body = []
    if inertial:
        ixx, iyy, izz, ixy, ixz, iyz = map(number, inertial["inertia"])
        body += [
            "    <inertial>",
            f'      <origin xyz="{triple(inertial["com"])}"/>',
            f'      <mass value="{number(inertial["mass"])}"/>',
            f'      <inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>',
            "    </inertial>",
        ]
    for shape in visuals:
        body += shape_xml("visual", shape)
    for shape in contacts:
        body += shape_xml("collision", shape)
    return [f'  <link name="{name}">', *body, "  </link>"] if body else [f'  <link name="{name}"/>']


def joint_xml(name, kind, parent, child, xyz, moving=()):
    return [
        f'  <joint name="{name}" type="{kind}">',
        f'    <origin xyz="{triple(xyz)}"/>',
        f'    <parent link="{parent}"/>',
        f'    <child link="{child}"/>',
        *moving,
        "  </joint>",
    ]


def fixed(parent, child, xyz=(0, 0, 0), name=None):
    return joint_xml(name or f"{child}_fixed", "fixed", parent, child, xyz)
