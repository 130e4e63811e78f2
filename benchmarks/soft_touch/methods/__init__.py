"""Methods that soft-touch judges: files with `load(case, **setting)`, and `SETTINGS` or `settings_of(case)`."""
