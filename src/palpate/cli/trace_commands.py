"""`palpate replay` and `palpate trace`: recorded touches, felt again, looked at, compared and taken elsewhere."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.number_options import count_option, number_option
from palpate.cli.table_options import Force, Json
from palpate.errors import UsageError
from palpate.output_files import require_outputs

if TYPE_CHECKING:
    import numpy as np

    from palpate.devices.trace_file import Trace
    from palpate.validation.report.trace_pictures import Solved
    from palpate.validation.touch_comparison import TouchComparison

__all__ = ["replay", "trace_app"]

trace_app = typer.Typer(
    cls=CommandGroup, help="Recorded touches: look at them, compare them, export them.", no_args_is_help=True
)

TraceFile = Annotated[
    Path, typer.Argument(help="Recorded touch, as [bold]palpate run --record[/] writes it.")
]
ModelOption = Annotated[
    Path | None, typer.Option(help="Model file. Default: the recorded one, where it was or beside the trace.")
]
Picture = Annotated[Path | None, typer.Option("-o", "--out", help="Picture to write: .svg, .png or .pdf.")]


def replay(
    file: TraceFile,
    model: Annotated[
        Path | None, typer.Option(help="Another model under the same hand. Default: the recorded one.")
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Show the touch on a page, at its own pace.")] = False,
    own_workspace: Annotated[
        bool,
        typer.Option("--own-workspace", help="Lay another model in the hand as it would lie by itself."),
    ] = False,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Trace to write with the forces of the replay.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Feel a recorded touch again, and say whether every force is the recorded one to the last bit."""
    from palpate.runtime.replay import Replay, is_recorded_model
    from palpate.runtime.touchable import load_touchable

    if view and (own_workspace or out is not None):
        raise UsageError(
            "A page shows the touch in its own workspace, and writes no trace.",
            fix="Leave out --view, or --own-workspace and --out.",
        )
    console = Console(as_json)
    trace = _read(file, console)
    path: Path = _model_of(trace) if model is None else model
    same = is_recorded_model(trace, path)
    if not same:
        known = trace.header.get("model", {}).get("file", "unknown")
        console.say(f"{path} is not the model that was recorded ({known}).")
    if view:
        _show(path, file, console)
        return
    replayed = Replay(trace, load_touchable(path), same=same, own_workspace=own_workspace).run()
    if out is not None:
        replayed.save(out, path)
    where = "" if out is None else f"\n{out}"
    console.result(f"{replayed}{where}", replayed.as_dict() | {"model": str(path), "same_model": same})


def _show(model: Path, file: Path, console: Console) -> None:
    from palpate.viewer import serve

    if not sys.stdout.isatty():
        console.say("No terminal: the page's address follows; Ctrl-C ends it.")
    serve(model, replay=file, open_browser=sys.stdout.isatty())


def _read(file: Path, console: Console) -> Trace:
    from palpate.devices.trace_file import read_trace

    trace = read_trace(file)
    for note in trace.notes:
        console.say(note)
    return trace


def _model_of(trace: Trace) -> Path:
    """Return the file of the recorded model, by its checksum where it was and beside the trace."""
    from palpate.runtime.replay import is_recorded_model

    known = trace.header.get("model", {})
    places: list[Path] = [Path(known.get("path", "")), trace.path.parent / known.get("file", "")]
    for place in places:
        if place.is_file() and is_recorded_model(trace, place):
            return place
    raise UsageError(
        f"The model that was touched, {known.get('file', 'unknown')}, is not there.",
        why=f"Looked for {' and '.join(map(str, places))}, with the checksum {known.get('sha256', '')[:12]}….",
        fix="Name its file, or another model, with --model.",
    )


@trace_app.command()
def info(file: TraceFile, as_json: Json = False) -> None:
    """Print what a trace holds: device, body, rate, duration, largest force, faults, size on disk and in memory."""
    console = Console(as_json)
    trace = _read(file, console)
    facts = _facts(trace)
    console.result(_in_words(trace, facts), facts)


