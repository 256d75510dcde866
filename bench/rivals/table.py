"""What a comparison found, as Markdown and as JSON."""

import argparse
import datetime
import json
import shlex
import subprocess
from pathlib import Path
from typing import NamedTuple

from .options import ROOT


class Row(NamedTuple):
    """Medians over the repeats; seconds are those to the target."""

    tool: str
    ours: bool
    resident: str
    samples: int
    rmse: float  # with these samples
    render: float
    whole: float
    processor: float
    memory: int  # most bytes at once: of a GPU's, or of main memory


def processor_name() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return "unknown"


def conditions(options: argparse.Namespace, command: list[str], cores: int) -> dict:
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    version = subprocess.run([options.raypager, "--version"], capture_output=True, text=True).stdout.strip()
    script = Path(command[0]).resolve()
    words = [str(script.relative_to(ROOT) if script.is_relative_to(ROOT) else script), *command[1:]]
    return {
        "date": datetime.date.today().isoformat(),
        "command": shlex.join(words),
        "raypager": version + (f" ({commit})" if commit else ""),
        "processor": processor_name(),
        "cores": cores,
        "repeats": options.repeats,
        "reference_spp": options.reference_spp,
        "most_bias": options.most_bias / 100,
        "most_difference": options.most_difference / 100,
    }


def percent(share: float) -> str:
    return f"{100 * share:.2f} %"


def pictures_of(result: dict) -> list[str]:
    found = result["agreement"]
    biases = ", ".join(f"{100 * b:+.2f}" for b in found["bias"])
    verdict = "the same" if result["agree"] else "**not the same: no times**"
    return [
        f"{result['scene']}, {result['triangles']:,} triangles",
        f"{found['rmse']:.4g}",
        percent(found["relative"]),
        f"{biases} %, each +- {100 * max(found['bias_error']):.2f}",
        percent(found["unexplained"]),
        verdict,
    ]


def columns(result: dict) -> tuple[str, ...]:
    """A GPU's renderer leaves processors idle."""
    return ("render", "whole", "processor") if result["raypager"]["type"] == "CPU" else ("render", "whole")


def times_of(result: dict) -> list[list[str]]:
    rows = [Row(**row) for row in result["rows"]]
    best = min((row for row in rows if not row.ours), key=lambda row: row.render, default=None)
    lines = []
    for row in rows:
        cells = [result["scene"], row.tool, row.resident, str(row.samples), f"{row.rmse:.4g}"]
        for name in columns(result):
            seconds, other = getattr(row, name), getattr(best, name)
            cells += [f"{seconds:.3g}", f"**{seconds / other:.2f}**" if row.ours and name == "render" else f"{seconds / other:.2f}"]
        lines.append(cells + [f"{row.memory / 2**20:.0f}"])
    return lines


def markdown(heads: list[str], rows: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [heads, ["---"] * len(heads), *rows])


def text_of(conditions: dict, results: list[dict]) -> str:
    rival, device = results[0]["rival"], results[0]["raypager"]
    own = f"{conditions['raypager']} on {device['name']} ({device['platform']} {device['driver']})"
    other = f"{rival['version']} on {rival['device']}"
    where = f"{conditions['date']}; {conditions['processor']}, {conditions['cores']} cores"
    parts = [
        f"`{conditions['command']}`",
        f"{where}; {own}; {other}; {results[0]['size']}; medians of {conditions['repeats']}.",
        f"Pictures, {2 * conditions['reference_spp']} samples of each:",
        markdown(["scene", "RMSE", "relative difference", "bias R, G, B", "not explained by noise", "pictures"], [pictures_of(r) for r in results]),
    ]
    times = [line for result in results for line in times_of(result)]
    if times:
        heads = ["scene", "renderer", "resident", "samples", "RMSE with these"]
        for name in columns(results[0]):
            heads += [{"render": "render, s", "whole": "with building, s", "processor": "processor, s"}[name], "ratio"]
        heads += ["memory, MiB"]
        parts += ["Seconds to raypager's RMSE; a ratio below 1 means that raypager is faster:", markdown(heads, times)]
    return "\n\n".join(parts) + "\n"


def write(folder: Path, conditions: dict, results: list[dict]) -> str:
    """result.json and result.md; the latter's text."""
    text = text_of(conditions, results)
    (folder / "result.json").write_text(json.dumps(conditions | {"results": results}, indent=2) + "\n")
    (folder / "result.md").write_text(text)
    return text
