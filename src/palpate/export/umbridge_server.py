"""Learnt files as models of UM-Bridge, over HTTP on this machine: values, slopes, and actions of the Hessian.

A body that is touched is served as ``energy`` (J) and ``force`` (N) of two vectors: the felt coordinates, then the
further inputs, if there are any; under a tool that tells its torque, also as ``torque`` (N m, without slopes).
Quantities are served under the names of their groups, a network alone as ``outputs``. All is in SI units.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.network import Network
from palpate.surrogates import LearntQuantities, Surrogate
from palpate.version import __version__

__all__ = ["HOST", "ServedModel", "UMBridgeServer", "served_models"]

HOST = "127.0.0.1"
_NAMES = ("127.0.0.1", "localhost")  # of this machine; another one that leads here is DNS rebinding
_LARGEST = 16_000_000  # bytes of a request
_PATIENCE = 10.0  # s for the lines of a request
PROTOCOL = 1.0  # version of UM-Bridge's protocol


@dataclass(frozen=True)
class ServedModel:
    """A function of vectors; the first one is what it is differentiated by."""

    sizes: tuple[int, ...]  # of the input vectors
    outputs: int
    value: Callable[[np.ndarray], np.ndarray]  # all inputs (n,) to (m,)
    jacobian: Callable[[np.ndarray], np.ndarray] | None  # to (m, k), by the first vector
    hessian: Callable[[np.ndarray], np.ndarray] | None  # to (m, k, k)
    inside: Callable[[np.ndarray], bool]  # whether the answer is of the trained region
    units: tuple[str, ...]  # of all inputs, then of the outputs

    @property
    def support(self) -> dict[str, bool]:
        """Operations of the protocol that the model answers."""
        slopes = dict.fromkeys(("Gradient", "ApplyJacobian"), self.jacobian is not None)
        return {"Evaluate": True, **slopes, "ApplyHessian": self.hessian is not None}


def served_models(surrogate: Surrogate) -> dict[str, ServedModel]:
    """Return the models by name that a surrogate is served as; one that has none is refused."""
    served = _touch_models(surrogate) if surrogate.can_be_touched else {}
    served |= {name: _quantities(part) for name, part in surrogate.quantities.items()}
    if not served:
        raise UsageError(
            "A surrogate without energy and without quantities can't be served.",
            why="UM-Bridge's models answer a few numbers, not fields.",
            fix="Learn numbers too: map one place of a field, or its largest value, by `at` or `reduce`.",
        )
    return served


def _touch_models(body: Surrogate) -> dict[str, ServedModel]:
    energy = body.hand_energy
    directions = np.asarray(energy.baseline.directions, dtype=float)
    felt, further = len(directions), len(body.inputs) - len(directions)
    sizes = (felt, further) if further else (felt,)

    def force(x: np.ndarray) -> np.ndarray:
        return np.asarray(directions @ energy.force(x[None])[0])

    def stiffness(x: np.ndarray) -> np.ndarray:
        return np.asarray(directions @ energy.stiffness(x[None])[0] @ directions.T)

    def inside(x: np.ndarray) -> bool:
        return bool(energy.inside(x[None])[0])

    units = tuple(r.unit for r in body.inputs)
    torque = ServedModel(
        sizes, 3, lambda x: body.torque(x[None])[0], None, None, inside, (*units, *["N m"] * 3)
    )
    return {
        **({} if body.torque_evaluator is None else {"torque": torque}),
        "energy": ServedModel(
            sizes,
            1,
            lambda x: np.asarray(energy.energy(x[None])),
            lambda x: -force(x)[None],
            lambda x: -stiffness(x)[None],
            inside,
            (*units, "J"),
        ),
        "force": ServedModel(sizes, felt, force, stiffness, None, inside, (*units, *["N"] * felt)),
    }


def _quantities(part: LearntQuantities) -> ServedModel:
    return replace(_numbers(part.network), inside=lambda x: bool(part.trusted(x[None])[0]))


def _numbers(network: Network) -> ServedModel:
    n, m = len(network.inputs), len(network.outputs)
    singles = [network.select([i]) for i in range(m)]
    low = np.array([r.low for r in network.inputs])
    high = np.array([r.high for r in network.inputs])
    return ServedModel(
        (n,),
        m,
        lambda x: network.predict(x[None])[0],
        network.jacobian,
        lambda x: np.stack([single.hessian(x) for single in singles]),
        lambda x: bool(((x >= low) & (x <= high)).all()),
        (*(r.unit for r in network.inputs), *(q.unit for q in network.outputs)),
    )


class _ProtocolError(Exception):
    """A request that can't be answered, with the protocol's name of the reason."""

    def __init__(self, kind: str, message: str, status: int = 400) -> None:
        super().__init__(message)
        self.kind, self.status = kind, status


class UMBridgeServer(ThreadingHTTPServer):
    """A server of models on this machine alone; `serve_forever` answers until `shutdown`."""

    daemon_threads = True

    def __init__(self, models: Mapping[str, ServedModel], port: int = 0) -> None:
        self.models = models
        super().__init__((HOST, port), _Handler)

    @property
    def url(self) -> str:
        """Address for clients."""
        return f"http://{HOST}:{self.server_address[1]}"

    def answer(self, path: str, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the answer to a request of the protocol; `_ProtocolError` where there is none."""
        if path == "/Info":
            return {"protocolVersion": PROTOCOL, "models": list(self.models)}
        name = request.get("name")
        if not isinstance(name, str) or name not in self.models:
            known = ", ".join(self.models)
            raise _ProtocolError("ModelNotFound", f"There is no model {name!r}. Models are {known}.")
        model = self.models[name]
        if path == "/ModelInfo":
            return {"support": model.support, "units": list(model.units)}
        if path == "/InputSizes":
            return {"inputSizes": list(model.sizes)}
        if path == "/OutputSizes":
            return {"outputSizes": [model.outputs]}
        operation = path.lstrip("/")
        if not model.support.get(operation, False):
            status = 400 if operation in model.support else 404
            raise _ProtocolError("UnsupportedFeature", f"{name!r} does not answer {operation!r}.", status)
        x = _vectors(request.get("input"), model.sizes)
        return {"output": _compute(operation, model, x, request), "inside": model.inside(x)}