def _facts(trace: Trace) -> dict[str, Any]:
    """Return what a trace holds, as data for a program."""
    import numpy as np

    header, ticks = trace.header, trace.ticks
    names = ("palpate", "recorded", "model", "device", "rate", "limits", "workspace")
    return {
        "file": str(trace.path),
        "format": header["version"],
        "body": header.get("name"),
        **{name: header.get(name) for name in names},
        "ticks": len(ticks),
        "seconds": trace.seconds,
        "lost": trace.lost,
        "complete": trace.end is not None,
        "replayable": trace.state is not None and not trace.lost,
        "largest_force": float(np.linalg.norm(ticks["force"], axis=1).max(initial=0.0)),
        "lateness_p99": float(np.quantile(ticks["lateness"], 0.99)) if len(ticks) else 0.0,
        "faults": _onsets(ticks["fault"]),
        "events": [dict(event) for event in trace.events],
        "bytes": trace.size,
        "bytes_a_minute": trace.size / max(trace.seconds, 1e-9) * 60.0,
        "bytes_in_memory": int(ticks.nbytes),
        "notes": list(trace.notes),
    }


def _onsets(faults: np.ndarray) -> dict[str, int]:
    """Return how often each fault began."""
    import numpy as np

    from palpate.runtime.safety import Fault

    onsets = {}
    for fault in Fault:
        bad = faults == fault
        begun = int(bad[:1].sum() + (np.diff(bad.astype(int)) == 1).sum())
        if fault is not Fault.NONE and begun:
            onsets[fault.name.lower()] = begun
    return onsets


def _in_words(trace: Trace, facts: dict[str, Any]) -> str:
    from palpate.format import count

    faults = ", ".join(f"{n} × {name.replace('_', ' ')}" for name, n in facts["faults"].items())
    model = facts["model"] or {}
    loop = "its loop had not begun"
    if facts["limits"] is not None:
        loop = f"{facts['rate']:g} Hz, at most {facts['limits']['max_force']:g} N"
    lines = [
        f"{trace.path}: {count(len(trace), 'tick')} in {trace.seconds:.3f} s, "
        f"recorded {(facts['recorded'] or '')[:19]} UTC",
        f"  body       {facts['body']}, {model.get('file')} ({model.get('sha256', '')[:12]}…)",
        f"  device     {facts['device']}: {loop}",
        f"  force      up to {facts['largest_force']:.3g} N",
        f"  lateness   {1e6 * facts['lateness_p99']:.0f} µs (p99)",
        f"  faults     {faults or 'none'}",
        f"  lost       {count(trace.lost, 'tick') if trace.lost else 'nothing'}",
        f"  replay     {'to the last bit' if facts['replayable'] else 'not to the last bit: ' + _why_not(trace)}",
        f"  size       {trace.size / 1e6:.2f} MB ({facts['bytes_a_minute'] / 1e6:.1f} MB a minute), "
        f"{facts['bytes_in_memory'] / 1e6:.1f} MB in memory",
        f"  made by    palpate {facts['palpate']}, layout {facts['format']}",
    ]
    events = [f"  event      tick {e.get('tick')}: {e.get('kind')} {e.get('text', '')}" for e in trace.events]
    return "\n".join(lines + events)


def _why_not(trace: Trace) -> str:
    return "ticks are lost" if trace.lost else "what the loop remembered at the beginning is not in it"


