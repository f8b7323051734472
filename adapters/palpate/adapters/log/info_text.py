"""Text summary of logs: a page for one log, or a table for several."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from palpate.adapters.log.info import LATE_S
from palpate.adapters.log.records import IMPORTED
from palpate.adapters.log.tables import aligned, counted

_MOST_LINES: Final = 5
_AS_REQUESTED: Final = "all applied as requested"


def describe(info: Mapping[str, Any]) -> str:
    """Format a page about one log from the result of ``info_of``."""
    ticks = info["ticks"]
    trial = f"{info['command']}, {info['arm']}, scenario {info['scenario']}, seed {info['seed']}, trial {info['trial']}"
    lines = [
        ("DAMAGED", info["damage"]),
        ("trial", trial),
        ("policy", _policy(info)),
        ("world", info["world"] + (", a what-if and no observation" if info["derived_from"] else "")),
        ("format", info["schema"]),
        ("versions", _pairs(info["versions"])),
        ("drawn", _pairs(info["drawn"])),
        ("made from", info["derived_from"]),
        ("duration", f"{ticks['duration_s']:.3f} s, {ticks['count']} ticks"),
        ("size", f"{info['size_bytes'] / 1e3:.1f} kB, messages {info['raw_bytes'] / 1e3:.1f} kB before compression"),
        ("messages", _pairs({topic: count for topic, count in info["messages"].items() if count})),
        ("control rate", f"{_number(ticks['rate_Hz'], '.3f')} Hz; interval {_spread(ticks['interval_s'])}"),
        ("late ticks", f"{ticks['late']} by more than {LATE_S * 1e3:g} ms; lateness {_spread(ticks['lateness_s'])}"),
        ("missing ticks", _missing(ticks)),
        ("incomplete", f"{ticks['incomplete']} ticks lack a reading or the command" if ticks["incomplete"] else ""),
        ("force sensor", _port(info["force_sensor"])),
        ("encoders", _port(info["joint_encoder"])),
        ("commands", f"altered: {_pairs(info['altered_commands'])}" if info["altered_commands"] else _AS_REQUESTED),
        ("arm stopped", counted(info["stops"], "time")),
        *_listed("acknowledged", info["acknowledged"]),
        *_listed("errors", info["errors"] or ["none"]),
        *_listed(
            "recorder", [f"{info['dropped_messages']} messages dropped", *info["losses"]] if info["losses"] else []
        ),
        ("trip", "{reason}: {text} (tick {tick})".format(**info["trip"]) if info["trip"] else ""),
        *_end(info["end"]),
    ]
    return f"{info['path']}\n" + "".join(f"  {name:<15}{text}\n" for name, text in lines if text)


def table(infos: Sequence[Mapping[str, Any]]) -> str:
    """Format a table with one line per log."""
    head = ("log", "trial", "policy", "s", "Hz", "age ms", "missing", "late", "lost", "altered", "outcome", "MB/min")
    rows = [head]
    for info in infos:
        ticks, age_s, end = info["ticks"], info["force_sensor"]["age_s"], info["end"]
        rows.append(
            (
                info["path"],
                str(info["trial"]),
                info["policy"],
                f"{ticks['duration_s']:.2f}",
                _number(ticks["rate_Hz"], ".2f"),
                _number(age_s and age_s["median"], ".2f", 1e3),
                str(ticks["missing"]),
                str(ticks["late"]),
                str(info["dropped_messages"]),
                str(sum(info["altered_commands"].values())),
                "damaged" if info["damage"] else "cut short" if end is None else _outcome(end),
                _number(info["bytes_per_minute"], ".2f", 1e-6),
            )
        )
    # Words are aligned left, numbers right.
    return aligned(rows, left=(0, 2, 10))


def _policy(info: Mapping[str, Any]) -> str:
    name = "from a policy file or learned" if info["policy"] == "document" else info["policy"]
    text = f"{name}, {'does not learn' if info['frozen'] else 'learns'}"
    return text if info["temperature"] is None else f"{text}, temperature {info['temperature']:.3g}"


def _missing(ticks: Mapping[str, Any]) -> str:
    if not ticks["missing"]:
        return "none"
    shown = [f"{a}" if a == b else f"{a} to {b}" for a, b in ticks["gaps"][:_MOST_LINES]]
    return f"{ticks['missing']}: {', '.join(shown)}{', ...' * (len(ticks['gaps']) > _MOST_LINES)}"


def _port(port: Mapping[str, Any]) -> str:
    trusted = f"not trusted: {_pairs(port['not_valid'])}" if port["not_valid"] else "all valid"
    read = f"{port['samples']} readings, {port['repeats']} of them repeats, {trusted}"
    return f"{read}; {_number(port['rate_Hz'], '.3f')} Hz; age at the tick {_spread(port['age_s'])}"


def _listed(name: str, texts: Sequence[str]) -> list[tuple[str, str]]:
    shown = [" ".join(text.split()) for text in texts[:_MOST_LINES]]
    shown += [f"and {len(texts) - _MOST_LINES} more"] * (len(texts) > _MOST_LINES)
    return [("" if number else name, text) for number, text in enumerate(shown)]


def _end(end: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    if end is None:
        return [("outcome", "not known: the log ends before the trial did")]
    outcome = f"ended by {end['error']}: {end['text']}"
    if end["outcome"] == IMPORTED:
        outcome = "imported from a bag, which has no outcome"
    elif not end["error"]:
        outcome = (
            f"{_outcome(end)}; exploration {end['exploration_time_s']:.3f} s, {end['actions']} actions,"
            f" peak force {end['peak_force_N']:.2f} N, depth {end['depth_m'] * 1e3:.3f} mm"
        )
    lines = [("outcome", outcome), ("truth", _truth(end)), ("stopped by", end["stopped_by"])]
    if end["timing"]:
        late, longest = end["timing"]["late_ms"], end["timing"]["longest_ns"]
        lines.append(("late by", ", ".join(f"{name} {ms:.2f} ms" for name, ms in late.items())))
        lines.append(("longest", ", ".join(f"{name} {ns * 1e-6:.2f} ms" for name, ns in longest.items())))
    return lines


def _truth(end: Mapping[str, Any]) -> str:
    if end["success"] is None or end["error"]:
        return ""
    text = "success" if end["success"] else "no success"
    if end["true_peak_force_N"] is not None:
        text += f"; peak force {end['true_peak_force_N']:.2f} N"
    if end["true_depth_m"] is not None:
        text += f", depth {end['true_depth_m'] * 1e3:.3f} mm"
    for name, key in (("tip", "true_tip_in_task_m"), ("hole", "true_hole_in_task_m")):
        if end[key]:
            # The sum turns -0.0 into 0.0.
            text += f"; {name} at {' '.join(f'{round(each * 1e3, 3) + 0.0:.3f}' for each in end[key])} mm"
    return text


def _outcome(end: Mapping[str, Any]) -> str:
    return str(end["error"] or end["outcome"] or "unknown")


def _pairs(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values.items())


def _spread(spread: Mapping[str, float] | None) -> str:
    if spread is None:
        return "unknown"
    return "median {median:.3f} ms, from {min:.3f} to {max:.3f} ms".format(**{k: v * 1e3 for k, v in spread.items()})


def _number(value: float | None, form: str, factor: float = 1.0) -> str:
    return "-" if value is None else format(value * factor, form)
