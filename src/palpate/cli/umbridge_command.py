"""`palpate serve-umbridge`: a learnt file as a model of UM-Bridge, for programs of optimisation and statistics."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import count_option
from palpate.errors import PortInUseError

__all__ = ["serve_umbridge"]

PORT = 4242  # the port that UM-Bridge's own servers take


def serve_umbridge(
    file: Annotated[Path, typer.Argument(help="Model file (.palpate).")],
    port: Annotated[
        int, count_option("--port", least=0, help="Port on 127.0.0.1; 0: any that is free.")
    ] = PORT,
) -> None:
    """Serve a model to UM-Bridge clients: value, gradient, Jacobian and Hessian, on this machine only, until Ctrl-C."""
    from palpate.export.umbridge_server import HOST, UMBridgeServer, served_models
    from palpate.learning.loading import load_surrogate

    models = served_models(load_surrogate(file))
    try:
        server = UMBridgeServer(models, port)
    except (OSError, OverflowError) as error:
        raise PortInUseError(
            f"Port {port} of {HOST} can't be taken.",
            why=str(error),
            fix="Another server may have it: choose another --port, or 0 for any that is free.",
        ) from error
    say = Console().say
    for name, model in models.items():
        operations = ", ".join(word for word, there in model.support.items() if there)
        units = ", ".join(unit or "1" for unit in model.units)
        say(f"{name}: inputs {list(model.sizes)}, outputs [{model.outputs}], in {units}; {operations}")
    say(f"Serving {file} at {server.url}, without a password. Ctrl-C ends it.")
    try:
        server.serve_forever()
    except KeyboardInterrupt:  # the way to end it
        pass
    finally:
        server.server_close()
