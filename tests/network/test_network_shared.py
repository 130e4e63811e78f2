"""Publication: whole networks or none, in another process too, whatever is written meanwhile."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.network import Publisher, Subscriber
from palpate.network.radial import RADIAL_FUNCTIONS

from .networks import FORMS, any_network, points
from .reader import X0


def publisher_of(network, **more):
    return Publisher.create(network.inputs, network.outputs, **({"units": 20} | more))


def test_every_network_arrives_bit_for_bit():
    first = any_network(3, 6, 1)
    with publisher_of(first, modes=3) as publisher, Subscriber.attach(publisher.name) as subscriber:
        for serial, (form, radial, modes) in enumerate(
            ((f, r, k) for f in FORMS for r in RADIAL_FUNCTIONS for k in (None, 3)), 1
        ):
            network = any_network(3, 6, serial % 21, form=form, radial=radial, modes=modes)
            assert publisher.publish(network) == serial
            assert subscriber.fetch()
            assert not subscriber.fetch()
            X = points(network, 4)
            np.testing.assert_array_equal(subscriber.network.predict(X), network.predict(X))
            np.testing.assert_array_equal(subscriber(X[0]), network.predict(X)[0])
            assert (subscriber.network.radial, subscriber.serial) == (radial, serial)
            assert subscriber.network.inputs == network.inputs


def test_a_held_network_is_a_value_that_later_ones_do_not_change():
    a, b = any_network(2, 3, 5), any_network(2, 3, 9, form="rank 1", seed=0)
    X = points(a, 5)
    with publisher_of(a) as publisher:
        subscriber = Subscriber.attach(publisher.name, jacobian=True)
        publisher.publish(a)
        assert subscriber.fetch()
        held = subscriber.network
        for _ in range(5):
            publisher.publish(b)
            subscriber.fetch()
        np.testing.assert_array_equal(held.predict(X), a.predict(X))
        subscriber(X[0])
        np.testing.assert_array_equal(subscriber.jacobian, b.jacobian(X[0]))
    subscriber.close()
    np.testing.assert_array_equal(subscriber.network.predict(X), b.predict(X))
    subscriber.close()


@pytest.mark.parametrize("damage", ["odd", "bytes", "checksum"])
def test_half_a_network_is_never_taken(damage):
    network = any_network(2, 3, 5)
    with publisher_of(network) as publisher, Subscriber.attach(publisher.name) as subscriber:
        publisher.publish(network)
        assert subscriber.fetch()
        publisher.publish(replace(network, weights=2 * network.weights))
        slot = publisher._memory.slots[0]  # where the second lies
        if damage == "odd":
            slot._sequence[()] += 1  # as if the writer had died before the end
        elif damage == "bytes":
            slot._shared[100] ^= 1
        else:
            slot._checksum[()] ^= 1
        assert not subscriber.fetch()
        np.testing.assert_array_equal(subscriber.network.weights, network.weights)
        third = replace(network, weights=3 * network.weights)
        publisher.publish(third)
        assert subscriber.fetch()
        np.testing.assert_array_equal(subscriber.network.weights, third.weights)


OUTPUTS = 40  # with up to 300 units a copy takes long enough to be overtaken


def numbered(serial: int, rng: np.random.Generator):
    """A random network of random size whose output j at X0 is `serial` + j."""
    network = any_network(3, OUTPUTS, int(rng.integers(1, 300)), form="rotated", seed=int(rng.integers(100)))
    network = replace(network, inputs=any_network(3, OUTPUTS, 1).inputs)
    scale = network.scaling.output_scale
    tail = np.array(network.tail)
    tail[:, 0] += (serial + np.arange(OUTPUTS) - network.predict(X0[None])[0]) / scale
    return replace(network, tail=tail)


@pytest.mark.full
def test_a_reader_in_another_process_sees_only_whole_networks():
    rng = np.random.default_rng(0)
    kinds = [numbered(0, rng) for _ in range(50)]
    last = 3000
    with publisher_of(kinds[0], units=300) as publisher:
        reader = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("reader.py")), publisher.name, str(last)],
            stdout=subprocess.PIPE,
            text=True,
        )
        with reader:
            publisher.publish(numbered(1, rng))
            assert reader.stdout.readline() == "ready\n"
            for serial in range(2, last + 1):
                network = kinds[serial % len(kinds)]
                tail = np.array(network.tail)
                tail[:, 0] += serial / network.scaling.output_scale
                assert publisher.publish(replace(network, tail=tail)) == serial
            found = json.loads(reader.stdout.read())
    assert reader.returncode == 0
    assert found["serial"] == last
    assert found["backwards"] == 0
    assert found["worst"] < 1e-10 * last
    assert found["fetched"] > 50  # it did read while we wrote


def test_what_does_not_fit_is_refused():
    network = any_network(3, 4, 5)
    with publisher_of(network, units=5, rank=3, modes=2) as publisher:
        for wrong, words in [
            (any_network(3, 4, 6), "exceed"),
            (any_network(3, 4, 5, modes=3), "exceed"),
            (any_network(2, 4, 5), "declared"),
            (any_network(3, 5, 5), "declared"),
            (replace(network, weights=np.full((4, 5), 1e200)), "overflow"),
        ]:
            with pytest.raises(UsageError, match=words):
                publisher.publish(wrong)
        assert publisher.publish(network) == 1
    with pytest.raises(UsageError, match="closed"):
        publisher.publish(network)
    with pytest.raises(UsageError, match="exceed"), publisher_of(network, rank=2) as small:
        small.publish(network)
    for capacity in ({"units": -1}, {"rank": 0}, {"rank": 4}, {"modes": -1}):
        with pytest.raises(UsageError, match="no room"):
            publisher_of(network, **capacity)


def test_names_that_are_nobodys_are_refused(tmp_path):
    with pytest.raises(UsageError, match="No network is published"):
        Subscriber.attach(str(tmp_path / "none"))
    (tmp_path / "other").write_bytes(b"\0" * 4096)
    with pytest.raises(UsageError, match="another version of palpate"):
        Subscriber.attach(str(tmp_path / "other"))


def test_before_the_first_network_there_is_none_and_after_the_last_no_name():
    network = any_network(1, 1, 1)
    with publisher_of(network) as publisher, Subscriber.attach(publisher.name) as subscriber:
        assert not subscriber.fetch()
        for ask in (lambda: subscriber.network, lambda: subscriber(np.zeros(1)), lambda: subscriber.jacobian):
            with pytest.raises(UsageError, match="fetch"):
                ask()
    assert not Path(publisher.name).exists()
    publisher.close()
