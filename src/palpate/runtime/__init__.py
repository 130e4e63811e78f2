"""In the hand: a real-time process that reads a device, evaluates the learnt body and sends a force back.

    shared_state, publisher           state and indentation out, commands in, through shared memory
    process, child                    LoopProcess: the parent's handle, and the process behind it
    loop                              one tick, as a list of stages
    realtime, loop_report             punctuality, and how well it was kept
    safety, passivity                 what may reach a hand
    stability, coupling               how stiff a body may feel, and the spring in front of one that is stiffer
    workspace                         where the hand is, whose device `palpate.devices` reads
    touchable, hand_evaluator         what it is laid on, and what answers it
    recording, recorder, snapshot     every tick on its way into a file, from any moment on
    trace_export                      tables made of that file
    replay                            the same loop on recorded samples

Names are loaded when asked for, so that the loop's process imports nothing it doesn't need.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
