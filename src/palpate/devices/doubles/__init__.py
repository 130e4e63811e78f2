"""Devices without hardware: doubles of services and of the vendors' libraries, with a hand that moves by itself.

    haply_simulator, crtk_simulator   services, on what service_double has for both
    library_doubles                   compiles the C sources beside it: force_dimension_double, openhaptics_double

`palpate devices simulate` and tests load them; nothing else does.
"""
