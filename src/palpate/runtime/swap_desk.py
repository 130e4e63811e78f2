"""The loop's side of a swap: a thread that takes the new surrogate and makes all ready, beside the ticking loop.

Whoever asks has read and prepared it (`handover`); what is left (the checks, the evaluators, where memories take over
from) is done in this thread. The loop only finds the finished swap and begins it with its next tick. The kernels are
those that it has compiled already, because another kind of body is refused.

The interpreter's lock is what the two share. While the thread works it is asked for every 0.1 ms and not every 5 ms;
and where the loop has real-time scheduling the thread has it too, one step below, since a thread that holds the lock
and waits behind other people's work would make the loop wait with it.
"""

from __future__ import annotations

import json
import queue
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from palpate.errors import FileFormatError, PalpateError
from palpate.runtime.blending import compile_blend
from palpate.runtime.handover import take
from palpate.runtime.loop import Loop
from palpate.runtime.realtime import obtain_beside
from palpate.runtime.rehearsal import Rehearsal
from palpate.runtime.replay import loop_facts
from palpate.runtime.safety import Limits
from palpate.runtime.swap import Swap, swap_between
from palpate.runtime.touchable import Touchable

__all__ = ["SwapDesk"]

_LOOK = 2e-3  # s between two looks at a swap that is under way
_SWITCH = 1e-4  # s after which a thread that holds the interpreter is asked for it


class SwapDesk:
    """Takes wishes for other surrogates, one after the other, and answers each.

    `say` takes each answer: ``swap``, the number of the wish, and ``begun``, the tick, or ``refused``, why not.
    """

    def __init__(self, say: Callable[[dict[str, object]], None]) -> None:
        self._say = say
        self._wishes: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()

    def ask(self, line: str) -> None:
        """Take a wish: JSON with ``swap``, its number, ``shared``, ``seconds``, and the ``model`` as files know it."""
        self._wishes.put(json.loads(line))

    def serve(self, model: Touchable, loop: Loop, limits: Limits, rehearsal: Rehearsal) -> None:
        """Begin to work, in a thread of its own, for the `model` that `loop` answers with, before its first tick.

        The `rehearsal` rehearses with another evaluator of the same body.
        """
        compile_blend()
        arguments = (model, loop, limits, rehearsal)
        threading.Thread(target=self._work, args=arguments, name="palpate-swaps", daemon=True).start()

    def _work(self, model: Touchable, loop: Loop, limits: Limits, rehearsal: Rehearsal) -> None:
        while True:
            wish = self._wishes.get()
            obtain_beside()
            usual = sys.getswitchinterval()
            sys.setswitchinterval(_SWITCH)
            try:
                swap, new = _prepare(wish, model, loop, limits, rehearsal)
            except PalpateError as error:
                self._refuse(wish, error)
                continue
            except Exception as error:  # noqa: BLE001 - kinds of bodies may be foreign code; the old one stays
                self._refuse(wish, _foreign_fault(wish, error))
                continue
            finally:
                sys.setswitchinterval(usual)
            loop.swap = swap
            while not swap.begun:
                time.sleep(_LOOK)
            said = {"begun": swap.begun, "model": wish["model"], "seconds": swap.seconds}
            self._say({"swap": wish["swap"]} | said)
            while not swap.ended:  # the next wish waits
                time.sleep(_LOOK)
            model = new  # and the old one is freed here, not in a tick
            del swap, new

    def _refuse(self, wish: dict[str, Any], error: PalpateError) -> None:
        said = {"kind": type(error).__name__, "what": error.what, "why": error.why, "fix": error.fix}
        self._say({"swap": wish["swap"], "refused": said})


def _prepare(
    wish: dict[str, Any], model: Touchable, loop: Loop, limits: Limits, rehearsal: Rehearsal
) -> tuple[Swap, Touchable]:
    """Return the swap that is wished, and the new body."""
    new = take(wish["shared"])
    stiffness = new.stiffness_max if loop.motors else 0.0
    swap = swap_between(model, new, seconds=float(wish["seconds"]), stiffness=stiffness)
    said = loop_facts(new, loop, limits) | {"body_stiffness": stiffness, "model": wish["model"]}
    swap.facts = json.dumps(said, allow_nan=False).encode()
    spare = new.evaluator()
    swap.rehearse = lambda: rehearsal.take(spare)
    return swap, new


def _foreign_fault(wish: dict[str, Any], error: Exception) -> FileFormatError:
    return FileFormatError(
        f"{wish['model']['file']} could not be made ready: {type(error).__name__}: {error}.",
        why="The body in the hand stays.",
        fix="Learn it again, or take another file.",
    )
