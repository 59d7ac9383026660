"""Equalities, excluded contacts and actuators."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..engine import mujoco
from ..files import escaped, numbers
from ..report import Report
from .collisions import Collision, is_replaced
from .names import Names

BODY = int(mujoco.mjtObj.mjOBJ_BODY)
BITS = 16


def write_contacts(model: Any, names: Names, collisions: dict[int, Collision], report: Report) -> list[str]:
    rows: list[str] = []
    for signature in model.exclude_signature:
        a, b = int(signature) >> BITS, int(signature) & (1 << BITS) - 1
        one, other = (escaped(names.of("body", body)) for body in (a, b))
        rows.append(f'<exclude body1="{one}" body2="{other}"/>')
    for pair in range(model.npair):
        one, other = (int(geom[pair]) for geom in (model.pair_geom1, model.pair_geom2))
        if any(is_replaced(model, collisions, geom) for geom in (one, other)):
            report.drop("<pair> of a mesh that collides as convex pieces")
            continue
        geoms = f'geom1="{escaped(names.of("geom", one))}" geom2="{escaped(names.of("geom", other))}"'
        friction = numbers(model.pair_friction[pair])
        rows.append(f'<pair {geoms} condim="{model.pair_dim[pair]}" friction="{friction}"/>')
    return ["<contact>", *rows, "</contact>"] if rows else []


def write_equalities(model: Any, names: Names, report: Report) -> list[str]:
    rows = [row for number in range(model.neq) if (row := write_equality(model, names, report, number))]
    return ["<equality>", *rows, "</equality>"] if rows else []


def write_equality(model: Any, names: Names, report: Report, number: int) -> str:
    kind, data = int(model.eq_type[number]), model.eq_data[number]
    one, other = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
    active = "true" if model.eq_active0[number] else "false"
    on_bodies = int(model.eq_objtype[number]) == BODY
    if kind == int(mujoco.mjtEq.mjEQ_JOINT):
        leader = f' joint2="{escaped(names.of("joint", other))}"' if other >= 0 else ""
        follower = escaped(names.of("joint", one))
        return f'<joint joint1="{follower}"{leader} polycoef="{numbers(data[:5])}" active="{active}"/>'
    if kind in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)) and on_bodies:
        bodies = f'body1="{escaped(names.of("body", one))}"'
        if other > 0:
            bodies += f' body2="{escaped(names.of("body", other))}"'
        if kind == int(mujoco.mjtEq.mjEQ_CONNECT):
            return f'<connect {bodies} anchor="{numbers(data[:3])}" active="{active}"/>'
        return f'<weld {bodies} relpose="{numbers(data[3:10])}" active="{active}"/>'
    report.drop(f"equality of kind {mujoco.mjtEq(kind).name[5:].lower()}" + ("" if on_bodies else " of sites"))
    return ""


def write_actuators(model: Any, names: Names, report: Report) -> list[str]:
    rows: list[str] = []
    driven: set[int] = set()
    for number in range(model.nu):
        row = write_actuator(model, names, number)
        joint = int(model.actuator_trnid[number, 0])
        if row is None or joint in driven:
            report.drop("actuator that is neither a motor nor a position of one joint")
        else:
            rows.append(row)
            driven.add(joint)
    return ["<actuator>", *rows, "</actuator>"] if rows else []


def write_actuator(model: Any, names: Names, number: int) -> str | None:
    """Returns a motor or a position actuator of a hinge or a slide; `None` for all others."""
    gain, bias = model.actuator_gainprm[number], model.actuator_biasprm[number]
    plain = (
        int(model.actuator_trntype[number]) == int(mujoco.mjtTrn.mjTRN_JOINT)
        and int(model.actuator_dyntype[number]) == int(mujoco.mjtDyn.mjDYN_NONE)
        and int(model.actuator_gaintype[number]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    )
    joint = int(model.actuator_trnid[number, 0])
    if not plain or int(model.jnt_type[joint]) < int(mujoco.mjtJoint.mjJNT_SLIDE):
        return None
    gear = float(model.actuator_gear[number, 0])
    force = model.actuator_forcerange[number].astype(float)
    returns = bool(not bias[0] and gain[0] > 0 and np.isclose(bias[1], -gain[0]) and not model.qpos0[model.jnt_qposadr[joint]])
    unbiased = int(model.actuator_biastype[number]) == int(mujoco.mjtBias.mjBIAS_NONE)
    if unbiased and gain[0] and gear:
        kind, gear, force = "motor", gear * float(gain[0]), np.sort(force / float(gain[0]))
    elif not unbiased and returns:
        kind = f'position kp="{float(gain[0]):.9g}" kv="{max(-float(bias[2]), 0.0):.9g}"'
    else:
        return None
    row = f'<{kind} joint="{escaped(names.of("joint", joint))}" gear="{gear:.9g}"'
    if model.actuator_ctrllimited[number]:
        row += f' ctrllimited="true" ctrlrange="{numbers(model.actuator_ctrlrange[number])}"'
    if model.actuator_forcelimited[number] and np.isclose(force[0], -force[1]) and force[1] > 0:
        row += f' forcelimited="true" forcerange="{numbers([-force[1], force[1]])}"'
    return row + "/>"
