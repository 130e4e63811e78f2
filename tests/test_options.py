"""Options are declared once: the same default, bounds and text reach Python, study files and the command line."""

from __future__ import annotations

import inspect

import pytest

from palpate.errors import UsageError
from palpate.options import EnergyOptions, Noise, SearchOptions, declarations, takes


@takes(EnergyOptions)
def learn(data, *, options: EnergyOptions, **further):
    """Learn.

    Parameters
    ----------
    data : array
        Samples.

    Returns
    -------
    EnergyOptions
    """
    return options, further


def test_a_function_takes_a_record_or_its_fields_as_keywords():
    assert learn(0) == (EnergyOptions(), {})
    assert learn(0, effort=0.1, other=1) == (EnergyOptions(effort=0.1), {"other": 1})
    assert learn(0, options=EnergyOptions(seed=3), effort=0.1)[0] == EnergyOptions(seed=3, effort=0.1)


def test_signature_and_help_show_every_option():
    shown = inspect.signature(learn).parameters
    for name, declaration in declarations(EnergyOptions).items():
        assert shown[name].default == declaration.default == getattr(EnergyOptions(), name)
        assert declaration.sentence in learn.__doc__.split("Returns")[0]
    assert declarations(Noise)["absolute"].sentence in Noise.__doc__


@pytest.mark.parametrize(
    "wrong",
    [{"effort": 0.0}, {"effort": True}, {"workers": 0}, {"seed": 1.5}, {"seed": None}, {"seconds": "10"}],
)
def test_an_option_beyond_its_bounds_is_refused_with_its_meaning(wrong):
    (name,) = wrong
    with pytest.raises(UsageError, match=f"The option {name}") as error:
        SearchOptions(**wrong)
    assert declarations(SearchOptions)[name].sentence in error.value.why


def test_keys_of_a_study_are_the_same_options():
    from palpate.study.stage_records import EnergyLearningRecord

    for name in ("effort", "seconds", "workers", "units_max", "target", "seed"):
        key, declaration = EnergyLearningRecord.model_fields[name], declarations(EnergyOptions)[name]
        assert (key.default, key.description) == (declaration.default, declaration.text)
