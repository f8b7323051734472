"""Facts about logs as text: a page for one log, a table for several."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from palpate.adapters.log.info import LATE_S, LogInfo, PortInfo, TickInfo, TimeSpread
from palpate.adapters.log.tables import aligned

_MOST_LINES: Final = 5


def describe(info: LogInfo) -> str:
    """A page about one log."""
    what = info.what
    lines = [
        info.path,
        _line("trial", f"{what['command']}, {what['arm']}, scenario {what['scenario']}, seed {what['seed']}, "
              f"trial {what['trial']}"),
        _line("policy", _policy(what)),
        _line("world", what["world"] + (", a what-if and no observation" if what["what_if"] else "")),
        _line("format", what["schema"]),
        _line("versions", ", ".join(f"{name} {version}" for name, version in info.versions.items())),
    ]  # fmt: skip
    if info.damage:
        lines.insert(1, _line("DAMAGED", info.damage))
    if what["drawn"]:
        lines.append(_line("drawn", ", ".join(f"{name} {value}" for name, value in what["drawn"].items())))
    if what["derived_from"]:
        lines.append(_line("made from", what["derived_from"]))
    lines += [
        _line("duration", f"{info.ticks.duration_s:.3f} s, {info.ticks.count} ticks"),
        _line("size", _size(info)),
        _line("messages", ", ".join(f"{topic} {count}" for topic, count in info.messages.items() if count)),
    ]
    lines += _loop(info.ticks)
    lines += _port("force sensor", info.force_sensor) + _port("encoders", info.joint_encoder)
    lines.append(_line("not trusted", _not_valid(info)))
    altered = _counts(info.altered_commands)
    lines.append(_line("commands", f"altered: {altered}" if altered else "all applied as asked"))
    lines.append(_line("arm stopped", f"{info.stops} time{'s' * (info.stops != 1)}"))
    if info.acknowledged:
        lines += _listed("acknowledged", info.acknowledged)
    lines += _listed("errors", info.errors)
    lines += _listed("recorder", info.losses, head=f"{info.dropped_messages} messages dropped")
    if (trip := info.trip) is not None:
        lines.append(_line("trip", f"{trip['reason']}: {trip['text']} (tick {trip['tick']})"))
    return "".join(line + "\n" for line in lines + _end(info.end))


def table(infos: Sequence[LogInfo]) -> str:
    """A line for each log."""
    head = ("log", "trial", "policy", "s", "Hz", "age ms", "missing", "late", "lost", "altered", "outcome", "MB/min")
    rows = [head]
    for info in infos:
        ticks = info.ticks
        rows.append(
            (
                info.path,
                str(info.what["trial"]),
                info.what["policy"],
                f"{ticks.duration_s:.2f}",
                _number(ticks.rate_Hz, ".2f"),
                _number(info.force_sensor.age.median_s, ".2f", 1e3),
                str(ticks.missing),
                str(ticks.late),
                str(info.dropped_messages),
                str(sum(info.altered_commands.values())),
                "damaged" if info.damage else "cut short" if info.end is None else _outcome(info.end),
                _number(info.bytes_per_minute, ".2f", 1e-6),
            )
        )
    # Words to the left, numbers to the right.
    return aligned(rows, left=(0, 2, 10))


def _line(name: str, text: str) -> str:
    return f"  {name:<15}{text}".rstrip()


def _policy(what: Mapping[str, Any]) -> str:
    name = "from a policy file or learned" if what["policy"] == "document" else what["policy"]
    text = f"{name}, {'does not learn' if what['frozen'] else 'learns'}"
    return text if what["temperature"] is None else f"{text}, temperature {what['temperature']:.3g}"


def _size(info: LogInfo) -> str:
    text = f"{info.size_bytes / 1e3:.1f} kB, messages {info.raw_bytes / 1e3:.1f} kB before compression"
    rate = info.bytes_per_minute
    return text if rate is None else f"{text}; {rate / 1e6:.2f} MB per minute of trial"


def _loop(ticks: TickInfo) -> list[str]:
    interval = ticks.interval
    lines = [
        _line("control rate", f"{_number(ticks.rate_Hz, '.3f')} Hz; interval {_spread(interval)}, "
              f"deviation {_ms(interval.stdev_s)}"),
        _line("late ticks", f"{ticks.late} by more than {LATE_S * 1e3:g} ms; lateness {_spread(ticks.lateness)}"),
    ]  # fmt: skip
    if ticks.missing:
        shown = [f"{a}" if a == b else f"{a} to {b}" for a, b in ticks.gaps[:_MOST_LINES]]
        shown += ["..."] * (len(ticks.gaps) > _MOST_LINES)
        lines.append(_line("missing ticks", f"{ticks.missing}: {', '.join(shown)}"))
    else:
        lines.append(_line("missing ticks", "none"))
    if ticks.incomplete:
        lines.append(_line("incomplete", f"{ticks.incomplete} ticks lack a reading or the command"))
    return lines


def _port(name: str, port: PortInfo) -> list[str]:
    read = f"{port.new} new samples and {port.repeats} repeats in {port.samples} readings"
    rate = f"{_number(port.rate_Hz, '.3f')} Hz"
    device = f"the device made {_number(port.device_rate_Hz, '.3f')} Hz, {port.unread} samples of it are not here"
    return [
        _line(name, f"{read}, {rate}; {device}"),
        _line("", f"age at the tick {_spread(port.age)}; from measuring to receiving {_spread(port.delivery)}"),
    ]


def _not_valid(info: LogInfo) -> str:
    parts = [
        f"{name}: {_counts(port.not_valid)}"
        for name, port in (("force sensor", info.force_sensor), ("encoders", info.joint_encoder))
        if port.not_valid
    ]
    return "; ".join(parts) or "no sample: all are valid"


def _listed(name: str, texts: Sequence[str], head: str = "") -> list[str]:
    if not texts:
        return [_line(name, "nothing lost" if head else "none")]
    shown = [_line(name, head or str(len(texts)))] + [_line("", " ".join(text.split())) for text in texts[:_MOST_LINES]]
    more = len(texts) - _MOST_LINES
    return shown + [_line("", f"and {more} more")] * (more > 0)


def _end(end: Mapping[str, Any] | None) -> list[str]:
    if end is None:
        return [_line("outcome", "not known: the log ends before the trial did")]
    if end["error"]:
        return [_line("outcome", f"ended by {end['error']}: {end['text']}"), *_rig(end)]
    lines = [
        _line("outcome", f"{_outcome(end)}; exploration {end['exploration_time_s']:.3f} s, {end['actions']} actions, "
              f"peak force {end['peak_force_N']:.2f} N, depth {end['depth_m'] * 1e3:.3f} mm"),
    ]  # fmt: skip
    if end["success"] is not None:
        truth = "success" if end["success"] else "no success"
        if end["true_peak_force_N"] is not None:
            truth += f"; peak force {end['true_peak_force_N']:.2f} N"
        if end["true_depth_m"] is not None:
            truth += f", depth {end['true_depth_m'] * 1e3:.3f} mm"
        for name, key in (("tip", "true_tip_in_task_m"), ("hole", "true_hole_in_task_m")):
            if end[key]:
                truth += f"; {name} at {' '.join(_mm(v) for v in end[key])} mm"
        lines.append(_line("truth", truth))
    return lines + _rig(end)


def _rig(end: Mapping[str, Any]) -> list[str]:
    """What only a rig in real time records."""
    lines = [_line("stopped by", end["stopped_by"])] if end["stopped_by"] else []
    if end["timing"]:
        late, longest = end["timing"]["late_ms"], end["timing"]["longest_ns"]
        lines.append(_line("late by", ", ".join(f"{name} {ms:.2f} ms" for name, ms in late.items())))
        lines.append(_line("longest", ", ".join(f"{name} {ns * 1e-6:.2f} ms" for name, ns in longest.items())))
    return lines


def _outcome(end: Mapping[str, Any]) -> str:
    return str(end["error"] or end["outcome"] or "unknown")


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def _spread(spread: TimeSpread) -> str:
    if spread.median_s is None:
        return "unknown"
    return f"median {_ms(spread.median_s)}, from {_ms(spread.min_s)} to {_ms(spread.max_s)}"


def _ms(seconds: float | None) -> str:
    return "unknown" if seconds is None else f"{seconds * 1e3:.3f} ms"


def _mm(metres: float) -> str:
    # The sum turns -0.0 into 0.0.
    return f"{round(metres * 1e3, 3) + 0.0:.3f}"


def _number(value: float | None, form: str, factor: float = 1.0) -> str:
    return "-" if value is None else format(value * factor, form)
