"""Methods that soft-touch judges, each a file with `load(case, **setting)`, `SETTINGS` and `BEST`."""