def _compute(operation: str, model: ServedModel, x: np.ndarray, request: Mapping[str, Any]) -> list[Any]:
    if operation == "Evaluate":
        return [_finite(model.value(x))]
    for key in ("outWrt", "inWrt", "inWrt1", "inWrt2"):
        if request.get(key, 0) != 0:
            raise _ProtocolError(
                "UnsupportedFeature",
                f"{key} is {request[key]!r}: models have one output, and derivatives by the first input vector.",
            )
    assert model.jacobian is not None  # or it would not be supported
    if operation == "Gradient":
        return _finite(_vector(request, "sens", model.outputs) @ model.jacobian(x))
    vector = _vector(request, "vec", model.sizes[0])
    if operation == "ApplyJacobian":
        return _finite(model.jacobian(x) @ vector)
    assert model.hessian is not None
    return _finite(np.einsum("m,mij,j->i", _vector(request, "sens", model.outputs), model.hessian(x), vector))


def _finite(values: np.ndarray) -> list[float]:
    if not np.isfinite(values).all():
        raise _ProtocolError("InvalidOutput", "The answer is not a number.", 500)
    return [float(value) for value in values]


def _vectors(value: Any, sizes: Sequence[int]) -> np.ndarray:
    """Return all inputs (n,) of a list of vectors."""
    if not isinstance(value, list) or [np.shape(part) for part in value] != [(size,) for size in sizes]:
        raise _ProtocolError("InvalidInput", f"input is no list of vectors of the sizes {list(sizes)}.")
    return np.concatenate([_numbers_of(part, "input") for part in value])


def _vector(request: Mapping[str, Any], key: str, size: int) -> np.ndarray:
    value = request.get(key)
    if not isinstance(value, list) or np.shape(value) != (size,):
        raise _ProtocolError("InvalidInput", f"{key} is no vector of {size} numbers.")
    return _numbers_of(value, key)


def _numbers_of(values: Sequence[Any], what: str) -> np.ndarray:
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        raise _ProtocolError("InvalidInput", f"{what} holds what is no number.")
    numbers = np.array(values, dtype=float)
    if not np.isfinite(numbers).all():
        raise _ProtocolError("InvalidInput", f"{what} holds what is no finite number.")
    return numbers


class _Handler(BaseHTTPRequestHandler):
    server: UMBridgeServer
    protocol_version = "HTTP/1.1"
    server_version = f"palpate/{__version__}"
    timeout = _PATIENCE

    def do_GET(self) -> None:
        """Answer ``/Info``."""
        self._respond({})

    def do_POST(self) -> None:
        """Answer the other requests of the protocol, whose arguments are JSON."""
        request = self._request()
        if request is None:
            self.close_connection = True
            self._send(
                400, _error("InvalidInput", f"The request is no JSON object of at most {_LARGEST} bytes.")
            )
        else:
            self._respond(request)

    def _request(self) -> dict[str, Any] | None:
        """Return the arguments of a request; None where they are no JSON object."""
        try:
            size = int(self.headers.get("content-length", ""))
            request = json.loads(self.rfile.read(size) or b"{}") if 0 <= size <= _LARGEST else None
        except (ValueError, RecursionError):
            return None
        return request if isinstance(request, dict) else None

    def _respond(self, request: Mapping[str, Any]) -> None:
        host = (self.headers.get("host") or "").rpartition(":")[0] or self.headers.get("host")
        if host not in _NAMES:
            self._send(
                403, _error("InvalidInput", "This server answers requests to 127.0.0.1 and localhost.")
            )
            return
        try:
            self._send(200, self.server.answer(self.path, request))
        except _ProtocolError as error:
            self._send(error.status, _error(error.kind, str(error)))
        except UsageError as error:
            self._send(400, _error("InvalidInput", str(error)))

    def _send(self, status: int, content: Mapping[str, Any]) -> None:
        body = json.dumps(content).encode()
        self.send_response(status)
        self.send_header("content-type", "application/json")
        self.send_header("content-length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Log no line for a request."""


def _error(kind: str, message: str) -> dict[str, Any]:
    return {"error": {"type": kind, "message": message}}
