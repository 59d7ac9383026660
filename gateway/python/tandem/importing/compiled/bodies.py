"""Bodies with their joints, geoms, sites, cameras and lights."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..engine import mujoco
from ..files import escaped, numbers
from ..report import Report
from .assets import mesh_name, piece_name
from .collisions import UNSEEN, Collision, is_replaced
from .names import Names

Collisions = dict[int, Collision]
#: Types of geoms, each with the number of values in its size.
SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_PLANE): ("plane", 3),
    int(mujoco.mjtGeom.mjGEOM_SPHERE): ("sphere", 1),
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): ("capsule", 2),
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): ("ellipsoid", 3),
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): ("cylinder", 2),
    int(mujoco.mjtGeom.mjGEOM_BOX): ("box", 3),
    int(mujoco.mjtGeom.mjGEOM_MESH): ("mesh", 0),
}
JOINTS = {
    int(mujoco.mjtJoint.mjJNT_FREE): "free",
    int(mujoco.mjtJoint.mjJNT_BALL): "ball",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "slide",
    int(mujoco.mjtJoint.mjJNT_HINGE): "hinge",
}
#: MuJoCo's colour of a geom that states none; the colour of its material applies.
NO_COLOUR = np.array([0.5, 0.5, 0.5, 1.0])


def write_bodies(model: Any, names: Names, collisions: Collisions, report: Report) -> list[str]:
    children: dict[int, list[int]] = {}
    for body in range(1, model.nbody):
        children.setdefault(int(model.body_parentid[body]), []).append(body)
    rows = ["<worldbody>", *content(model, names, collisions, report, 0)]
    for body in children.get(0, []):
        rows += write_body(model, names, collisions, report, children, body)
    return [*rows, "</worldbody>"]


def write_body(
    model: Any, names: Names, collisions: Collisions, report: Report, children: dict[int, list[int]], body: int
) -> list[str]:
    name, pos, quat = escaped(names.of("body", body)), numbers(model.body_pos[body]), numbers(model.body_quat[body])
    rows = [f'<body name="{name}" pos="{pos}" quat="{quat}">']
    if model.body_mocapid[body] >= 0:
        report.drop("mocap: the body stays where it is")
    mass = float(model.body_mass[body])
    # The root of a robot is fixed in its URDF, and free as a described robot.
    if mass > 0:
        at = f'pos="{numbers(model.body_ipos[body])}" quat="{numbers(model.body_iquat[body])}"'
        rows.append(f'<inertial {at} mass="{mass:.9g}" diaginertia="{numbers(model.body_inertia[body])}"/>')
    joints = [write_joint(model, names, report, joint) for joint in on_body(model, "jnt", body)]
    rows += joints
    if joints:
        kinds = [JOINTS[int(model.jnt_type[joint])] for joint in on_body(model, "jnt", body)]
        report.bodies.append({"name": names.of("body", body), "mass_kg": mass, "joints": kinds})
    rows += content(model, names, collisions, report, body)
    for child in children.get(body, []):
        rows += write_body(model, names, collisions, report, children, child)
    return [*rows, "</body>"]


def on_body(model: Any, what: str, body: int) -> range:
    first, count = int(getattr(model, f"body_{what}adr")[body]), int(getattr(model, f"body_{what}num")[body])
    return range(first, first + count) if count else range(0)


def content(model: Any, names: Names, collisions: Collisions, report: Report, body: int) -> list[str]:
    rows = [row for geom in on_body(model, "geom", body) for row in write_geom(model, names, collisions, report, geom)]
    rows += [write_site(model, names, site) for site in range(model.nsite) if model.site_bodyid[site] == body]
    rows += [write_camera(model, names, camera) for camera in range(model.ncam) if model.cam_bodyid[camera] == body]
    rows += [write_light(model, light) for light in range(model.nlight) if model.light_bodyid[light] == body]
    return rows


def write_joint(model: Any, names: Names, report: Report, joint: int) -> str:
    name, kind = escaped(names.of("joint", joint)), JOINTS[int(model.jnt_type[joint])]
    dof, at = int(model.jnt_dofadr[joint]), int(model.jnt_qposadr[joint])
    damping, stiffness = first(model.dof_damping[dof]), first(model.jnt_stiffness[joint])
    if kind == "free":
        if damping or stiffness or float(model.dof_frictionloss[dof]):
            report.drop("springs, damping and friction of a free joint")
        return f'<freejoint name="{name}"/>'
    if np.size(model.dof_damping[dof]) > 1 and np.any(np.ravel(model.dof_damping[dof])[1:]):
        report.drop("damping that grows with speed")
    row = f'<joint name="{name}" type="{kind}" pos="{numbers(model.jnt_pos[joint])}" damping="{damping:.9g}"'
    row += f' armature="{float(model.dof_armature[dof]):.9g}" frictionloss="{float(model.dof_frictionloss[dof]):.9g}"'
    if kind == "ball":
        if stiffness:
            report.drop("spring of a ball joint")
        return row + "/>"
    zero = float(model.qpos0[at])
    row += f' axis="{numbers(model.jnt_axis[joint])}" stiffness="{stiffness:.9g}"'
    if stiffness:
        row += f' springref="{float(model.qpos_spring[at]) - zero:.9g}"'
    low, high = (float(end) - zero for end in model.jnt_range[joint])
    if model.jnt_limited[joint] and np.isfinite([low, high]).all() and low < high:
        row += f' limited="true" range="{low:.9g} {high:.9g}"'
    elif model.jnt_limited[joint]:
        report.drop("range of a joint that has no end, or one number twice")
    return row + effort_limit(model, report, joint) + "/>"


def effort_limit(model: Any, report: Report, joint: int) -> str:
    """Returns the attribute for the limit of the actuators' efforts on a joint: URDF's `effort`."""
    low, high = (float(end) for end in model.jnt_actfrcrange[joint])
    if not model.jnt_actfrclimited[joint]:
        return ""
    if not np.isclose(low, -high) or high <= 0 or not np.isfinite(high):
        report.drop("actuatorfrcrange that is not the same both ways")
        return ""
    return f' actuatorfrcrange="{-high:.9g} {high:.9g}"'


def first(value: Any) -> float:
    """Returns the number itself, or the linear term of a polynomial."""
    return float(np.ravel(value)[0])


def write_geom(model: Any, names: Names, collisions: Collisions, report: Report, geom: int) -> list[str]:
    """Returns the geom, and the convex pieces that collide in place of a concave mesh."""
    shape = SHAPES.get(int(model.geom_type[geom]))
    if shape is None:
        report.drop(f"geom of type {mujoco.mjtGeom(int(model.geom_type[geom])).name[7:].lower()}")
        return []
    kind, sizes = shape
    size = np.abs(model.geom_size[geom][:sizes])
    if kind != "plane" and sizes and not np.all(size > 0):
        report.drop("geom with an extent of 0")
        return []
    if model.geom_margin[geom] or model.geom_gap[geom]:
        report.drop("margin or gap of a geom")
    place = f'<geom type="{kind}" pos="{numbers(model.geom_pos[geom])}" quat="{numbers(model.geom_quat[geom])}"'
    # The body's inertial includes its mass.
    place += ' mass="0"' if model.geom_bodyid[geom] and kind != "plane" else ""
    touches = f' contype="{model.geom_contype[geom]}" conaffinity="{model.geom_conaffinity[geom]}"'
    touches += f' condim="{model.geom_condim[geom]}" priority="{model.geom_priority[geom]}"'
    touches += f' friction="{numbers(model.geom_friction[geom])}"'
    mesh = int(model.geom_dataid[geom])
    pieces = len(collisions[mesh].pieces) if is_replaced(model, collisions, geom) else 0
    row = place + (' contype="0" conaffinity="0"' if pieces else touches) + looks(model, names, geom)
    if kind == "mesh":
        row += f' mesh="{mesh_name(mesh)}"'
    elif sizes:
        row += f' size="{numbers(size)}"'
    unseen = [f'{place}{touches} group="{UNSEEN}" mesh="{piece_name(mesh, piece)}"/>' for piece in range(pieces)]
    return [*([] if pieces and model.geom_group[geom] >= UNSEEN else [row + "/>"]), *unseen]


def looks(model: Any, names: Names, geom: int) -> str:
    row = f' group="{model.geom_group[geom]}"'
    if name := names.stated("geom", geom):
        row += f' name="{escaped(name)}"'
    material = int(model.geom_matid[geom])
    if material >= 0:
        row += f' material="{escaped(names.of("material", material))}"'
    if material < 0 or not np.allclose(model.geom_rgba[geom], NO_COLOUR):
        row += f' rgba="{numbers(model.geom_rgba[geom])}"'
    return row


def write_site(model: Any, names: Names, site: int) -> str:
    kind, sizes = SHAPES[int(model.site_type[site])]
    row = f'<site name="{escaped(names.of("site", site))}" pos="{numbers(model.site_pos[site])}"'
    kind = "sphere" if kind in ("mesh", "plane") else kind
    size = numbers(model.site_size[site][: max(sizes, 1)])
    return row + f' quat="{numbers(model.site_quat[site])}" type="{kind}" size="{size}"/>'


def write_camera(model: Any, names: Names, camera: int) -> str:
    row = f'<camera name="{escaped(names.of("camera", camera))}" pos="{numbers(model.cam_pos[camera])}"'
    return row + f' quat="{numbers(model.cam_quat[camera])}" fovy="{float(model.cam_fovy[camera]):.9g}"/>'


def write_light(model: Any, light: int) -> str:
    kind = mujoco.mjtLightType(int(model.light_type[light])).name[len("mjLIGHT_") :].lower()
    switches = {"active": model.light_active[light], "castshadow": model.light_castshadow[light]}
    row = f'<light type="{kind}" pos="{numbers(model.light_pos[light])}" dir="{numbers(model.light_dir[light])}"'
    row += "".join(f' {name}="{"true" if value else "false"}"' for name, value in switches.items())
    for name in ("ambient", "diffuse", "specular", "attenuation"):
        row += f' {name}="{numbers(getattr(model, "light_" + name)[light])}"'
    return row + f' cutoff="{float(model.light_cutoff[light]):.9g}" exponent="{float(model.light_exponent[light]):.9g}"/>'
