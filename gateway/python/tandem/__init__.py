"""Simulation of two or three humanoids that have to work together.

    import tandem

    with tandem.Episode("handover", seed=0) as episode:
        seen = episode.observe()
        reply = episode.wait(25)
        result = episode.finish()

Units are SI; quaternions are w, x, y, z; poses are in a robot's own pelvis frame (x forward, y left, z up) unless
noted otherwise. One control step is 20 ms.
"""

from __future__ import annotations

import os

from . import _native
from ._native import Snapshot
from .base import BaseEpisode, Observation, Stepped
from .client import Client, RemoteEpisode
from .contract.arguments import JointChunk, JointDrives, PixelRegion, SurfaceQuery, WalkMove, WristMove
from .contract.commands import CommandReply
from .contract.depth import DepthReply
from .contract.replies import ReachReply, RobotState, StatusReply
from .contract.result import ResultReply
from .contract.start import Briefing, TaskList
from .episode import Episode
from .errors import EpisodeEnded, Refused, SimulatorFailed, TandemError, Unreachable
from .evaluation import Evaluation, collect, evaluate, report, tasks
from .policy_server import PolicyServer, serve_policy
from .program import main
from .recording import Picture, RecordedCall, Recording
from .server import Server, serve

_native.loaded_from(_native.__file__ or "")

# Without a desktop, the layer of Mesa that orders graphics processors prints an error. Tandem ranks them itself.
if "XDG_RUNTIME_DIR" not in os.environ:
    os.environ.setdefault("NODEVICE_SELECT", "1")

__version__ = "0.2.0"

__all__ = [
    "BaseEpisode",
    "Briefing",
    "Client",
    "CommandReply",
    "DepthReply",
    "Episode",
    "EpisodeEnded",
    "Evaluation",
    "JointChunk",
    "JointDrives",
    "Observation",
    "Picture",
    "PixelRegion",
    "PolicyServer",
    "ReachReply",
    "RecordedCall",
    "Recording",
    "Refused",
    "RemoteEpisode",
    "ResultReply",
    "RobotState",
    "Server",
    "SimulatorFailed",
    "Snapshot",
    "StatusReply",
    "Stepped",
    "SurfaceQuery",
    "TandemError",
    "TaskList",
    "Unreachable",
    "WalkMove",
    "WristMove",
    "collect",
    "evaluate",
    "main",
    "report",
    "serve",
    "serve_policy",
    "tasks",
]
