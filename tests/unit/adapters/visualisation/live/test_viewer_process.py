"""What the viewer's process makes of the frames that it is given."""

import dataclasses
import json
import os

from palpate.adapters.log import FRAME, MESSAGE, QUIT, frame, message_frame, sound_messages
from palpate.adapters.visualisation.live import LearningSoFar
from palpate.adapters.visualisation.live.viewer_process import NOTE, WholeFrames, show
from tests.golden.record import HERE as GOLDEN
from tests.unit.adapters.visualisation.live.kept_display import KeptDisplay

TICK = message_frame(2, 5, b"x" * 1000)


def test_frames_come_whole_out_of_pieces() -> None:
    data, frames = TICK + message_frame(7, -3, b"") + TICK, WholeFrames()
    found = [each for at in range(0, len(data), 7) for each in frames.of(data[at : at + 7])]
    assert [(kind, m.channel, m.time_ns, len(m.payload)) for kind, m in found] == [
        (MESSAGE, 2, 5, 1000),
        (MESSAGE, 7, -3, 0),
        (MESSAGE, 2, 5, 1000),
    ]


def test_a_curve_of_before_goes_on_and_a_bad_message_hides_no_others() -> None:
    curve = LearningSoFar()
    curve.add(0, 2.5, success=True, peak_N=9.0)
    note = json.dumps({"text": "goes on", "curve": dataclasses.asdict(curve)}).encode()
    path = GOLDEN / "first-kind.mcap"
    messages = [message_frame(m.channel, m.time_ns, m.payload) for m in sound_messages("log", path.read_bytes())]
    end = (GOLDEN / "train-sarsa.mcap").read_bytes()
    whole = [message_frame(m.channel, m.time_ns, m.payload) for m in sound_messages("log", end) if m.channel != 2]
    begin, rest = messages[0], messages[1:]
    display, (source, sink) = KeptDisplay(), os.pipe()
    noted = FRAME.pack(NOTE, 0, 7, len(note)) + note
    os.write(sink, b"".join([noted, begin, TICK, *rest, *whole, frame(QUIT), begin]))
    show(source, display)
    os.close(source)
    os.close(sink)
    assert display.events[0] == ("goes on", False)
    assert [serious for text, serious in display.events if "cannot be shown" in text] == [True]
    assert display.curve.trials == [0, 1]
    assert len(display.scenes) == 2
