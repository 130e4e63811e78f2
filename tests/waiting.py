"""Waiting for processes and threads: for what must come, and never for a time that a busy machine may take."""

from __future__ import annotations

import time

PATIENCE = 100.0  # s until a test fails that waits in vain
RAMP = 100  # ticks from which on a force has ramped in


def wait_for(condition, pause=0.01):
    """Wait until a condition holds."""
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(pause)


def watch(loop, done, each=lambda: None):
    """Return the different states that a loop publishes, until they are enough."""
    states, until, looked = [], time.monotonic() + PATIENCE, 0.0
    while True:
        each()
        state, now = loop.read(), time.monotonic()
        if not states or state.tick > states[-1].tick:
            states.append(state)
        if now - looked > 0.05:
            if done(states):
                return states
            looked = now
        assert now < until, "waited in vain"
        time.sleep(0.0005)


def watch_for(loop, seconds):
    """Return the different states of so many seconds of the loop's own ticks."""
    return watch(loop, lambda states: states[-1].time - states[0].time >= seconds)


def settled(states):
    """Return the states whose force has ramped in: a busy machine's clock may jump, which is a fault."""
    good, since, faults = [], 0, 0
    for state in states:
        if state.fault or state.waiting or state.faults != faults:
            since, faults = state.tick, state.faults
        elif state.tick > since + RAMP:
            good.append(state)
    return good


def press(loop, target, done):
    """Hold a page's body at a place of the hand (3,), m, until it is done; take hold anew where the body let go."""

    def held():
        state = loop.read()
        if state.waiting:
            loop.shared.write_command(grabbed=False)
            wait_for(lambda: not loop.read().grabbed)
        loop.shared.write_command(beat=time.perf_counter() + 60, grabbed=True, target=target)
        return done(state)

    wait_for(held)
