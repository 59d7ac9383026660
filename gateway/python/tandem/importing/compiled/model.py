"""Export of a model that MuJoCo has compiled, as plain MJCF."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import numpy as np

from ..engine import mujoco
from ..files import numbers
from ..report import Report
from ..urdf import urdf_source
from .assets import write_assets
from .bodies import write_bodies
from .collisions import colliding_meshes
from .constraints import write_actuators, write_contacts, write_equalities
from .names import Names

#: Duration of the comparison between the source and the written file.
SECONDS = 1.0
#: Longest duration of the simulation of either.
PATIENCE_S = 20.0
#: MuJoCo's own headlight.
HEADLIGHT = {"ambient": 0.1, "diffuse": 0.4, "specular": 0.5}
#: Warnings of a simulation that MuJoCo then begins anew.
DIVERGED = [
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
]
#: Groups that are drawn where group 0 has the shapes that collide, as in robosuite's files and in MuJoCo's models of URDF.
DRAWN_VISUALS = '<custom><numeric name="drawn_groups" data="1 2"/></custom>'
FLAGS = {"contact": mujoco.mjtDisableBit.mjDSBL_CONTACT, "gravity": mujoco.mjtDisableBit.mjDSBL_GRAVITY}


def import_model(source: Path, out: Path, decompose: bool) -> Report:
    """Writes `scene.xml` for an MJCF or URDF file."""
    report = Report(str(source), str(out / "scene.xml"))
    if source.suffix.lower() == ".urdf":
        text, files = urdf_source(source, report)
        model = mujoco.MjModel.from_xml_string(text, files)
        write_model(model, out / "scene.xml", report, decompose, DRAWN_VISUALS if (model.geom_group == 1).any() else "")
    else:
        text = source.read_text(encoding="utf-8", errors="replace")
        model = mujoco.MjModel.from_xml_path(str(source))
        write_model(model, out / "scene.xml", report, decompose, custom(text))
    return report


def write_model(model: Any, written: Path, report: Report, decompose: bool, custom: str = "") -> None:
    """Writes a compiled model as plain MJCF, with its meshes and images beside it."""
    names = Names(model)
    collisions = colliding_meshes(model, decompose, report)
    parts = [
        "<mujoco>",
        '<compiler angle="radian" meshdir="meshes" texturedir="textures"/>',
        options(model, report),
        headlight(model),
        custom,
        *write_assets(model, names, written.parent, collisions, report),
        *write_bodies(model, names, collisions, report),
        *write_contacts(model, names, collisions, report),
        *write_equalities(model, names, report),
        *write_actuators(model, names, report),
        "</mujoco>",
    ]
    written.write_text("\n".join(part for part in parts if part) + "\n", encoding="utf-8")
    rest(model, report)
    report.after_1_s = compared(model, mujoco.MjModel.from_xml_path(str(written)), names)


def options(model: Any, report: Report) -> str:
    off = [name for name, bit in FLAGS.items() if model.opt.disableflags & bit]
    others = int(model.opt.disableflags) & ~sum(int(bit) for bit in FLAGS.values())
    if others & int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT):
        report.drop('<flag constraint="disable">')
    for what in ("density", "viscosity"):
        if getattr(model.opt, what):
            report.drop(f"{what} of a medium")
    flags = "".join(f' {name}="disable"' for name in off)
    flag = f"<flag{flags}/>" if flags else ""
    return f'<option gravity="{numbers(model.opt.gravity)}">{flag}</option>'


def headlight(model: Any) -> str:
    """Returns the light at the camera, unless it is MuJoCo's own in a model without other lights."""
    light = model.vis.headlight
    usual = light.active and all(np.allclose(getattr(light, name), value) for name, value in HEADLIGHT.items())
    if usual and not model.nlight:
        return ""
    colours = "".join(f' {name}="{numbers(getattr(light, name))}"' for name in HEADLIGHT)
    return f'<visual><headlight{colours} active="{int(light.active)}"/></visual>'


def custom(text: str) -> str:
    """Returns the drawn groups (1 and 2) for a file with robosuite's convention, which the compiler drops."""
    by_group = re.search(r'inertiagrouprange\s*=\s*"\s*0\s+0\s*"', text) and re.search(r'group\s*=\s*"1"', text)
    return DRAWN_VISUALS if by_group else ""


def rest(model: Any, report: Report) -> None:
    """Reports the parts of a model that are not written."""
    for what, times in [
        ("<tendon>", model.ntendon),
        ("<flex>", model.nflex),
        ("<skin>", model.nskin),
        ("<sensor>", model.nsensor),
        ("<key>", model.nkey),
        ("plugin", model.nplugin),
    ]:
        if times:
            report.drop(what, int(times))


def played(model: Any) -> tuple[Any, Any] | None:
    """Returns the positions of bodies at the beginning and after one second without commands.

    Returns `None` if MuJoCo diverges, or if it takes longer than `PATIENCE_S`.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    begin = data.xpos.copy()
    # MuJoCo would write warnings to a file in the working folder.
    mujoco.set_mju_user_warning(ignore)
    ends = time.monotonic() + PATIENCE_S
    try:
        for _ in range(round(SECONDS / model.opt.timestep)):
            mujoco.mj_step(model, data)
            if time.monotonic() > ends or any(data.warning[kind].number for kind in DIVERGED):
                return None
    finally:
        mujoco.set_mju_user_warning(None)
    return begin, data.xpos.copy()


def ignore(warning: str) -> None:
    """Does nothing about a warning of MuJoCo, which counts it, too."""


def compared(source: Any, written: Any, names: Names) -> dict[str, Any]:
    """Returns how far (m) bodies move in one second, and how far they then are from those of the source."""
    moved = [body for body in range(1, written.nbody) if written.body_weldid[body]]
    if not moved:
        return {"from_begin_m": 0.0, "from_source_m": 0.0}
    written.opt.timestep = source.opt.timestep
    expected, found = played(source), played(written)
    if expected is None or found is None:
        return {"not_simulated": [name for name, end in (("source", expected), ("written", found)) if end is None]}
    away = np.linalg.norm(found[1] - expected[1], axis=1)
    farthest = max(moved, key=lambda body: away[body])
    come = max(float(np.linalg.norm(found[1][body] - found[0][body])) for body in moved)
    return {"from_begin_m": come, "from_source_m": float(away[farthest]), "farthest": names.of("body", farthest)}
