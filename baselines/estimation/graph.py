"""Linear models as an ONNX graph that simulates like `Polynomial.simulate`, in double precision."""

from __future__ import annotations

from typing import Any

import numpy as np

from simgap.baselines.estimation.polynomial import Polynomial

OPSET = 17


def build(model: Polynomial, n: int) -> Any:
    """Build u [B, T, nu], y_init [B, n, ny] -> y_hat [B, T-n, ny]; the state that n samples show is linear in them."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    (ny, nu), (f, g, h, d) = model.b.shape[1:], model.state_space
    units = np.eye(n * (nu + ny))
    u, y = units[:, : n * nu].reshape(-1, n, nu), units[:, n * nu :].reshape(-1, n, ny)
    start = model.state_after(u, y).reshape(len(units), -1)  # [n nu + n ny, ns]
    constants = {
        "start_map": start, "f": f.T, "g": g.T, "h": h.T, "d": d.T, "u_mean": model.u_mean, "y_mean": model.y_mean,
        "n": np.array([n]), "nothing": np.array([0]), "end": np.array([np.iinfo(np.int64).max]), "time": np.array([1]),
        "flat": np.array([0, -1]),
    }  # fmt: skip

    def value(name: str, *shape: Any) -> Any:
        return helper.make_tensor_value_info(name, TensorProto.DOUBLE, shape)

    body = helper.make_graph(
        [
            helper.make_node("MatMul", ["s", "f"], ["free"]), helper.make_node("MatMul", ["now", "g"], ["forced"]),
            helper.make_node("Add", ["free", "forced"], ["after"]),
            helper.make_node("MatMul", ["s", "h"], ["of_state"]), helper.make_node("MatMul", ["now", "d"], ["at_once"]),
            helper.make_node("Add", ["of_state", "at_once"], ["reading"]),
        ],
        "sample", [value("s", "B", len(f)), value("now", "B", nu)],
        [value("after", "B", len(f)), value("reading", "B", ny)],
    )  # fmt: skip
    nodes = [
        helper.make_node("Sub", ["u", "u_mean"], ["du"]), helper.make_node("Sub", ["y_init", "y_mean"], ["dy"]),
        helper.make_node("Slice", ["du", "nothing", "n", "time"], ["du_init"]),
        helper.make_node("Slice", ["du", "n", "end", "time"], ["du_after"]),
        helper.make_node("Reshape", ["du_init", "flat"], ["u_flat"]),
        helper.make_node("Reshape", ["dy", "flat"], ["y_flat"]),
        helper.make_node("Concat", ["u_flat", "y_flat"], ["seen"], axis=1),
        helper.make_node("MatMul", ["seen", "start_map"], ["start"]),
        helper.make_node("Scan", ["start", "du_after"], ["last", "deviation"], body=body, num_scan_inputs=1,
                         scan_input_axes=[1], scan_output_axes=[1]),
        helper.make_node("Add", ["deviation", "y_mean"], ["y_hat"]),
    ]  # fmt: skip
    graph = helper.make_graph(
        nodes, "simulate", [value("u", "B", "T", nu), value("y_init", "B", n, ny)], [value("y_hat", "B", "N", ny)],
        [numpy_helper.from_array(np.ascontiguousarray(array), name) for name, array in constants.items()],
    )  # fmt: skip
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    onnx.checker.check_model(made, full_check=True)
    return made
