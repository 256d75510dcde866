#!/usr/bin/env python3
"""Draws what "raypager bench sweep" measured: figures, and a page that collects them.

    raypager bench sweep scene.rpb -o results
    bench/plot_sweep.py results                          # results/sweep.html and the figures beside it
    bench/plot_sweep.py results -o figures --format png

Reads sweep.json and residency.csv from the folder (bench/README.md says what is in them). Needs matplotlib (Debian: python3-matplotlib).
"""
import argparse
import csv
import html
import json
import re
import sys
from pathlib import Path

try:
    import matplotlib
    matplotlib.use("Agg")
    import numpy
    from matplotlib import pyplot
    from matplotlib.ticker import AutoLocator, FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator
except ImportError as error:
    sys.exit(f"plot_sweep.py: {error}; install matplotlib (Debian: apt-get install python3-matplotlib)")

MOST_TIMELINES = 16
MOST_COLUMNS, MOST_ROWS = 640, 256  # of a timeline
MEBI = 1 << 20
# Okabe and Ito's palette, for all kinds of colour vision; marks and dashes tell series apart on grey paper.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
MARKS = ("o", "s", "^", "D", "v")
DASHES = ("-", "--", ":", "-.")

STYLE = """
body{font:15px/1.45 system-ui,sans-serif;color:#111;background:#fff;max-width:60em;margin:2em auto;padding:0 1em}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #999}
table{border-collapse:collapse;font-size:.85em;width:100%}th,td{padding:.2em .5em;text-align:right;border-bottom:1px solid #ddd}
th{border-bottom:1px solid #111}td.l,th.l{text-align:left}code{font-size:.9em;overflow-wrap:anywhere}
figure{margin:1em 0;break-inside:avoid}figcaption{font-size:.9em}img{width:100%;height:auto}
.good{color:#006b4f}.bad{color:#b00020;font-weight:bold}
@media print{body{margin:0;max-width:none;font-size:10pt}h2{break-after:avoid}@page{margin:15mm}}
"""


class BadInput(Exception):
    """What is wrong, and in which file."""


def reason(error):
    if isinstance(error, KeyError):
        return f"no column {error}"
    return getattr(error, "strerror", None) or error


