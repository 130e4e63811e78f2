"""Learnt bodies as functions of torch and JAX: the numbers of palpate's own kernels, and derivatives that agree."""

from __future__ import annotations

import numpy as np
import pytest

from exported_bodies import body as body_of
from palpate.errors import UsageError

DOUBLE = 1e-12  # relative: rounding of some hundred operations
NAMES = ("energy", "force", "stiffness", "depth", "deviation")


BODIES = ("contact", "closed", "pad", "constant", "indentation")


def made(name):
    """A body without its memory: a batch has no history."""
    return body_of(name).with_memory(None)


def rows(body, count=200):
    low, high = np.array([r.low for r in body.inputs]), np.array([r.high for r in body.inputs])
    beyond = 0.1 * (high - low)
    return np.random.default_rng(2).uniform(low - beyond, high + beyond, (count, len(low)))


def agree(ours, theirs, tolerance=DOUBLE):
    ours, theirs = np.asarray(ours, dtype=float), np.asarray(theirs, dtype=float)
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).max() <= tolerance * np.abs(theirs).max()


@pytest.fixture(scope="module")
def torch():
    return pytest.importorskip("torch")


@pytest.fixture(scope="module")
def jax():
    package = pytest.importorskip("jax")
    package.config.update("jax_enable_x64", True)
    return package


@pytest.mark.full
@pytest.mark.parametrize("body", [made(name) for name in BODIES], ids=BODIES)
class TestTorch:
    def function(self, body):
        from palpate.adapters.torch import TorchBody

        return TorchBody(body)

    def test_numbers_are_those_of_the_kernels(self, torch, body):
        X, touch = rows(body, 2500), self.function(body)  # more than are answered together
        x = torch.from_numpy(X)
        touching = body.energy.depth(X) > 0.0  # far from a surface its exported distance is rough
        for name in NAMES[: 5 if body.energy.root is not None else 4]:
            agree(getattr(touch, name)(x)[touching], getattr(body.energy, name)(X)[touching])
        assert np.array_equal(touch.inside(x).numpy(), body.energy.inside(X))

    def test_energy_slopes_are_the_force(self, torch, body):
        X = rows(body)
        x = torch.from_numpy(X).requires_grad_()
        self.function(body).energy(x).sum().backward()
        felt = len(body.energy.baseline.directions)
        agree(-x.grad[:, :felt], body.energy.force(X) @ body.energy.baseline.directions.T)

    def test_gradients_agree_with_differences_in_all_inputs(self, torch, body):
        touch = self.function(body)
        x = torch.from_numpy(rows(body, 2))
        assert torch.autograd.gradcheck(touch.energy, x.requires_grad_(), eps=1e-7, atol=1e-6, rtol=1e-4)

    @pytest.mark.filterwarnings("ignore:`torch.jit.script` is deprecated")  # torch's own, at its first jvp
    @pytest.mark.parametrize("derivative", ["jacrev", "jacfwd"])
    def test_derivatives_of_derivatives_map_over_rows(self, torch, body, derivative):
        """Of one row at a time, as torch.func has it: ∂F/∂x, and the same from the energy's second derivative."""
        X, touch, D = rows(body, 40), self.function(body), body.energy.baseline.directions
        x, felt, by = torch.from_numpy(X), len(D), getattr(torch.func, derivative)
        bend = torch.func.vmap(by(lambda row: touch.force(row[None])[0]))(x)[..., :felt]
        agree(bend, body.energy.stiffness(X) @ D.T, 1e-9)
        twice = torch.func.vmap(torch.func.hessian(lambda row: touch.energy(row[None])[0]))(x)
        inner = body.energy.inside(X)  # beyond the deepest training slopes are taken by differences
        agree(-twice[inner][:, :felt, :felt], (D @ body.energy.stiffness(X) @ D.T)[inner], 1e-9)

    def test_single_precision_has_six_digits(self, torch, body):
        from palpate.adapters.torch import TorchBody

        X = rows(body)
        agree(TorchBody(body, torch.float32).force(torch.from_numpy(X).float()), body.energy.force(X), 1e-4)

    def test_wrong_inputs_are_named(self, torch, body):
        touch = self.function(body)
        with pytest.raises(UsageError, match=r"must be a tensor \(N, "):
            touch.force(torch.zeros(4, 7, dtype=torch.float64))
        with pytest.raises(UsageError, match="float32"):
            touch.force(torch.zeros(4, len(body.inputs), dtype=torch.float32))


@pytest.mark.full
@pytest.mark.parametrize("body", [made(name) for name in BODIES[:3]], ids=BODIES[:3])
class TestJax:
    def function(self, body):
        from palpate.adapters.jax import JaxBody

        return JaxBody(body)

    def test_numbers_are_those_of_the_kernels(self, jax, body):
        X, touch = rows(body, 2100), self.function(body)
        touching = body.energy.depth(X) > 0.0
        for name in NAMES[: 5 if body.energy.root is not None else 4]:
            agree(getattr(touch, name)(X)[touching], getattr(body.energy, name)(X)[touching])
        assert np.array_equal(touch.inside(X), body.energy.inside(X))

    def test_derivatives_are_force_and_stiffness(self, jax, body):
        X, touch, D = rows(body), self.function(body), body.energy.baseline.directions
        felt = len(D)
        slopes = jax.jit(jax.vmap(jax.grad(touch.energy)))(X)[:, :felt]
        agree(-slopes, body.energy.force(X) @ D.T)
        inner = body.energy.inside(
            X
        )  # beyond the deepest training a third derivative is taken by differences
        bend = jax.jit(jax.vmap(jax.jacfwd(touch.force)))(X)[:, :, :felt]
        agree(bend[inner], (body.energy.stiffness(X) @ D.T)[inner], 1e-9)

    def test_wrong_inputs_are_named(self, jax, body):
        with pytest.raises(UsageError, match="must have shape"):
            self.function(body).energy(np.zeros(7))


@pytest.mark.full
def test_what_remembers_is_refused(jax):
    from palpate.adapters.jax import JaxBody

    with pytest.raises(UsageError, match="no function of a place"):
        JaxBody(body_of("relaxation"))
