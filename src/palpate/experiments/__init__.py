"""Examinations by hand and experiments with people.

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
"""
