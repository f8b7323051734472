"""Exported trials, read back by the readers of the viewers themselves."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

from palpate.adapters.visualisation.live import export_pictures
from tests.golden.record import HERE as GOLDEN
from tests.unit.adapters.visualisation.live.test_trial_stream import shown

NAME = "train-paper"


def decoded(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Messages by topic, with nothing but the schemas in the file."""
    found: dict[str, list[tuple[int, Any]]] = {}
    classes: dict[str, Any] = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            assert schema is not None
            if channel.message_encoding == "json":
                content: Any = json.loads(message.data)
            else:
                if schema.name not in classes:
                    pool = descriptor_pool.DescriptorPool()
                    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                        pool.Add(file)  # type: ignore[no-untyped-call]
                    classes[schema.name] = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
                content = classes[schema.name].FromString(message.data)
            found.setdefault(channel.topic, []).append((message.log_time, content))
    return found


def test_foxglove_reads_frames_scene_and_values(tmp_path: Path) -> None:
    (made,) = export_pictures([GOLDEN / f"{NAME}.mcap"], tmp_path / "out", "foxglove")
    topics, display = decoded(made), shown(NAME)
    assert made.name == f"{NAME}.foxglove.mcap"
    assert [(t, (m["fx_N"], m["tz_Nm"])) for t, m in topics["/wrench"]] == [
        (t, (row[0], row[5])) for t, row in display.rows["wrench"]
    ]
    for (time_ns, message), (at_ns, frames, _) in zip(topics["/tf"], display.poses, strict=True):
        assert time_ns == at_ns
        got = {t.child_frame_id: (t.translation.x, t.rotation.w) for t in message.transforms}
        assert got == {name: (pose.position_m[0], pose.quaternion[0]) for name, pose in frames.items()}
        assert {t.parent_frame_id for t in message.transforms} == {"base"}
    (_, scene), *_ = topics["/scene"]
    boxes = {entity.frame_id: len(entity.cubes) for entity in scene.entities}
    assert boxes["plate"] == len(display.scenes[0]["plate"])
    arrow = topics["/force"][-1][1].entities[0].arrows[0]
    _, _, (begin, vector) = display.poses[-1]  # type: ignore[misc]
    w, x, y, z = (getattr(arrow.pose.orientation, axis) for axis in "wxyz")
    heading = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    np.testing.assert_allclose(heading * (arrow.shaft_length + arrow.head_length), vector, atol=1e-12)
    assert arrow.pose.position.z == begin[2]
    assert topics["/action_values"][0][1]["values"]


def test_rerun_reads_frames_and_values(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    from rerun.chunk import RrdReader

    (made,) = export_pictures([GOLDEN / f"{NAME}.mcap"], tmp_path / "out", "rerun")
    display, rows, places = shown(NAME), list[tuple[Any, Any]](), list[Any]()
    for chunk in RrdReader(made).stream().to_chunks():
        batch = chunk.to_record_batch()
        if chunk.entity_path == "/wrench" and not chunk.is_static:
            times_ns = np.array(batch.column("run clock").cast("int64")).tolist()
            rows += zip(times_ns, batch.column("Scalars:scalars").to_pylist(), strict=True)
        if chunk.entity_path == "/cell/peg" and not chunk.is_static:
            places += batch.column("Transform3D:translation").to_pylist()
    assert rows == [(time_ns, list(row)) for time_ns, row in display.rows["wrench"]]
    peg = [frames["peg"].position_m for _, frames, _ in display.poses]
    np.testing.assert_allclose([place[0] for place in places], peg, atol=1e-7)
