# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Boxes of regions and surfaces as vision_msgs/Detection3DArray."""

from __future__ import annotations

from typing import Any

import numpy as np

from topo_region_seg.beyond.boxes.surfaces import surface_boxes
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.poses import pose, vector
from topo_region_seg.cloud.messages.types import MessageTypes
from topo_region_seg.data import FloatArray

CLASSES = {"regions": "region", "objects": "object", "supervoxels": "supervoxel"}
"""What a region is called, by what gets a label."""
UNJUDGED = 1.0
"""Score of what has no confidence: only objects of a camera's image are judged."""


def detections(types: MessageTypes, answer: Answer) -> Any:
    """Return one detection per region: its label, its oriented box, what it is and how sure that is."""
    boxes, kind = answer.boxes, CLASSES[answer.seg.params.output]
    confidence = answer.seg.regions.confidence
    score = np.where(np.isnan(confidence), UNJUDGED, confidence).tolist()
    given = zip(boxes.label.tolist(), score, boxes.center, boxes.quaternion, boxes.size, strict=True)
    found = [_detection(types, answer, str(label), kind, sure, *box) for label, sure, *box in given]
    return types.Detection3DArray(header=answer.header, detections=found)


def surfaces(types: MessageTypes, answer: Answer) -> Any:
    """Return one detection per surface that was set aside: a flat box, z along its normal.

    They have no id, as nothing follows them from frame to frame.
    """
    boxes = surface_boxes(answer.cloud, answer.seg)
    given = zip(boxes.support.tolist(), boxes.center, boxes.quaternion, boxes.size, strict=True)
    found = [
        _detection(types, answer, "", "support" if support else "structure", UNJUDGED, *box) for support, *box in given
    ]
    return types.Detection3DArray(header=answer.header, detections=found)


def _detection(
    types: MessageTypes,
    answer: Answer,
    name: str,
    kind: str,
    score: float,
    center: FloatArray,
    turn: FloatArray,
    size: FloatArray,
) -> Any:
    place = types.PoseWithCovariance(pose=pose(types, center, turn), covariance=np.zeros(36))
    result = types.ObjectHypothesisWithPose(hypothesis=types.ObjectHypothesis(class_id=kind, score=score), pose=place)
    return types.Detection3D(
        header=answer.header,
        results=[result],
        bbox=types.BoundingBox3D(center=pose(types, center, turn), size=vector(types, size)),
        id=name,
    )