class Sweep:
    """What a sweep wrote into its folder."""

    def __init__(self, folder):
        self.path = folder / "sweep.json"
        try:
            self.json = json.loads(self.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise BadInput(f"{self.path}: not there; 'raypager bench sweep' writes it when all runs are finished") from None
        except (OSError, ValueError) as error:
            raise BadInput(f"{self.path}: cannot be read: {reason(error)}") from None
        try:
            self.variants, self.runs = self.json["variants"], self.json["runs"]
            self.scene = Path(self.json["input"][0]).name
            self.blocks = int(self.json["scene"]["blocks"])
            self.settings = list(dict.fromkeys(v["settings"] for v in self.variants))  # in order, each once
            for run in self.runs:
                run["of"] = self.variants[run["variant"]]
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise BadInput(f"{self.path}: not what this version's 'bench sweep' writes ({type(error).__name__}: {error})") from None
        if not self.runs:
            raise BadInput(f"{self.path}: holds no runs")
        self.events = self.read_events(folder / "residency.csv")

    def read_events(self, path):
        """When blocks came and left: for each run that has any, arrays of seconds, block, and 1 or -1."""
        events = {}
        try:
            with path.open(newline="", encoding="utf-8") as file:
                for row in csv.DictReader(file):
                    run, block = int(row["run"]), int(row["block"])
                    if not (0 <= run < len(self.runs) and 0 <= block < self.blocks):
                        raise ValueError(f"run {run}, block {block}: sweep.json has no such")
                    events.setdefault(run, []).append((float(row["seconds"]), block, 1 if row["came"] == "1" else -1))
        except (OSError, KeyError, TypeError, ValueError) as error:
            raise BadInput(f"{path}: cannot be read: {reason(error)}") from None
        return {run: tuple(numpy.array(column) for column in zip(*rows)) for run, rows in events.items()}

    def first_runs(self, settings):
        return [run for run in self.runs if run["repeat"] == 1 and run["of"]["settings"] == settings]


def looks():
    """Keyword arguments for one series after the other."""
    for i in range(sys.maxsize):
        yield {"color": COLORS[i % len(COLORS)], "marker": MARKS[i % len(MARKS)], "linestyle": DASHES[i // len(COLORS) % len(DASHES)]}


def shown(points, log_x, log_y):
    """Those of (x, y) that the axes can show, in order of x."""
    return sorted((x, y) for x, y in points if (x > 0 or not log_x) and (y > 0 or not log_y))


def log_axis(axis):
    """Plain numbers, 1, 2 and 5 of each decade or closer ones; over many decades powers of ten, which is matplotlib's way."""
    low, high = axis.get_view_interval()
    if high / low > 1000:
        return
    locator = LogLocator(subs=(1, 2, 5))
    if sum(low <= tick <= high for tick in locator.tick_values(low, high)) < 3:
        locator = AutoLocator()
    axis.set_major_locator(locator)
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.6g}"))
    axis.set_minor_formatter(NullFormatter())


def limit_axis(axis, percentages):
    """A tick for each limit that was measured, unless it would stand too close to the one before."""
    ticks = []
    for percent in sorted(percentages):
        if not ticks or percent > 1.2 * ticks[-1]:
            ticks.append(percent)
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    axis.set_minor_locator(NullLocator())


def new_figure(title, x_label, y_label):
    figure, axes = pyplot.subplots(figsize=(8, 5), layout="constrained")
    axes.set_title(title)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return figure, axes


def finish_axes(axes, series):
    axes.grid(True, color="#dddddd", linewidth=0.8)
    axes.set_axisbelow(True)
    if not any(len(line.get_xdata()) for line in axes.lines):
        axes.text(0.5, 0.5, "no data", transform=axes.transAxes, ha="center")
        return
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            log_axis(axis)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncol=1 if series == 1 else 2, frameon=False)


def plot(axes, points, **look):
    axes.plot([x for x, _ in points], [y for _, y in points], markersize=5, linewidth=1.6, clip_on=False, **look)


def convergence_figure(sweep, settings):
    figure, axes = new_figure(f"{sweep.scene}: convergence, {settings}", "time of rendering (s)", "RMSE against the reference")
    axes.set_xscale("log")
    axes.set_yscale("log")
    runs = sweep.first_runs(settings)
    for run, look in zip(runs, looks()):
        name = "all geometry in mapped host memory" if run["policy"] == "host" else f"{run['limit']} resident"
        points = shown(((point[0], point[2]) for point in run["convergence"]), True, True)
        plot(axes, points, label=name, **look)
    finish_axes(axes, len(runs))
    return figure


def limit_figure(sweep, title, y_label, log_y, of_variant, of_run):
    """A quantity against the limit: medians as lines, single runs as pale marks."""
    figure, axes = new_figure(f"{sweep.scene}: {title} against the limit", "resident geometry (% of the scene)", y_label)
    axes.set_xscale("log")
    if log_y:
        axes.set_yscale("log")
    for settings, look in zip(sweep.settings, looks()):
        medians = [(v["resident_percent"], of_variant(v)) for v in sweep.variants if v["settings"] == settings]
        singles = [(run["of"]["resident_percent"], of_run(run)) for run in sweep.runs if run["of"]["settings"] == settings]
        plot(axes, shown(medians, True, log_y), label=settings, zorder=3, **look)
        plot(axes, shown(singles, True, log_y), alpha=0.3, **{**look, "linestyle": "none"})
    axes.plot([], [], label="pale marks: single runs", color="#999999", marker="o", alpha=0.5, linestyle="none")
    if not log_y:
        axes.set_ylim(bottom=0, top=max(1, axes.get_ylim()[1]))
    finish_axes(axes, 1 + len(sweep.settings))
    limit_axis(axes.xaxis, {v["resident_percent"] for v in sweep.variants})
    return figure


def residency_shares(sweep, run):
    """Rows of blocks, columns of time: the share of a cell's blocks that is resident in the middle of its time."""
    seconds, block, change = sweep.events[run]
    whole = sweep.runs[run]["timeline_seconds"]
    in_row = -(-sweep.blocks // MOST_ROWS)
    rows = -(-sweep.blocks // in_row)
    middles = (numpy.arange(MOST_COLUMNS) + 0.5) / MOST_COLUMNS * whole
    changes = numpy.zeros((rows, MOST_COLUMNS + 1))
    numpy.add.at(changes, (block // in_row, numpy.searchsorted(middles, seconds)), change)
    sizes = numpy.minimum(in_row, sweep.blocks - in_row * numpy.arange(rows))
    return numpy.cumsum(changes[:, :-1], axis=1) / sizes[:, None]


def residency_figure(sweep, run):
    of = sweep.runs[run]["of"]
    figure, axes = new_figure(f"{sweep.scene}: resident blocks, {of['settings']}, {of['limit']} resident", "time of rendering (s)",
                              f"block (of {sweep.blocks:,})")
    shares = residency_shares(sweep, run)
    picture = axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto", interpolation="nearest",
                          extent=(0, sweep.runs[run]["timeline_seconds"], sweep.blocks + 0.5, 0.5))
    figure.colorbar(picture, ax=axes, label="share of the blocks in a cell that are resident")
    return figure


class Page:
    """Figures and text, written into one folder."""

    def __init__(self, folder, ending, dpi):
        self.folder, self.ending, self.dpi = folder, ending, dpi
        self.parts, self.files = [], []

    def add(self, text):
        self.parts.append(text)

    def draw(self, name, caption, figure):
        file = self.folder / f"{file_name(name)}.{self.ending}"
        figure.savefig(file, dpi=self.dpi, metadata={"Date": None} if self.ending == "svg" else None)
        pyplot.close(figure)
        self.files.append(file)
        self.add(f"<figure><img src=\"{file.name}\" alt=\"{html.escape(caption)}\"><figcaption>{html.escape(caption)}</figcaption></figure>")

    def write(self, title):
        head = f"<!doctype html><html lang=en><head><meta charset=utf-8><title>{html.escape(title)}</title><style>{STYLE}</style></head><body>\n"
        path = self.folder / "sweep.html"
        path.write_text(head + "\n".join(self.parts) + "\n</body></html>\n", encoding="utf-8")
        return path


def file_name(text):
    return re.sub(r"[^a-z0-9.]+", "-", text.lower().replace("%", " percent")).strip("-")


def conditions(sweep):
    device, scene, image, reference = (sweep.json[key] for key in ("device", "scene", "image", "reference"))
    kinds = [f"{scene[kind]:,} {kind}" for kind in ("triangles", "spheres") if scene[kind]]
    spp = " or ".join(sorted({str(run["spp"]) for run in sweep.runs}, key=int))
    error = (max(run["spp"] for run in sweep.runs) / reference["spp"]) ** 0.5
    return (f"<p>{html.escape(sweep.scene)}: {' and '.join(kinds)} in {sweep.blocks:,} blocks, {scene['geometry_bytes'] / MEBI:,.1f} MiB. "
            f"{image['width']}x{image['height']} pixels, {spp} samples per pixel, at most {image['max_depth']} scattering events, "
            f"seed {image['seed']}.<br>Device: {html.escape(device['name'])} ({html.escape(device['platform'])}, driver "
            f"{html.escape(device['driver'])}).<br>raypager {html.escape(sweep.json['raypager'])}, {html.escape(sweep.json['date'])}. "
            f"Command: <code>{html.escape(sweep.json['command'])}</code></p>\n"
            f"<p>Error is the root mean square over pixels and channels against a reference of {reference['spp']:,} samples per pixel with "
            f"another seed ({html.escape(Path(reference['path']).name)}), whose own error is at most about {error:.2g} of that of the finished "
            "pictures. Time is that of rendering, without the snapshots that the curves are made of. Repeats were interleaved; tables hold "
            "medians. “× roomiest” is the median of the ratios to the same repeat at the largest limit.</p>")


def film_verdict(sweep):
    if not sweep.json["same_films"]:
        lines = "".join(f"<li>{html.escape(line)}</li>" for line in sweep.json["different_films"])
        return f"<p class=bad>Films differ that must be the same. These measurements are worth nothing.</p><ul>{lines}</ul>"
    films = dict.fromkeys(f"{run['connection']} at {run['spp']} samples per pixel: {run['film_hash']}" for run in sweep.runs)
    return ("<p class=good>Every run with the same connection rule and number of samples ended in the same film, bit for bit. Film hashes: "
            f"{html.escape('; '.join(films))}.</p>")


def table(sweep):
    geometry = sweep.json["scene"]["geometry_bytes"] or 1
    rows = ["<tr><th>resident<th class=l>settings<th>seconds<th>× roomiest<th>stall<th>Mrays/s<th>MiB moved<th>× scene<th>bytes per ray<th>rounds"
            "<th>RMSE<th>s to common RMSE</tr>"]
    for v in sweep.variants:
        to_rmse = "–" if v["seconds_to_rmse"] is None else f"{v['seconds_to_rmse']:.3f}"
        rows.append(f"<tr><td>{html.escape(v['limit'])}<td class=l>{html.escape(v['settings'])}<td>{v['seconds']:.3f}<td>{v['slow_down']:.3f}"
                    f"<td>{100 * v['stall_share']:.1f} %<td>{v['rays_per_second'] / 1e6:.2f}<td>{v['bytes_loaded'] / MEBI:.1f}"
                    f"<td>{v['bytes_loaded'] / geometry:.2f}<td>{v['bytes_per_ray']:.2f}<td>{v['rounds']:.0f}<td>{v['rmse']:.4g}<td>{to_rmse}</tr>")
    return "<table>" + "\n".join(rows) + f"</table>\n<p>Common RMSE: {sweep.json['common_rmse']:.4g}.</p>"


def add_timelines(sweep, page):
    page.add("<h2>Residency</h2>")
    runs = [run for run in sorted(sweep.events) if sweep.runs[run]["evictions"] > 0 and sweep.runs[run]["timeline_seconds"]]
    if not runs:
        page.add("<p>No block had to leave in any of these runs.</p>")
    for run in runs[:MOST_TIMELINES]:
        told = sweep.runs[run]
        page.draw(f"residency {told['of']['settings']} {told['limit']}",
                  f"Which blocks were resident when, {told['of']['settings']} with {told['limit']} resident: {told['loads']:,} loads, "
                  f"{told['evictions']:,} evictions in {told['rounds']:,} rounds.", residency_figure(sweep, run))
    if len(runs) > MOST_TIMELINES:
        page.add("<p>Further timelines are left out.</p>")


def draw(sweep, page):
    page.add(f"<h1>{html.escape(sweep.scene)} at shrinking memory limits</h1>")
    page.add(conditions(sweep))
    page.add(film_verdict(sweep))
    page.add("<h2>Figures</h2>\n" + table(sweep))
    page.add("<h2>Convergence</h2>")
    for settings in sweep.settings:
        page.draw(f"convergence {settings}", f"RMSE against time, {settings}. First repeat.", convergence_figure(sweep, settings))
    page.add("<h2>Cost of less memory</h2>")
    page.draw("time", "Time against the limit. Lines: medians; pale marks: single runs.",
              limit_figure(sweep, "time", "time of rendering (s)", True, lambda v: v["seconds"], lambda run: run["seconds"]))
    page.draw("moved", "Bytes moved against the limit.",
              limit_figure(sweep, "bytes moved", "moved to the device (MiB)", True, lambda v: v["bytes_loaded"] / MEBI,
                           lambda run: run["bytes_loaded"] / MEBI))
    page.draw("stall", "Stall against the limit: the share of the time in which every ray waited for a block.",
              limit_figure(sweep, "stall", "time with nothing to trace (%)", False, lambda v: 100 * v["stall_share"],
                           lambda run: 100 * run["stall_seconds"] / run["seconds"] if run["seconds"] > 0 else 0))
    add_timelines(sweep, page)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, metavar="DIR", help="what was given to 'bench sweep' with -o")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for the page and the figures; made if absent (default: the same)")
    parser.add_argument("--format", choices=("svg", "png"), default="svg", help="of the figures (default: svg)")
    parser.add_argument("--dpi", type=int, default=150, metavar="N", help="dots per inch of png figures and of timelines (default: 150)")
    given = parser.parse_args()
    if not 10 <= given.dpi <= 2400:
        parser.error("--dpi: from 10 to 2400")
    output = given.output or given.folder
    matplotlib.rcParams["svg.hashsalt"] = "raypager"  # the same figures give the same files
    try:
        sweep = Sweep(given.folder)
        output.mkdir(parents=True, exist_ok=True)
        page = Page(output, given.format, given.dpi)
        draw(sweep, page)
        path = page.write(f"raypager: {sweep.scene}")
    except BadInput as error:
        sys.exit(f"plot_sweep.py: {error}")
    except (KeyError, TypeError, IndexError) as error:
        sys.exit(f"plot_sweep.py: {sweep.path}: not what this version's 'bench sweep' writes ({type(error).__name__}: {error})")
    except OSError as error:
        sys.exit(f"plot_sweep.py: {output}: cannot be written: {reason(error)}")
    print(f"{path}: {len(page.files)} figures")


if __name__ == "__main__":
    main()
