"""The report on an imported file."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class Report:
    """Source, written file and the parts that were left out."""

    source: str
    written: str
    #: Name, mass (kg) and joints of each body that can move.
    bodies: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    meshes: int = 0
    triangles: int = 0
    pictures: int = 0
    #: Volumes (m3) of meshes that collide and of their hulls, and the number of convex pieces that collide in their place.
    collisions: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    #: Parts that are not in the written file, with their number in the source.
    dropped: dict[str, int] = field(default_factory=dict[str, int])
    #: Distances (m) of bodies from their initial positions and from those of the source after 1 s in MuJoCo without commands.
    after_1_s: dict[str, Any] = field(default_factory=dict[str, Any])

    def drop(self, what: str, times: int = 1) -> None:
        self.dropped = dict(Counter(self.dropped) + Counter({what: times}))

    def collide(self, mesh: int, volume_m3: float, hull_m3: float, pieces: int, is_concave: bool) -> None:
        row: dict[str, Any] = {"mesh": f"mesh_{mesh}", "volume_m3": volume_m3, "hull_m3": hull_m3}
        self.collisions.append({**row, "is_concave": is_concave, "pieces": pieces})

    def write(self, out: Path) -> None:
        (out / "report.json").write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")

    def told(self) -> str:
        lines = [f"{self.source} -> {self.written}: {len(self.bodies)} bodies that move, {self.meshes} meshes"]
        lines += [f"  left out: {what} ({times})" for what, times in self.dropped.items()]
        concave = [row for row in self.collisions if row["is_concave"]]
        whole = [row["volume_m3"] / row["hull_m3"] for row in concave if not row["pieces"]]
        if whole:
            lines.append(
                f"  {len(whole)} concave meshes collide as their convex hulls, of which they fill {100 * min(whole):.0f} to "
                f"{100 * max(whole):.0f} %; --decompose cuts them into convex pieces"
            )
        if pieces := sum(row["pieces"] for row in concave):
            lines.append(f"  {len(concave) - len(whole)} concave meshes collide as {pieces} convex pieces")
        if "not_simulated" in self.after_1_s:
            lines.append(f"  MuJoCo diverges within 1 s or is slow: {' and '.join(self.after_1_s['not_simulated'])} file")
        if "from_source_m" in self.after_1_s:
            far = self.after_1_s["from_source_m"]
            lines.append(f"  after 1 s in MuJoCo the farthest body is {1000 * far:.0f} mm from the source's")
        return "\n".join(lines)
