"""A layer of a Transformer in exports: as lines of a step, and as nodes of an ONNX graph."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from simgap.neural.training.attention import Attending, Attention


def write(writer: Any, block: Attending, x: str, nx: int) -> tuple[str, int]:
    """Write a layer for one sample; keys and values of the last `span` samples are its state."""
    after, y = writer.array(nx), writer.array(nx)
    found = _write_attention(writer, block.attention, writer.normed(block.before, x, nx), nx)
    writer.lines.append(f"add({x}, {found}, {nx}, {after}, 0)")
    wide = writer.dense(block.wide, writer.normed(block.between, after, nx), nx, 1)
    writer.lines.append(f"add({after}, {writer.dense(block.narrow, *wide)[0]}, {nx}, {y}, 0)")
    return y, nx


def _write_attention(writer: Any, layer: Attention, x: str, nx: int) -> str:
    span, size = layer.span, nx // layer.heads
    q, kept, score, y = (writer.array(n) for n in (nx, 2 * nx, span, nx))
    at = writer.take(2 * nx * span)
    weight, bias = layer.qkv.weight, layer.qkv.bias
    offsets = writer.weights(layer.offsets)
    writer.lines += [
        f"dense({x}, {nx}, {q}, {nx}, {writer.weights(weight[:nx], bias[:nx])}, 0)",
        f"dense({x}, {nx}, {kept}, {2 * nx}, {writer.weights(weight[nx:], bias[nx:])}, 0)",
        f"remember({kept}, {2 * nx}, s, {at}, {span})",
        f"attend({q}, {nx}, s, {at}, {span}, {score}, {layer.heads}, {size}, {y}, {offsets})",
    ]
    return str(writer.dense(layer.out, y, nx)[0])


def add(graph: Any, block: Attending, x: str) -> str:
    """Add a layer over x [B, T, F]."""
    found = _add_attention(graph, block.attention, graph.normed(block.before, x))
    x = graph.add("Add", x, found)
    wide = graph.add("Relu", graph.dense(block.wide, graph.normed(block.between, x)))
    return str(graph.add("Add", x, graph.dense(block.narrow, wide)))


def _add_attention(graph: Any, layer: Attention, x: str) -> str:
    """Attend with the samples on the last axis; a convolution gives the past of each feature an axis of its own."""
    span, heads, features = layer.span, layer.heads, layer.out.in_features
    past = np.zeros((features, span, 1, span), np.float32)
    past[:, range(span), 0, range(span)[::-1]] = 1
    delays = graph.constant(past.reshape(-1, 1, span))
    parts = graph.add("Transpose", graph.dense(layer.qkv, x), perm=[0, 2, 1])
    q, k, v = (
        graph.add("Slice", parts, graph.whole(i * features), graph.whole((i + 1) * features), graph.whole(1))
        for i in range(3)
    )

    def split(of: str, rows: int) -> str:
        return str(graph.add("Reshape", of, graph.whole(0, heads, features // heads, rows, -1)))  # [B, H, d, rows, T]

    k, v = (split(graph.add("Conv", of, delays, group=features, pads=[span - 1, 0]), span) for of in (k, v))
    root = graph.constant(np.float32(math.sqrt(features // heads)))
    score = graph.add("Mul", graph.add("Div", split(q, 1), root), k)
    score = graph.add("ReduceSum", score, graph.whole(2), keepdims=1)
    score = graph.add("Add", score, graph.weight(layer.offsets[:, None, :, None]))
    seen = graph.add("Mul", graph.add("Softmax", score, axis=3), v)
    y = graph.add("Reshape", graph.add("ReduceSum", seen, graph.whole(3), keepdims=0), graph.whole(0, features, -1))
    return str(graph.dense(layer.out, graph.add("Transpose", y, perm=[0, 2, 1])))
