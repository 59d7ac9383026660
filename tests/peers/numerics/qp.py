"""Solutions of quadratic programs by Clarabel, an interior point method, for `cargo test -p tandem-ik --release qp`.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install -r tests/peers/numerics/qp.txt
    /tmp/peers/bin/python tests/peers/numerics/qp.py

The problems are those of `ik/tests/kinematics/qp.rs`, number by number. Writes `ik/tests/data/clarabel.json`.
"""

import json
from importlib.metadata import version
from pathlib import Path

import clarabel
import numpy as np
from scipy import sparse

FILE = Path(__file__).resolve().parents[3] / "ik/tests/data/clarabel.json"
PROBLEMS = 1000
# Ours has to agree to 1e-8.
DECIMALS = 10
WORD = 2**64 - 1


class Random:
    """Uniform in -1..1; splitmix64."""

    def __init__(self, seed):
        self.state = seed

    def __call__(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & WORD
        bits = self.state
        bits = ((bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9) & WORD
        bits = ((bits ^ (bits >> 27)) * 0x94D049BB133111EB) & WORD
        return ((bits ^ (bits >> 31)) >> 11) / 2**52 - 1.0


def problem(seed):
    """Hessian, linear term, bounds, and rows `a x >= b`, of which the first may be an equality."""
    uniform = Random(seed)
    n = 2 + seed % 19
    factor = np.array([[uniform() for _ in range(n)] for _ in range(n)])
    inside = np.array([uniform() for _ in range(n)])
    lower = np.array([x - 0.3 * abs(uniform()) for x in inside])
    upper = np.array([x + 0.3 * abs(uniform()) for x in inside])
    rows = []
    for k in range(seed % 7):
        a = np.array([uniform() for _ in range(n)])
        equality = k == 0 and n > 3
        slack = 0.0 if equality else 0.1 * abs(uniform())
        rows.append((a, a @ inside - slack, equality))
    linear = np.array([3.0 * uniform() for _ in range(n)])
    return factor @ factor.T + 0.1 * np.eye(n), linear, lower, upper, rows


def solve(hessian, linear, lower, upper, rows):
    """Clarabel's form: A x + s = b with s in cones; equalities first."""
    n = len(linear)
    equal = [(a, b) for a, b, equality in rows if equality]
    above = [(-a, -b) for a, b, equality in rows if not equality]
    stacked = equal + above + list(zip(np.eye(n), upper)) + list(zip(-np.eye(n), -lower))
    cones = [clarabel.ZeroConeT(len(equal)), clarabel.NonnegativeConeT(len(stacked) - len(equal))]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-13
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix(np.triu(hessian)),
        linear,
        sparse.csc_matrix(np.array([a for a, _ in stacked])),
        np.array([b for _, b in stacked]),
        cones,
        settings,
    )
    solution = solver.solve()
    assert str(solution.status) in ("Solved", "AlmostSolved"), solution.status
    return solution.x


def main():
    solutions = [[round(x, DECIMALS) for x in solve(*problem(seed))] for seed in range(PROBLEMS)]
    lines = ",\n".join(json.dumps(solution) for solution in solutions)
    FILE.write_text(f'{{"clarabel": "{version("clarabel")}", "solutions": [\n{lines}\n]}}\n')
    print(f"{PROBLEMS} solutions written to {FILE}")


if __name__ == "__main__":
    main()
