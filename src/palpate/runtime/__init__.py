"""In the hand: a real-time process that reads a device, evaluates the learnt body and sends a force back.

    shared, records                   state out and commands in, through shared memory
    process, child, report            LoopProcess: the parent's handle, and the process behind it
    loop, publisher, rehearsal        one tick, as a list of stages
    clock, priority, histogram        being on time, and knowing how much so
    safety, faults, stability         what may reach a hand
    workspace, devices                where the hand is
    touchable, pressed                what it is laid on
    realtime                          what this machine permits

Names are loaded when asked for, so that the loop's process imports nothing it doesn't need.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
