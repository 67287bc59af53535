"""A forward model as a function that PyTorch or JAX differentiates, by its ``vjp`` and ``jvp``.

The conductivity may be one, (n_cells,), or many, (…, n_cells). All is computed in double precision
on the processor; what is given has the type and device of what was taken.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tomoskin.core import FloatArray, ModelError, needed
from tomoskin.model.forward.model import ForwardModel

_WHERE = "the differentiable model"


def torch_voltages(model: ForwardModel) -> Callable[[Any], Any]:
    """A function of PyTorch: conductivity (…, n_cells) S or S/m → voltages (…, n_meas) V.

    Raises
    ------
    DataError
        When PyTorch is not installed.
    ModelError
        When a contact impedance is complex; from the function, when a conductivity is impossible.
    """
    torch: Any = needed("torch", "torch", _WHERE)
    _check_real(model)

    def computed(product: Callable[..., FloatArray], like: Any, *others: Any) -> Any:
        arrays = [one.detach().cpu().double().numpy() for one in (like, *others)]
        return torch.from_numpy(np.ascontiguousarray(product(*arrays))).to(like)

    def forward(context: Any, conductivity: Any) -> Any:
        context.save_for_backward(conductivity)
        context.save_for_forward(conductivity)
        return computed(model.solve_many, conductivity)

    def backward(context: Any, weights: Any) -> Any:
        return computed(model.vjp, *context.saved_tensors, weights)

    def along(context: Any, change: Any) -> Any:
        return computed(model.jvp, *context.saved_tensors, change)

    once = torch.autograd.function.once_differentiable
    methods = {"forward": forward, "backward": once(backward), "jvp": along}
    statics = {name: staticmethod(method) for name, method in methods.items()}
    function: Any = type("Voltages", (torch.autograd.Function,), statics)
    apply: Callable[[Any], Any] = function.apply
    return apply


def jax_voltages(model: ForwardModel) -> Callable[[Any], Any]:
    """A function of JAX: conductivity (…, n_cells) S or S/m → voltages (…, n_meas) V.

    It works under ``jit``, ``grad`` and ``vmap``. Raises as :func:`torch_voltages` does.
    """
    jax: Any = needed("jax", "jax", _WHERE)
    _check_real(model)

    def computed(product: Callable[..., FloatArray], width: int, like: Any, *others: Any) -> Any:
        def on_host(*arrays: Any) -> Any:
            return product(*(np.asarray(one, np.float64) for one in arrays)).astype(like.dtype)

        given = jax.ShapeDtypeStruct((*like.shape[:-1], width), like.dtype)
        return jax.pure_callback(on_host, given, like, *others, vmap_method="broadcast_all")

    @jax.custom_vjp  # type: ignore[untyped-decorator]
    def voltages(conductivity: Any) -> Any:
        return computed(model.solve_many, model.pattern.n_meas, conductivity)

    def backward(conductivity: Any, weights: Any) -> tuple[Any]:
        return (computed(model.vjp, conductivity.shape[-1], conductivity, weights),)

    voltages.defvjp(lambda conductivity: (voltages(conductivity), conductivity), backward)
    of_conductivity: Callable[[Any], Any] = voltages
    return of_conductivity


def _check_real(model: ForwardModel) -> None:
    if np.iscomplexobj(model.contacts):
        raise ModelError(
            "expected real contact impedances, got complex ones",
            hint="take the products of the model itself: jvp and vjp",
        )
