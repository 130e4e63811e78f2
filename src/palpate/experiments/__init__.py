"""Examinations by hand and experiments with people: psychometrics, placement, live sittings, scores.

All of it was tried on simulated observers and scripted participants only.

::

    append_record      events in a file that is only ever appended to
    exam_lumps         a hidden lump, what it adds to the energy of a pressed body, and where it may lie
    exam_kinds         kinds of examination: what is hidden, and what the examiner is told
    exam_folders       examinations on this machine: one folder each, never replaced
    examination        one examination while it is taken: marks, time, interruptions
    exam_touch         what was pressed: presses, depths over the surface, order of search
    exam_practice      practice: each mark is answered at once
    exam_score         what was found and missed, false alarms, area, force and time
    exam_report        the score as a page with a map of the body
    exam_page          the page on which a person examines
    psychometric       functions of the level, their posterior, goodness of fit
    placement          which level comes next: constant stimuli, staircases, adaptive
    course             trials of one condition: order, catch trials, counts
    observers          simulated people             simulation  a course on many of them
    groups             random effects, equivalence, power
    experiment_plan    the plan, a TOML file         ready_plans  plans to be filled in
    outlook            what a plan can show          analysis     what people said
    ratings            statements that were rated, by an ordinal model
    recorded_presses   the full model's presses  analysis_picture functions and people, drawn
    sitting            a sitting as a value          study_folder its files
    stimuli            the bodies that are felt      conductor    leads a live sitting
    live_sitting       opens all that one needs      experiment_pages, pages/  the two pages

Names are loaded when they are first used: SciPy's distributions cost time that an examination doesn't need.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
