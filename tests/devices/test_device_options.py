"""Options of devices are numbers as people write them; what is none is refused by name before a device opens."""

from __future__ import annotations

import pytest

from palpate.devices import device_traits
from palpate.devices.device_options import settings_from
from palpate.devices.stroke import StrokeSettings
from palpate.errors import UsageError


def test_a_number_is_read_as_it_is_written():
    texts = {"amplitude": "0,02", "frequency": "1e0", "y": "−1", "shape": "ramp"}
    settings = settings_from(StrokeSettings, texts)
    assert (settings.amplitude, settings.frequency, settings.y, settings.shape) == (0.02, 1.0, -1.0, "ramp")


@pytest.mark.parametrize("text", ["1_0", "inf", "nan", "", "20mm", "0x1", "１", "1,234"])
def test_what_is_no_number_is_refused_with_the_option(text):
    with pytest.raises(UsageError, match="The device option amplitude: "):
        settings_from(StrokeSettings, {"amplitude": text})


def test_a_decimal_comma_between_options_is_named():
    with pytest.raises(UsageError) as refusal:
        device_traits("simulated:amplitude=0,02")
    assert "Commas stand between the options" in str(refusal.value)
    assert "amplitude=0.5" in refusal.value.fix
