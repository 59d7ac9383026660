"""Figures of reports, computed by scipy and statsmodels.

    pip install -r tests/peers/numerics/statistics.txt
    python tests/peers/numerics/statistics.py                        # writes episodes/evaluation/src/statistics/peers.json, which a test holds us to
    python tests/peers/numerics/statistics.py report.json            # checks every figure of `tandem report --format json`

Newcombe's interval for paired differences is put together from statsmodels' Wilson limits by the formulas of his paper.
"""

import json
import math
import pathlib
import sys

from scipy.stats import binomtest
from statsmodels.stats.contingency_tables import mcnemar
from statsmodels.stats.proportion import proportion_confint

PEERS = pathlib.Path(__file__).parents[3] / "episodes/evaluation/src/statistics/peers.json"
COUNTS = [(0, 1), (1, 1), (0, 10), (1, 10), (5, 10), (10, 10), (17, 20), (49, 50), (95, 100), (99, 100), (100, 100), (3, 7), (400, 1000)]
# Both, only the first, only the second, neither. The second row is Altman et al., Statistics with Confidence (2000), table 6.2.
PAIRS = [(10, 0, 0, 0), (14, 5, 0, 22), (3, 1, 6, 0), (0, 10, 0, 0), (0, 0, 0, 10), (40, 3, 12, 45), (5, 5, 5, 5), (1, 0, 1, 8), (2, 9, 9, 0), (97, 1, 2, 0)]
MEANS = [[(5, 10), (9, 10), (10, 10)], [(0, 10), (0, 10)], [(99, 100), (100, 100), (43, 100), (99, 100)]]


def exact(successes, trials):
    """Clopper and Pearson, by scipy; statsmodels has to agree."""
    interval = binomtest(successes, trials).proportion_ci(method="exact")
    again = proportion_confint(successes, trials, method="beta")
    # At 0 and at n statsmodels may give NaN for the limit that is certain.
    assert all(math.isnan(b) or abs(a - b) < 1e-9 for a, b in zip(interval, again)), (interval, again)
    return [interval.low, interval.high]


def mean(counts):
    shares = [successes / trials for successes, trials in counts]
    limits = [exact(*count) for count in counts]
    middle = sum(shares) / len(shares)
    reach = [math.sqrt(sum((share - limit[end]) ** 2 for share, limit in zip(shares, limits))) / len(shares) for end in (0, 1)]
    return [middle, middle - reach[0], middle + reach[1]]


def newcombe(both, first, second, neither):
    """Newcombe 1998, method 10, for the second rate minus the first."""
    n = both + first + second + neither
    p1, p2 = (both + first) / n, (both + second) / n
    (l1, u1), (l2, u2) = (proportion_confint(both + one, n, method="wilson") for one in (first, second))
    margins = (both + first) * (second + neither) * (both + second) * (first + neither)
    excess = both * neither - first * second
    excess = max(excess - n / 2, 0) if excess > 0 else excess
    phi = excess / math.sqrt(margins) if margins else 0
    reach = lambda a, b: math.sqrt(max(a * a - 2 * phi * a * b + b * b, 0))
    return [p2 - p1 - reach(p2 - l2, u1 - p1), p2 - p1 + reach(u2 - p2, p1 - l1)]


def p_value(both, first, second, neither):
    return float(mcnemar([[both, first], [second, neither]], exact=True).pvalue)


def write():
    peers = {
        "clopper_pearson": [{"count": count, "interval": exact(*count)} for count in COUNTS],
        "wilson": [{"count": count, "interval": list(proportion_confint(*count, method="wilson"))} for count in COUNTS],
        "mean": [{"counts": counts, "mean_low_high": mean(counts)} for counts in MEANS],
        "pairs": [{"pairs": pairs, "mcnemar": p_value(*pairs), "newcombe": newcombe(*pairs)} for pairs in PAIRS],
    }
    PEERS.write_text(json.dumps(peers, indent=1) + "\n")
    print(f"{PEERS}: {len(COUNTS)} counts, {len(PAIRS)} tables of pairs")


def check(path):
    """Every object of the report that has counts and an interval, and every one that has pairs."""
    checked = 0

    def close(ours, theirs, where):
        nonlocal checked
        assert all(abs(a - b) < 1e-7 for a, b in zip(ours, theirs)), f"{where}: {ours} here, {theirs} there"
        checked += 1

    def walk(node, where):
        if isinstance(node, dict):
            if "interval_share" in node and "successes" in node:
                close(node["interval_share"], exact(node["successes"], node["trials"]), where)
            if "mean_share" in node:
                counts = [(count["successes"], count["trials"]) for count in node["counts"]]
                close([node["mean_share"], *node["interval_share"]], mean(counts), where)
            if "mcnemar_p_value" in node:
                pairs = [node["pairs"][key] for key in ("both", "first_only", "second_only", "neither")]
                close([node["mcnemar_p_value"], *node["interval_share"]], [p_value(*pairs), *newcombe(*pairs)], where)
            for key, child in node.items():
                walk(child, f"{where}.{key}")
        elif isinstance(node, list):
            for index, child in enumerate(node):
                walk(child, f"{where}[{index}]")

    walk(json.loads(pathlib.Path(path).read_text()), path)
    assert checked, f"{path}: nothing to check"
    print(f"{path}: {checked} figures agree")


if __name__ == "__main__":
    check(sys.argv[1]) if len(sys.argv) > 1 else write()
