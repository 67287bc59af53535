"""Sessions as datasets of LeRobot, and touch in the forms in which policies take it."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tomoskin.extras.lerobot.dataset import Like as Like, write_lerobot as write_lerobot
    from tomoskin.extras.lerobot.policy_forms import (
        FIELDS as FIELDS,
        POSE as POSE,
        SLOTS as SLOTS,
        PolicyForms as PolicyForms,
        PolicyView as PolicyView,
        Slots as Slots,
    )

_HOME = {
    "FIELDS": "policy_forms",
    "Like": "dataset",
    "POSE": "policy_forms",
    "PolicyForms": "policy_forms",
    "PolicyView": "policy_forms",
    "SLOTS": "policy_forms",
    "Slots": "policy_forms",
    "write_lerobot": "dataset",
}
"""Where each name lives; it is imported when it is first asked for, so that options cost little."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