@trace_app.command()
def export(
    file: TraceFile,
    out: Annotated[Path, typer.Option("-o", "--out", help="Table to write: .csv, .npz or .parquet.")],
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a trace as a table for other programs: CSV, NumPy's NPZ, or Parquet (with pyarrow)."""
    from palpate.format import count
    from palpate.runtime.trace_export import export_trace

    console = Console(as_json)
    trace = _read(file, console)
    path = export_trace(trace, out, overwrite=force)
    console.result(f"{path}: {count(len(trace), 'row')}", {"file": str(path), "rows": len(trace)})


@trace_app.command()
def plot(
    file: TraceFile,
    out: Picture = None,
    data: Annotated[
        Path | None, typer.Option(help="Dataset of solves (.zarr); those beside the stroke are drawn too.")
    ] = None,
    model: ModelOption = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw force and depth in time, and the force by depth, beside the finite elements' solves where they are given."""
    from palpate.validation.report.trace_pictures import plot_trace, save_figure

    console = Console(as_json)
    target = out or file.with_suffix(".svg")
    require_outputs([target], inputs=[file], overwrite=force)
    trace = _read(file, console)
    if not len(trace):
        raise UsageError(f"{file.name} holds no tick.", why=" ".join(trace.notes))
    solved, apart = (None, 0.0) if data is None else _beside_solves(trace, data, model)
    path = save_figure(target, lambda: plot_trace(trace, solved))
    words = (
        ""
        if solved is None
        else f"\n{len(solved[0])} solves within {100 * apart / 2:.2g} % of the inputs' ranges"
    )
    facts = {"solves": 0 if solved is None else len(solved[0]), "within": apart / 2}
    console.result(f"{path}{words}", {"file": str(path)} | facts)


def _beside_solves(trace: Trace, data: Path, model: Path | None) -> tuple[Solved, float]:
    """Return the solves beside a stroke, and how far from it the farthest is, in half ranges of the inputs."""
    import numpy as np

    from palpate.dataset import Dataset
    from palpate.runtime.touchable import load_touchable
    from palpate.units import bounds
    from palpate.validation.touch_comparison import solves_beside
    from palpate.validation.unseen_solves import TouchSolves

    touch = load_touchable(_model_of(trace) if model is None else model)
    solves = TouchSolves.of(Dataset.open(data), touch.inputs)
    low, high = bounds(touch.inputs)
    rows, apart = solves_beside(trace, solves, (np.asarray(high) - np.asarray(low)) / 2.0)
    X = solves.X[rows]
    sizes = (np.linalg.norm(force, axis=1) for force in (solves.force[rows], touch.energy.force(X)))
    return (touch.depth(X), *sizes), apart


@trace_app.command()
def compare(
    file: TraceFile,
    other: Annotated[
        Path | None, typer.Argument(help="Another trace, such as one that palpate replay --out has written.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(help="Compare with another model under the same hand.")
    ] = None,
    full_model: Annotated[
        Path | None,
        typer.Option(help="Compare with the finite elements of this study file under the same hand."),
    ] = None,
    limit: Annotated[
        float,
        number_option("--limit", "s", least=1.0, help="For --full-model: seconds for all solves together."),
    ] = 300.0,
    points: Annotated[
        int,
        count_option(
            "--points", least=2, help="For --full-model: moments of the stroke that are solved at most."
        ),
    ] = 200,
    out: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compare a trace with another one, another model, or the full model; differences in what a person notices."""
    console = Console(as_json)
    if out is not None:
        require_outputs([out], inputs=[file], overwrite=force)
    trace = _read(file, console)
    if sum(value is not None for value in (other, model, full_model)) != 1:
        raise UsageError(
            "A trace is compared with one thing.", fix="Give another trace, --model or --full-model."
        )
    if full_model is not None:
        comparison = _beside_full_model(trace, full_model, limit, points, console)
    else:
        comparison = _beside_trace(trace, other, model, console)
    content = comparison.as_dict()
    where = ""
    if out is not None:
        from palpate.validation.report.trace_pictures import plot_comparison, save_figure

        content["file"] = str(save_figure(out, lambda: plot_comparison(comparison)))
        where = f"\n{out}"
    console.result(f"{comparison}{where}", content)


def _beside_trace(trace: Trace, other: Path | None, model: Path | None, console: Console) -> TouchComparison:
    from dataclasses import replace

    from palpate.runtime.replay import Replay, is_recorded_model
    from palpate.runtime.touchable import load_touchable
    from palpate.validation.touch_comparison import compare_traces

    if other is not None:
        return compare_traces(trace, _read(other, console))
    assert model is not None
    replayed = Replay(trace, load_touchable(model), same=is_recorded_model(trace, model)).run()
    return compare_traces(trace, replace(trace, path=model, ticks=replayed.ticks))


def _beside_full_model(
    trace: Trace, study: Path, limit: float, points: int, console: Console
) -> TouchComparison:
    from palpate.study import read_study
    from palpate.validation.full_model import compare_full_model

    def progress(done: int, total: int, seconds: float) -> None:
        console.say(f"{done} of {total} moments solved in {seconds:.0f} s …")

    problem = read_study(study).problem(whole=True)
    return compare_full_model(trace, problem, limit=limit, most=points, progress=progress)
