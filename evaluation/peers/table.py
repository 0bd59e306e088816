"""Writes the table of docs/results/peers.md from the results of the peers."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from statistics import median
from typing import Any

#: The least visibility of a hidden effect that counts, standard deviations of the noise: docs/naming.md.
VISIBLE = 0.3
ORDER = ("truing_gap", "structured", "mujoco_sysid", "sparse", "stepwise")
BEGIN, END = "<!-- peers -->", "<!-- /peers -->"

Results = dict[str, dict[str, Any]]


def held(cases: list[dict[str, Any]], results: Results) -> str:
    """How many intervals hold the truth, of the effects whose form is the library's and that the peer gives an interval for."""
    hits = []
    for case in cases:
        truth = case["truth"]
        result = results.get(case["name"], {})
        if truth["form_in_library"] and result.get("right", True):
            intervals = result.get("intervals", {})
            named = {name: f"{truth['hidden'][0]}.{name}" for name in truth["parameters"]}
            found = {name: intervals.get(named[name], intervals.get(name)) for name in named}
            pairs = [(found[name], value) for name, value in truth["parameters"].items() if found[name]]
            if pairs:
                hits.append(all(low <= value <= high for (low, high), value in pairs))
    return f"{sum(hits)}/{len(hits)}" if hits else "none"


def fits(cases: list[dict[str, Any]], results: Results) -> str:
    """Median held-out fit over the cases; what cannot be done or runs away counts as nothing explained."""
    values = [max(0.0, results.get(case["name"], {}).get("fit") or 0.0) for case in cases]
    return f"{median(values):.1f}" if values else "–"


def right(cases: list[dict[str, Any]], results: Results) -> str:
    given = [results.get(case["name"], {}).get("right") for case in cases]
    return f"{sum(bool(answer) for answer in given)}" if any(a is not None for a in given) else "–"


def row(peer: dict[str, Any], cases: list[dict[str, Any]]) -> str:
    results = peer["results"]
    rigs = [case for case in cases if case["group"] == "rig"]
    moving = [case for case in rigs if not case["static"]]
    known = [case for case in rigs if case["accepted"]]
    hidden = [case for case in cases if case["truth"] and case["truth"]["visibility"] > VISIBLE]
    nothing = [case for case in cases if case["truth"] and not case["truth"]["hidden"]]
    seconds = sum(result["cpu_s"] for result in results.values())
    cells = [
        f"{peer['peer']} ({peer['version'].split()[-1]})", right(hidden, results), right(nothing, results),
        fits(hidden + nothing, results), held(hidden, results), right(known, results), fits(moving, results), f"{seconds:.0f}",
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def better(peers: list[dict[str, Any]], cases: list[dict[str, Any]]) -> str:
    """Where a peer predicts better than Truing by half a per cent of fit."""
    ours, others = peers[0]["results"], peers[1:]
    found = []
    for peer in others:
        names = [
            case["name"]
            for case in cases
            if (peer["results"].get(case["name"], {}).get("fit") or 0.0) > (ours[case["name"]].get("fit") or 0.0) + 0.5
        ]
        rigs = [f"`{name}`" for name in names if not name.startswith("case-")]
        drawn = len(names) - len(rigs)
        words = rigs + ([f"{drawn} drawn cases" if drawn > 1 else "a drawn case"] if drawn else [])
        found.append(f"{peer['peer']} {', '.join(words) or 'nowhere'}")
    return "Better than Truing by 0.5 % of fit: " + "; ".join(found) + "."


def written(peers: list[dict[str, Any]], cases: list[dict[str, Any]]) -> str:
    hidden = sum(bool(case["truth"] and case["truth"]["visibility"] > VISIBLE) for case in cases)
    nothing = sum(bool(case["truth"] and not case["truth"]["hidden"]) for case in cases)
    moving = sum(case["group"] == "rig" and not case["static"] for case in cases)
    known = sum(bool(case["accepted"]) for case in cases)
    head = [
        f"| peer | right of {hidden} | none of {nothing} | fit | hold | rigs right of {known} | fit, {moving} rigs | CPU s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    return "\n".join([*head, *(row(peer, cases) for peer in peers), "", better(peers, cases)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--page", type=Path, help="where the table goes; without it: standard output")
    arguments = parser.parse_args()
    cases = json.loads((arguments.results / "cases.json").read_text())
    files = [arguments.results / f"{name}.json" for name in ORDER]
    peers = [json.loads(file.read_text()) for file in files if file.is_file()]
    text = written(peers, cases)
    if arguments.page is None:
        print(text)
        return
    before, rest = arguments.page.read_text().split(BEGIN)
    after = rest.split(END)[1]
    arguments.page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}")


if __name__ == "__main__":
    main()
